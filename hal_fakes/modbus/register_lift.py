"""A lift's gateway. The numbers of its register map show the plant's contacts. Each of its commands
switches a relay of the plant.

Behind the gateway is a lift on contacts. It has one contact for each floor, two for a door, and one for
each hazard. These contacts can be cut in the same way as the daemon's wires.
"""

import math
from collections.abc import Iterator
from itertools import count

import msgspec

from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.lift.signals import Hazard
from drivers.hal.modbus.points import Point
from drivers.lift import dry_contact
from drivers.lift.register import RegisterLiftSettings
from drivers.lift.register_map import LiftMap
from drivers.lift.register_parts import (
    DoorField,
    LiftFlag,
    MotionField,
    NumberField,
    ServiceField,
    place_of,
    point_at,
)
from drivers.lift.table import MOTION
from hal_fakes.fake import Fake
from hal_fakes.plants.lift import LiftPace, LiftPlant
from hal_fakes.plants.plant import Plant

NONSENSE = 65535
"""The value of the whole register for a door that is open and closed at once."""


def contacts(settings: RegisterLiftSettings) -> dry_contact.DryContactLiftSettings:
    """Return the wiring of the contacts of the lift behind the gateway."""
    found, inputs, coils = settings.map, count(), count()

    def line(part: NumberField | LiftFlag | None = None, active: str = "high") -> dict[str, str]:
        when = {"valid_when": part.valid_when} if part and part.valid_when else {}
        point = f"unit {settings.unit} discrete input {next(inputs)}"
        return {"point": point, "active": active, **when}

    def coil() -> dict[str, str]:
        return {"point": f"unit {settings.unit} coil {next(coils)}", "active": "high"}

    wired = {h.value: line(getattr(found, h), "low") for h in Hazard if found.shows(h)}
    if found.shows("agv_mode"):
        wired["agv_mode"] = line()
    for door in ("door", "rear_door"):
        if part := getattr(found, door):
            wired |= {f"{door}_{end}": line(part) for end in ("opened", "closed")}
        ends = [f"{door}_{end}" for end in ("opened", "closed")]
        wired |= {name: line(flag) for name in ends if (flag := found.flag(name))}
    wired |= {name: line(flag) for name in MOTION if (flag := found.flag(name))}
    if found.motion:
        moves = ("moving",) if "moving" in found.motion.codes.values() else ("up", "down")
        wired |= {name: line(found.motion) for name in moves}
    levels = settings.levels()
    floors = {level: line(found.floor) for level in levels}
    singles = [signal for signal, _, _ in found.commands.singles()]
    plain = {
        **{n: getattr(settings, n) for n in LiftSettings.__struct_fields__},
        "inputs": wired,
        "floor_code": {"encoding": "one_hot", "lines": floors},
        "outputs": {n: coil() for n in singles if not n.startswith("call_")},
        "calls": {level: coil() for level in levels},
    }
    return msgspec.convert(msgspec.to_builtins(plain), dry_contact.DryContactLiftSettings)


