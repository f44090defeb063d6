"""Measure idle daemons' cost, and the cost of each further device. Compare the cost with a bare
transport node."""

from itertools import count
from pathlib import Path
from typing import Any

from bench.charger_servers import chargers_at, http_chargers
from bench.daemons import BARE, WIRES, Content, cost, daemon, shipped
from bench.figures import Rows, Tables, each_more

LIFTS, CAN_CHARGERS, DOORS, HTTP_CHARGERS = (1, 8), (1, 8), (25, 200), (1, 50)
TCP = {"type": "modbus", "tcp": {"host": "127.0.0.1", "port": 502}}
SLCAN = {"port": "/dev/serial/by-id/simulated", "bitrate": 250000}


def measure(scratch: Path) -> Tables:
    """Measure a bare node on each transport, a lift on zenoh, and the shipped devices. Then measure
    many devices of each kind on dds."""
    one = {f"bare node on {wire}": cost([*BARE, wire], scratch / f"{wire}.log") for wire in WIRES}
    lift = daemon(shipped("lift_dry_contact"), scratch / "on_zenoh", "zenoh")
    one["lift_dry_contact on zenoh"] = cost(lift, scratch / "on_zenoh.log")
    for name in ("lift_dry_contact", "door_modbus", "charger_http"):
        one[name] = _cost(scratch, name, shipped(name))
    return {
        "idle": one,
        "lifts in one daemon": _many(scratch, "lifts", {n: lifts(n) for n in LIFTS}),
        "doors on one gateway": _many(scratch, "doors", {n: doors(n) for n in DOORS}),
        "CANopen chargers on one bus": _many(scratch, "can", {n: canopen(n) for n in CAN_CHARGERS}),
        "chargers on HTTP": _http(scratch),
    }


def _cost(scratch: Path, name: str, content: Content, *, simulate: bool = True) -> dict[str, float]:
    command = daemon(content, scratch / name, simulate=simulate)
    return cost(command, scratch / f"{name}.log")


def _many(scratch: Path, name: str, contents: dict[int, Content]) -> Rows:
    rows = {str(n): _cost(scratch, f"{name}_{n}", content) for n, content in contents.items()}
    return {**rows, "each more": each_more(rows, list(contents))}


def _http(scratch: Path) -> Rows:
    """Measure HTTP chargers. Their servers run in a separate process, so the servers do not count to
    the daemon's cost."""
    rows: Rows = {}
    for n in HTTP_CHARGERS:
        with http_chargers(n) as ports:
            rows[str(n)] = _cost(scratch, f"http_{n}", chargers_at(ports), simulate=False)
    return {**rows, "each more": each_more(rows, HTTP_CHARGERS)}


def lifts(many: int) -> Content:
    """Return a YAML with many copies of the shipped lift. Each lift has its own Modbus module."""
    content = shipped("lift_dry_contact")
    one = content["lifts"]["Lift1"]
    lifts = {f"Lift{unit}": _on_module(one, unit) for unit in range(1, many + 1)}
    return {**content, "buses": {"line": TCP}, "lifts": lifts}


def _on_module(lift: Any, unit: int) -> Any:
    coils, inputs = count(), count()

    def moved(part: Any) -> Any:
        if isinstance(part, list):
            return [moved(item) for item in part]
        if not isinstance(part, dict):
            return part
        if "point" not in part:
            return {key: moved(value) for key, value in part.items()}
        place = f"discrete input {next(inputs)}" if "pull" in part else f"coil {next(coils)}"
        return {**{k: v for k, v in part.items() if k != "pull"}, "point": f"unit {unit} {place}"}

    return moved(lift)


def doors(many: int, bus: Content = TCP) -> Content:
    """Return a YAML of doors on one line. Each door is a unit with two limit switches and a relay."""
    return {
        "kind": "door",
        "driver": "dry_contact",
        "buses": {"line": bus},
        "doors": {f"door_{unit}": _door(unit) for unit in range(1, many + 1)},
    }


def _door(unit: int) -> Content:
    def contact(place: str) -> Content:
        return {"point": f"unit {unit} {place}", "active": "high"}

    ends = {"opened": contact("discrete input 0"), "closed": contact("discrete input 1")}
    return {"inputs": ends, "outputs": {"hold_open": contact("coil 0")}}


def canopen(many: int) -> Content:
    """Return a YAML of CANopen receivers on one simulated adapter."""
    return {
        "kind": "charger",
        "driver": "canopen",
        "buses": {"can": {"type": "can", "slcan": SLCAN}},
        "chargers": {f"charger_{node}": {"node": node} for node in range(1, many + 1)},
    }
