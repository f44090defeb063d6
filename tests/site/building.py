"""The site's devices, each with its wiring, its driver and its simulated device (plant).

Lift1 is on the GPIO header. It has one door contact, no motion line, and a binary floor code with
parity. Lift2 is on a Modbus module. It has two door contacts, a motion line, a one-hot floor code, and
pulsed calls. An operator must reset the fire alarm of Lift2.

One of the five doors is on the header. Two doors are on the module, one of them with pulses. Two doors
have register maps. The site has three charging stations.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import msgspec

from bridges.kinds.charger import KIND as CHARGER
from bridges.kinds.door import KIND as DOOR
from bridges.kinds.lift import KIND as LIFT
from bridges.kinds.shared.kind import AnyDeviceKind
from bridges.settings.load import load
from drivers import Driver
from drivers.charger import http as charger_http
from drivers.door import dry_contact as door_dry_contact
from drivers.door import register as door_register
from drivers.lift import dry_contact as lift_dry_contact
from hal_fakes import http_charger
from hal_fakes.modbus.register_door import FakeRegisterDoor, contacts
from hal_fakes.plants import door as door_plant
from hal_fakes.plants import lift as lift_plant
from hal_fakes.plants.machine import WiredPlant
from tests.drivers.far import Far, HttpFar, PointsFar, RegisterFar
from tests.drivers.lift.wirings import alarm, coil, line
from tests.site.timeline import Timeline

CONFIG = Path(__file__).parents[2] / "config"
FLOORS = ["L1", "L2", "L3", "L4"]
LIFTS = ("Lift1", "Lift2")
DOORS = ("ward", "lab", "store", "gate", "icu")
CHARGERS = ("bay1", "bay2", "bay3")
ROBOTS = ("red", "green", "blue", "white", "black")
POLL_S = {"gpio": 0.0, "modbus": 0.05, "http": 0.5}
"""The delay (s) until a daemon sees a change. GPIO reports an edge at once. Other buses wait for the
next poll."""


@dataclass(frozen=True)
class Size:
    """The names of a site's devices and robots, and `stale_after_s` of its lifts and doors."""

    lifts: tuple[str, ...] = LIFTS
    doors: tuple[str, ...] = DOORS
    chargers: tuple[str, ...] = CHARGERS
    robots: tuple[str, ...] = ROBOTS
    stale_after_s: float = 1.0


SITE = Size()


def hospital(lifts: int, doors: int, chargers: int, robots: int) -> Size:
    """Return a site with these numbers of devices and robots. After five doors, names, wirings and
    drivers repeat in the same order. A state is published each second; with this `stale_after_s` the
    simulated daemons need no scan between two of them."""
    return Size(
        tuple(f"Lift{number}" for number in range(1, lifts + 1)),
        _numbered(DOORS, doors),
        tuple(f"bay{number}" for number in range(1, chargers + 1)),
        _numbered(ROBOTS, robots),
        stale_after_s=1.12,
    )


def _numbered(names: tuple[str, ...], many: int) -> tuple[str, ...]:
    return tuple(f"{names[n % len(names)]}{n // len(names) or ''}" for n in range(many))


@dataclass(frozen=True)
class Device:
    """One device: its settings, its driver, and the simulated device (plant) behind the driver.

    Each new daemon makes a new driver by `driver()`. `driver_name` is the driver's name in a YAML.
    """

    name: str
    kind: AnyDeviceKind
    settings: Any
    plant: WiredPlant
    far: Far
    driver_name: str
    driver: Callable[[], Driver[Any, Any]]
    debounce: Mapping[str, float]
    poll_s: float


def devices(timeline: Timeline, size: Size = SITE) -> dict[str, Device]:
    """Return every lift, door and charger of the site by name."""
    stale = size.stale_after_s
    found = [_numbered_lift(timeline, name, n, stale) for n, name in enumerate(size.lifts)]
    found += [_door(timeline, name, number, stale) for number, name in enumerate(size.doors)]
    for number, name in enumerate(size.chargers):
        found.append(_charger(timeline, name, clear_errors_per_h=60 if number % 3 == 0 else 0))
    return {device.name: device for device in found}


def _door(timeline: Timeline, name: str, number: int, stale_after_s: float) -> Device:
    dry, shipped = _dry_doors(), ("ward_door", "lab_door")
    number %= len(DOORS)
    if number >= len(dry):
        settings = _limited(_shipped("door_register", shipped[number - len(dry)]), stale_after_s)
        return _register_door(timeline, name, settings)
    content, bus = dry[number]
    settings = _limited(_convert(door_dry_contact, content), stale_after_s)
    return _dry_door(timeline, name, settings, bus)