class FakeRegisterLift:
    """The cells of one gateway, which are its registers and coils. `unit` is the gateway's Modbus unit.
    `points` are all cells, including `outputs`.

    `clears_s` is the time (s) after which the gateway clears the register or coil of a call that it has
    accepted. None means never.
    """

    def __init__(
        self, plant: Plant, settings: RegisterLiftSettings, clears_s: float | None = None
    ) -> None:
        self._clears_s = clears_s
        self._clear_at: dict[Point, float] = {}
        self.plant = plant
        self.unit = settings.unit
        self._map: LiftMap = settings.map
        self._levels = settings.levels()
        self._parts = {n: point_at(self.unit, place_of(p)) for n, p in self._map.parts().items()}
        off = self._map.commands.words((), None)
        self._written = {point_at(self.unit, place): value for place, value in off.items()}
        self._none = dict(self._written)
        calls = self._map.commands.calling()
        self._calling = {point_at(self.unit, place): bits for place, bits in calls.items()}
        self.points = frozenset([*self._parts.values(), *self._written])
        self.outputs = frozenset(self._written)

    def get(self, point: Point, now: float) -> int:
        """Return this point's value at `now` (monotonic s)."""
        self.plant.advance(now)
        if now >= self._clear_at.get(point, math.inf):  # the register clears; the lift's call stays
            bits = self._calling[point]
            self._written[point] = self._written[point] & ~bits | self._none[point] & bits
        value = self._written.get(point, 0)
        for name, place in self._parts.items():
            if place == point:
                value |= self._word(name)
        return value

    def set(self, point: Point, value: int, now: float) -> bool:
        """Write a value. Return False if the point cannot be written. First switch the relays that go
        off."""
        if point not in self._written:
            return False
        self._written[point] = value
        if self._clears_s is not None and point in self._calling:
            self._clear_at[point] = now + self._clears_s
        relays = sorted(self._relays(point, value), key=lambda relay: relay[1])
        for signal, on in relays:
            self.plant.drive(signal, on, now)
        return True

    def _relays(self, point: Point, value: int) -> Iterator[tuple[str, bool]]:
        """Yield (relay, on or off) for each relay that this value switches."""
        commands = self._map.commands
        for signal, _, command in commands.singles():
            if point_at(self.unit, place_of(command)) == point:
                yield signal, value & (command.ask | command.release) == command.ask
        if commands.call and point_at(self.unit, place_of(commands.call)) == point:
            [bits] = [bits for path, _, bits in commands.places() if path == ("call",)]
            for number, level in commands.call.codes.items():
                yield f"call_{level}", value & bits == number

    def _word(self, name: str) -> int:
        part = getattr(self._map, name)
        if isinstance(part, LiftFlag):
            return part.word(self.plant.sense(name))
        if isinstance(part, DoorField):
            return part.word(self._door(name, part))
        if isinstance(part, MotionField):
            return part.word(self._motion(part))
        if isinstance(part, ServiceField):
            return part.word(self._service(part))
        return self._map.floor.word(self._floor())

    def _floor(self) -> int:
        numbers = {level: number for number, level in self._map.floor.codes.items()}
        there = [numbers[level] for level in self._levels if self.plant.sense(f"floor_{level}")]
        return next(iter([*there, *self._map.floor.between_floors]), 0)

    def _door(self, name: str, part: DoorField) -> int:
        ends = {end: self.plant.sense(f"{name}_{end}") for end in ("opened", "closed")}
        if all(ends.values()):
            return NONSENSE
        state = "open" if ends["opened"] else "closed" if ends["closed"] else "moving"
        return next((n for n, meaning in part.codes.items() if meaning == state), NONSENSE)

    def _motion(self, part: MotionField) -> int:
        shown = set(part.codes.values())
        moves = ("moving",) if "moving" in shown else ("up", "down")
        state = next((name for name in moves if self.plant.sense(name)), "stopped")
        return next(n for n, meaning in part.codes.items() if meaning == state)

    def _service(self, part: ServiceField) -> int:
        states = [h.value for h in Hazard if self._map.shows(h) and self.plant.sense(h)]
        states += (
            ["agv_mode"] if self._map.shows("agv_mode") and self.plant.sense("agv_mode") else []
        )
        states += ["normal", "fault"]
        numbers = {state: number for number, state in reversed(part.codes.items())}
        return next((numbers[state] for state in states if state in numbers), NONSENSE)


def build(name: str, settings: RegisterLiftSettings, pace: LiftPace | None = None) -> LiftPlant:
    """Build the lift behind this gateway."""
    return LiftPlant(name, contacts(settings), pace)


FAKE = Fake[RegisterLiftSettings](
    plant=lambda name, settings, wires: build(name, settings),
    station=lambda plant, settings: FakeRegisterLift(plant, settings),
)
