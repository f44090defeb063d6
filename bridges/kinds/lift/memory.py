"""What the lift's core remembers from scan to scan, and the limits that it is given."""

import math
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any, Generic, Literal, TypeVar

import msgspec
from msgspec.structs import replace

from bridges.kinds.lift.settings import Durations, LiftSettings
from bridges.kinds.lift.signals import Door, Hazard, LiftOutputs, Motion, Side, Stop
from bridges.kinds.shared.debounce import Settled
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import AGES_AGO, NEVER
from bridges.kinds.shared.freshness import Requester

T = TypeVar("T")
Waiting = Literal["agv", "floor", "door"]


class LiftLimits(msgspec.Struct, frozen=True, dict=True):
    """What the core needs of a lift's settings.

    `stops`: RMF's floor name -> landing and door, from the lowest up. `t`: the durations.
    `debounce`: signal -> s. `alarm_on`: the hazards that are published on the topic `alarm`.
    `by_call`: a call brings AGV mode.
    """

    stops: Mapping[str, Stop]
    t: Durations = Durations()
    debounce: Mapping[str, float] = {}
    fire_reset: Literal["auto", "manual"] = "auto"
    alarm: Literal["none", "fire_alarm_trigger", "emergency_signal"] = "none"
    alarm_on: frozenset[Hazard] = frozenset({Hazard.FIRE})
    by_call: bool = False

    @classmethod
    def of(cls, settings: LiftSettings, debounce: Mapping[str, float]) -> "LiftLimits":
        """From the YAML, and from the wiring table's debounce (signal -> s)."""
        return cls(
            settings.stops(),
            settings.limits,
            debounce,
            settings.fire_reset,
            settings.alarm,
            frozenset(map(Hazard, settings.alarm_on)),
            by_call=settings.agv_mode == "by_call",
        )

    def debounce_s(self, signal: str) -> float:
        """How long a change of this signal must last."""
        return self.debounce.get(signal, 0.0)

    @cached_property
    def levels(self) -> Mapping[str, int]:
        """Each landing's place in the shaft, 0 for the lowest."""
        landings = dict.fromkeys(stop.level for stop in self.stops.values())
        return {level: place for place, level in enumerate(landings)}

    def floors_between(self, level: str, other: str) -> int:
        """How many landings lie between these two."""
        return abs(self.levels[level] - self.levels[other]) - 1

    def floor_name(self, level: str, preferred: str) -> str:
        """RMF's name for a landing: `preferred` if that is one of its names, else the first."""
        if preferred in self.stops and self.stops[preferred].level == level:
            return preferred
        return next(name for name, stop in self.stops.items() if stop.level == level)

    def side(self, floor: str) -> Side:
        """Which of the car's doors serves this floor."""
        return self.stops[floor].side


class Position(msgspec.Struct, frozen=True):
    """Where the car is. `trusted`: the landing last believed, last seen at `seen_at`. `suspect`: one
    that the floor code shows, but that the car cannot have reached.

    `moved_at`: when a reading last did not show the car standing.
    """

    trusted: str | None = None
    seen_at: float = 0.0
    suspect: str | None = None
    moved_at: float | None = None


class Senses(msgspec.Struct, frozen=True):
    """Every input, debounced, and when all were last read."""

    read_at: float | None = None
    code: Settled[tuple[str | None, str]] | None = None
    doors: tuple[Settled[Door | None] | None, Settled[Door | None] | None] = (None, None)
    motion: Settled[Motion | None] | None = None
    agv: Settled[bool | None] | None = None
    hazards: dict[Hazard, Settled[bool]] = {}
    position: Position = Position()


class Forgotten(msgspec.Struct, frozen=True):
    """RMF's supervisor asks for another session instead (`by`, "" for none), or has ended this one
    while its robot goes on asking (`disowned`), `since` when. `ended`: the robot's own END was heard
    once (`bridges/kinds/lift/forgotten.py`)."""

    by: str
    since: float
    ended: bool = False
    disowned: bool = False


class OwnWords(msgspec.Struct, frozen=True):
    """What a robot's own adapter has said. `stamp`: the newest (ns), by its clock. `asked_at`: when it
    last asked for the lift. `ended_at`: when it first sent END after that. `floor`: where it would go.
    `opened`: OPEN has been published there since. `told`: it has asked again after that."""

    stamp: int = 0
    asked_at: float = AGES_AGO
    ended_at: float = AGES_AGO
    floor: str = ""
    opened: bool = False
    told: bool = False


class Doubted(msgspec.Struct, frozen=True):
    """A destination, asked for `since`, that may be of an earlier ride
    (`bridges/kinds/lift/replayed.py`)."""

    destination: str
    since: float


class Session(msgspec.Struct, frozen=True):
    """Who holds the lift, what was requested, and how far the ride has come.

    `boarded`: OPEN at the destination has been published for this session, so a robot may be inside.
    `agv_seen`: AGV mode has come on for our request. `arrived`: the car has stood at the destination.
    `call_at`: when the present call began. `waiting`, `since`: what we wait for, and since when.
    `tries`: how often that has failed. `retry_at`: outputs stay off until then (inf: latched).
    `forgotten`: RMF's supervisor does not ask for it. `robot`: what its own adapter has said.
    `doubted`: a destination that does not count yet. `ends`: which stamps its END may have.
    """

    id: str
    agv: bool
    destination: str
    asked_at: float
    boarded: bool = False
    agv_seen: bool = False
    arrived: bool = False
    call_at: float | None = None
    waiting: Waiting | None = None
    since: float = 0.0
    tries: int = 0
    retry_at: float | None = None
    fault: Fault | None = None
    forgotten: Forgotten | None = None
    robot: OwnWords = OwnWords()
    doubted: Doubted | None = None
    ends: Requester = Requester()