def _wired(
    timeline: Timeline,
    name: str,
    kind: AnyDeviceKind,
    driver: Any,
    plant: Any,
    settings: Any,
    bus: str,
) -> Device:
    """Return a device that is wired with contacts and relays."""
    far = PointsFar(timeline, plant, driver.wires(settings))
    return Device(
        name,
        kind,
        settings,
        plant,
        far,
        driver.__name__.rpartition(".")[2],
        lambda: driver.create(name, settings, far),
        driver.debounce(settings),
        POLL_S[bus],
    )


def _numbered_lift(timeline: Timeline, name: str, number: int, stale_after_s: float) -> Device:
    if number % 2 == 0:
        settings, bus = _shipped("lift_dry_contact", "Lift1"), "gpio"
    else:
        settings, bus = _convert(lift_dry_contact, _lift2()), "modbus"
    return _lift(timeline, name, _limited(settings, stale_after_s), bus)


def _limited(settings: Any, stale_after_s: float) -> Any:
    """Return the settings with this time after which the device is OFFLINE."""
    limits = msgspec.structs.replace(settings.limits, stale_after_s=stale_after_s)
    return msgspec.structs.replace(settings, limits=limits)


def _lift(timeline: Timeline, name: str, settings: Any, bus: str) -> Device:
    plant = lift_plant.build(name, settings)
    return _wired(timeline, name, LIFT, lift_dry_contact, plant, settings, bus)


def _dry_door(timeline: Timeline, name: str, settings: Any, bus: str) -> Device:
    plant = door_plant.build(name, settings, door_dry_contact.wires(settings))
    return _wired(timeline, name, DOOR, door_dry_contact, plant, settings, bus)


def _register_door(timeline: Timeline, name: str, settings: Any) -> Device:
    plant = door_plant.build(name, settings, contacts(settings))
    far = RegisterFar(timeline, FakeRegisterDoor(plant, settings))
    return Device(
        name,
        DOOR,
        settings,
        plant,
        far,
        "register",
        lambda: door_register.create(name, settings, far),  # type: ignore[arg-type]
        {},
        POLL_S["modbus"],
    )


def _charger(timeline: Timeline, name: str, clear_errors_per_h: int) -> Device:
    shipped = _shipped("charger_http", "charger_a")
    limits = msgspec.structs.replace(
        shipped.limits, start_timeout_s=45.0, clear_errors_per_h=clear_errors_per_h
    )
    settings = msgspec.structs.replace(shipped, limits=limits)
    plant = http_charger.build(name, settings)
    far = HttpFar(timeline, plant, settings)
    return Device(
        name,
        CHARGER,
        settings,
        plant,
        far,
        "http",
        lambda: charger_http.create(name, settings, far),
        {},
        POLL_S["http"],
    )


@cache
def _shipped(file: str, name: str) -> Any:
    return load(CONFIG / f"{file}.yaml").devices[name]


def _convert(driver: Any, content: dict[str, Any]) -> Any:
    return msgspec.convert(content, driver.DRIVER.settings)


def _lift2() -> dict[str, Any]:
    return {
        "floors": FLOORS,
        "fire_reset": "manual",
        "limits": {"call_pulse_s": 1.0},
        "inputs": {
            "fire_alarm": alarm(0),
            "manual_mode": alarm(1),
            "earthquake": alarm(2),
            "overload": line(3),
            "agv_mode": line(4),
            "door_opened": line(5),
            "door_closed": line(6),
            "stopped": line(7),
        },
        "floor_code": {
            "encoding": "one_hot",
            "lines": {f: line(10 + i) for i, f in enumerate(FLOORS)},
        },
        "outputs": {"agv_mode_request": coil(0), "door_open": coil(1)},
        "calls": {f: coil(10 + i) for i, f in enumerate(FLOORS)},
    }


def _dry_doors() -> list[tuple[dict[str, Any], str]]:
    limits = {"opened": line(0), "closed": line(1)}
    pins = {
        signal: {"point": f"BCM{pin}", "active": active, "pull": "down"}
        for signal, pin, active in (
            ("opened", 5, "high"),
            ("closed", 6, "high"),
            ("obstruction", 12, "low"),
            ("fire", 13, "low"),
        )
    }
    hold = {"hold_open": coil(0)}
    header = {"hold_open": {"point": "BCM18", "active": "high"}}
    store = {
        "inputs": {**limits, "obstruction": alarm(2)},
        "outputs": hold,
        "pulse": {"on_s": 1.0, "every_s": 4.0},
    }
    lab = {"inputs": {**limits, "fire": alarm(2)}, "outputs": hold, "on_fire": "release"}
    return [
        ({"inputs": pins, "outputs": header, "on_fire": "open"}, "gpio"),
        (lab, "modbus"),
        (store, "modbus"),
    ]
