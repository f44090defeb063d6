"""A lift's gateway on HTTP. The fields of its API show the plant's contacts. Each of its commands
switches a relay of the plant.

A held command ends by itself when its timer is not renewed. A call without `cancel` is a short press of
a button. `hal_fakes/http.py` describes the failures of server, headers and body.
"""

import json
import time
from collections.abc import Iterator, Mapping, Sequence
from itertools import count
from typing import Final

import msgspec

from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.lift.signals import Hazard
from drivers.json_fields import Value, found
from drivers.lift.dry_contact import DryContactLiftSettings
from drivers.lift.http import HttpLiftSettings, api_of
from drivers.lift.json_state import ListedStates
from hal_fakes.fake import Fake
from hal_fakes.http import Asked
from hal_fakes.json_answers import asked, put, value_of
from hal_fakes.plants.lift import LiftPace, LiftPlant
from hal_fakes.plants.plant import Plant

PARTS: Final = ("server", "headers", "body")
PRESS_S: Final = 0.2
NONSENSE: Final = "?"
"""The value for a door that is open and closed at once. It also stands for every state that the YAML
does not list."""
NEVER: Final = float("inf")


def contacts(settings: HttpLiftSettings) -> DryContactLiftSettings:
    """Return the wiring of the contacts of the lift behind the gateway. These contacts can be cut in
    the same way as the daemon's wires."""
    api, numbers = api_of(settings), count()
    state, levels = api.state, settings.levels()

    def line(active: str = "high") -> dict[str, str]:
        return {"point": f"line {next(numbers)}", "active": active}

    wired = {h.value: line("low") for h in Hazard if state.shows(h)}
    inputs = ["agv_mode"] if state.shows("agv_mode") else []
    doors = (name for name in ("door", "rear_door") if getattr(state, name))
    inputs += [f"{door}_{end}" for door in doors for end in ("opened", "closed")]
    if state.motion:
        inputs += ["moving"] if state.motion.moving else ["up", "down"]
    plain = {
        **{n: getattr(settings, n) for n in LiftSettings.__struct_fields__},
        "accept_unsafe": {},
        "inputs": wired | {name: line() for name in inputs},
        "floor_code": {"encoding": "one_hot", "lines": {level: line() for level in levels}},
        "outputs": {name: line() for name in api.commands.held()},
        "calls": {level: line() for level in levels},
    }
    return msgspec.convert(msgspec.to_builtins(plain), DryContactLiftSettings)


def build(name: str, settings: HttpLiftSettings, pace: LiftPace | None = None) -> LiftPlant:
    """Build the lift behind this gateway."""
    return LiftPlant(name, contacts(settings), pace, PARTS)


