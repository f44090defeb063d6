"""Wirings of a lift for tests. The points have consecutive numbers, because only their signals
matter."""

from typing import Any

import msgspec

from drivers.lift.dry_contact import DryContactLiftSettings

FLOORS = ["B1", "G", "1"]


def line(number: int, **more: Any) -> dict[str, Any]:
    """Return an input that reads "not asserted" when its wire is cut."""
    return {"point": f"unit 1 discrete input {number}", "active": "high", **more}


def alarm(number: int) -> dict[str, Any]:
    """Return an input that reads "asserted" when its wire is cut."""
    return line(number) | {"active": "low"}


def coil(number: int) -> dict[str, Any]:
    return {"point": f"unit 1 coil {number}", "active": "high"}


def whole(**changes: Any) -> dict[str, Any]:
    """Return a correct wiring. Each item of `changes` replaces the whole section with its name."""
    return {
        "floors": FLOORS,
        "inputs": {
            "fire_alarm": alarm(0),
            "agv_mode": line(1),
            "door_opened": line(2),
            "door_closed": line(3),
        },
        "floor_code": {
            "encoding": "one_hot",
            "lines": {f: line(10 + i) for i, f in enumerate(FLOORS)},
        },
        "outputs": {"agv_mode_request": coil(0), "door_open": coil(1)},
        "calls": {f: coil(10 + i) for i, f in enumerate(FLOORS)},
        **changes,
    }


def settings(**changes: Any) -> DryContactLiftSettings:
    return msgspec.convert(whole(**changes), DryContactLiftSettings)


def inputs(**more: Any) -> dict[str, Any]:
    """Return the inputs of `whole`, changed by `more`. An input with the value None is left out."""
    return {k: v for k, v in {**whole()["inputs"], **more}.items() if v is not None}


def bits(count: int, first: int = 20) -> list[dict[str, Any]]:
    return [line(first + i) for i in range(count)]