class Grace(msgspec.Struct, frozen=True):
    """After END: this session, and only this one, is granted again until `until`. Its outputs go off at
    `off_at`. `in_car`: its robot may still be inside, and may resume by its own requests too."""

    session: Session
    until: float
    off_at: float = NEVER
    in_car: bool = False


class Channel(msgspec.Struct, Generic[T], frozen=True):
    """One output, or a group of which one at a time may be on.

    `on`: what is on now. `off_at`: when it last went off. `ons`: the latest times it was switched on.
    """

    on: T | None = None
    off_at: float = AGES_AGO
    ons: tuple[float, ...] = ()

    def step(
        self, wanted: T | None, now: float, ready_at: float, limits: LiftLimits
    ) -> "Channel[T]":
        """The next state. It goes off at once. It comes on, or changes, only after its rest and after
        `ready_at`."""
        if self.on is not None:
            return self if wanted == self.on else replace(self, on=None, off_at=now)
        if wanted is None or now < self.may_switch_on_at(now, ready_at, limits):
            return self
        return Channel(wanted, self.off_at, (*self.recent(now), now))

    def recent(self, now: float) -> tuple[float, ...]:
        """When it was switched on during the last minute."""
        return tuple(at for at in self.ons if now - at < 60.0)

    def may_switch_on_at(self, now: float, ready_at: float, limits: LiftLimits) -> float:
        """The earliest time at which it may be energised."""
        recent = self.recent(now)
        most = limits.t.max_cycles_per_min
        rested_at = recent[-most] + 60.0 if len(recent) >= most else AGES_AGO
        return max(self.off_at + limits.t.min_off_s, ready_at, rested_at)


class Relays(msgspec.Struct, frozen=True):
    """Every output with its history. A call and a door command are never on together."""

    agv: Channel[bool] = Channel()
    call: Channel[str] = Channel()
    hold: Channel[Side] = Channel()

    def outputs(self) -> LiftOutputs:
        """What the driver is to write."""
        return LiftOutputs(bool(self.agv.on), self.call.on, self.hold.on)

    def step(self, wanted: LiftOutputs, now: float, limits: LiftLimits) -> "Relays":
        """Move every output towards what is wanted, as far as is allowed now."""
        agv = self.agv.step(wanted.agv_request or None, now, AGES_AGO, limits)
        rested_at = self._rested_at(limits) if agv.on else NEVER
        call_ready_at = NEVER if self.hold.on else rested_at
        call = self.call.step(wanted.call, now, call_ready_at, limits)
        hold_ready_at = NEVER if self.call.on or call.on else rested_at
        hold = self.hold.step(wanted.hold_door, now, hold_ready_at, limits)
        return Relays(agv, call, hold)

    def changes_at(self, wanted: LiftOutputs, now: float, limits: LiftLimits) -> float:
        """When an output that is wanted and still off may come on; always later than `now`."""
        off = self._still_off(wanted, now, limits)
        due = [channel.may_switch_on_at(now, ready_at, limits) for _, channel, ready_at in off]
        return max(min(due, default=NEVER), math.nextafter(now, NEVER))

    def resting(self, wanted: LiftOutputs, now: float, limits: LiftLimits) -> tuple[str, bool]:
        """The first output that is wanted and must rest before it comes on, and whether
        `max_cycles_per_min` is why; "" for none."""
        for name, channel, ready_at in self._still_off(wanted, now, limits):
            unused = replace(channel, ons=())
            at = channel.may_switch_on_at(now, ready_at, limits)
            return name, at > unused.may_switch_on_at(now, ready_at, limits)
        return "", False

    def _still_off(
        self, wanted: LiftOutputs, now: float, limits: LiftLimits
    ) -> Iterator[tuple[str, Channel[Any], float]]:
        """Each output that is wanted and off, its name, and when the others let it come on."""
        agv_at = now if self.agv.on else self.agv.may_switch_on_at(now, AGES_AGO, limits)
        ready_at = max(agv_at, self._rested_at(limits))
        if wanted.agv_request and not self.agv.on:
            yield "AGV mode", self.agv, AGES_AGO
        if wanted.call and not self.call.on:
            yield "the call", self.call, ready_at
        if wanted.hold_door and not self.hold.on:
            yield "the door", self.hold, ready_at

    def _rested_at(self, limits: LiftLimits) -> float:
        """When call and door command will both have been off for `dead_time_s`."""
        return max(self.call.off_at, self.hold.off_at) + limits.t.dead_time_s


class Memory(msgspec.Struct, frozen=True):
    """Everything that outlives a scan.

    `io_fault`: why the last read or write failed; "" if both succeeded. `unwritten_since`: since when
    writes have failed in every scan. `write_failed`: the last scan's write failed. `own`: where each
    robot itself last asked the lift to go, by its session.
    """

    senses: Senses = Senses()
    session: Session | None = None
    grace: Grace | None = None
    relays: Relays = Relays()
    fire_latched: bool = False
    alarmed: bool = False
    rival_at: float | None = None
    io_fault: str = ""
    unwritten_since: float | None = None
    write_failed: bool = False
    own: Mapping[str, str] = {}