class FakeHttpLift:
    """The gateway of one lift, as a station of the server (`hal_fakes.http.HttpStation`)."""

    def __init__(self, plant: Plant, settings: HttpLiftSettings) -> None:
        self.plant = plant
        self._api = api_of(settings)
        self._levels = settings.levels()
        self._parts = {asked(call): name for name, call in self._api.state_parts.items()}
        path = self._api.state_path
        self.reads: Sequence[Asked] = [("GET", path, "")] if path else [*self._parts]
        self.commands: Mapping[Asked, tuple[str, bool]] = dict(self._commands())
        self._off_at: dict[str, float] = {}
        self._on: set[str] = set()
        self._last: dict[Asked, bytes] = {}

    def obey(self, signal: str, asserted: bool) -> None:
        """Switch this command's output, and restart its timer. A new car call replaces every other car
        call."""
        now = time.monotonic()
        if signal.startswith("call"):
            for level in self._levels:
                if f"call_{level}" != signal or not asserted:
                    self._drive(f"call_{level}", False, NEVER)
            if not asserted:
                return
            self._drive(signal, True, NEVER if self._api.commands.cancel else now + PRESS_S)
            return
        held = {str(name): command for name, command in self._api.commands.held().items()}
        timer_s = held[signal].switches_off_after_s if asserted else None
        self._drive(signal, asserted, NEVER if timer_s is None else now + timer_s)

    def tick(self) -> None:
        """Switch off every command whose timer has run out."""
        now = time.monotonic()
        for signal in [signal for signal, at in self._off_at.items() if now >= at]:
            self._drive(signal, False, NEVER)

    def answer(self, asked: Asked) -> bytes:
        """Return the present answer to this request. If the server or the body fails, return the spoilt
        answer of the failure mode."""
        self.tick()
        self.plant.advance(time.monotonic())
        server, body = self.plant.failures.get("server"), self.plant.failures.get("body")
        if server == "stuck" and asked in self._last:
            return self._last[asked]
        said: dict[str, object] = {}
        for field, value in self._fields():
            put(said, field, ["?"] if "wrong" in (server, body) else value)
        part = said if self._api.state_path else found(said, self._parts[asked])
        self._last[asked] = json.dumps(part).encode()
        return {"off": b"", "garbage": self._last[asked][:-9]}.get(body or "", self._last[asked])

    def _drive(self, signal: str, on: bool, off_at: float) -> None:
        self._off_at[signal] = off_at
        (self._on.add if on else self._on.discard)(signal)
        self.plant.drive(signal, on, time.monotonic())

    def _commands(self) -> Iterator[tuple[Asked, tuple[str, bool]]]:
        """Yield each command as a request, with its effect on the plant."""
        commands = self._api.commands
        for name, command in commands.held().items():
            yield asked(command.ask), (name, True)
            if command.release:
                yield asked(command.release), (name, False)
        for level in self._levels:
            value = self._api.state.floor.value(level)
            yield asked(commands.calling(level, value)), (f"call_{level}", True)
        if commands.cancel:
            yield asked(commands.cancel), ("call", False)

    def _fields(self) -> Iterator[tuple[str, Value | None]]:
        """Yield each field of the API, with its present value."""
        state = self._api.state
        yield state.floor.field, self._floor()
        for name in ("door", "rear_door"):
            if place := getattr(state, name):
                yield place.field, _value(place, self._door(name))
        if state.motion:
            moves = ("moving",) if state.motion.moving else ("up", "down")
            moving = [name for name in moves if self.plant.sense(name)]
            yield state.motion.field, _value(state.motion, *moving, "stopped")
        if state.service:
            yield state.service.field, _value(state.service, *self._services(), "normal")
        for name in ("agv_mode", *Hazard):
            if place := getattr(state, name):
                yield place.field, value_of(place, self.plant.sense(name))
        if state.online:
            yield state.online.field, value_of(state.online, True)
        if state.age:
            yield state.age.field, 0
        for name, command in self._api.commands.held().items():
            if command.shown:
                yield command.shown.field, value_of(command.shown, name in self._on)

    def _services(self) -> list[str]:
        states = [*Hazard, "agv_mode"]
        return [n for n in states if self._api.state.shows(n) and self.plant.sense(n)]

    def _floor(self) -> Value | None:
        floor = self._api.state.floor
        there = [level for level in self._levels if self.plant.sense(f"floor_{level}")]
        return floor.value(there[0]) if there else next(iter(floor.between_floors), None)

    def _door(self, name: str) -> str:
        ends = [self.plant.sense(f"{name}_{end}") for end in ("opened", "closed")]
        return NONSENSE if all(ends) else "open" if ends[0] else "closed" if ends[1] else "moving"


def _value(place: ListedStates, *states: str) -> Value:
    """Return a value of the API that shows one of these states. The first state that the API can show
    counts. If it has several values, return the first value."""
    listed = place.states()
    return next((listed[state][0] for state in states if state in listed), NONSENSE)


FAKE = Fake[HttpLiftSettings](
    plant=lambda name, settings, wires: build(name, settings),
    station=lambda plant, settings: FakeHttpLift(plant, settings),
)
