"""The values that the lift core keeps from one scan to the next, and the settings that it needs (its
limits)."""

from collections.abc import Collection, Mapping
from functools import cached_property
from typing import Literal

import msgspec

from bridges.kinds.lift.relays import Relays
from bridges.kinds.lift.settings import LiftDurations, LiftSettings
from bridges.kinds.lift.signals import DoorReading, Hazard, Motion, Side, Stop
from bridges.kinds.shared.debounce import Settled
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import AGES_AGO, NEVER
from bridges.kinds.shared.freshness import Requester

Waiting = Literal["agv", "floor", "door"]


class LiftLimits(msgspec.Struct, frozen=True, dict=True):
    """The settings of a lift that its core needs.

    `stops` maps RMF's name of each floor to its landing and door. The lowest floor is first. `t`: the
    durations. `debounce` maps a signal to its debounce (s). `alarm_on`: the hazards that raise the
    fleets' alarm. `by_call`: AGV mode, in which the controller obeys us, is switched on by a call.
    """

    stops: Mapping[str, Stop]
    t: LiftDurations = LiftDurations()
    debounce: Mapping[str, float] = {}
    fire_reset: Literal["auto", "manual"] = "auto"
    alarm_on: frozenset[Hazard] = frozenset({Hazard.FIRE})
    by_call: bool = False

    @classmethod
    def of(cls, settings: LiftSettings, debounce: Mapping[str, float]) -> "LiftLimits":
        """Make the limits from the YAML and from `debounce`, which maps each wired signal to its
        debounce (s)."""
        return cls(
            settings.stops(),
            settings.limits,
            debounce,
            settings.fire_reset,
            frozenset(map(Hazard, settings.alarm_on)),
            by_call=settings.agv_mode == "by_call",
        )

    def debounce_s(self, signal: str) -> float:
        """Return the time (s) for which a change of this signal must last."""
        return self.debounce.get(signal, 0.0)

    @cached_property
    def levels(self) -> Mapping[str, int]:
        """The number of each landing from the bottom of the shaft, 0 for the lowest."""
        landings = dict.fromkeys(stop.level for stop in self.stops.values())
        return {level: place for place, level in enumerate(landings)}

    def floors_between(self, level: str, other: str) -> int:
        """Count the landings between these two landings."""
        return abs(self.levels[level] - self.levels[other]) - 1

    def floor_name(self, level: str, preferred: str, opened: Collection[Side] = ()) -> str:
        """Return RMF's name for a landing. A landing may have several names. Return `preferred` if it
        is one of them, else the first of them whose door is one of the `opened` sides, else the first
        of them."""
        names = [name for name, stop in self.stops.items() if stop.level == level]
        if preferred in names:
            return preferred
        return next((name for name in names if self.stops[name].side in opened), names[0])

    def side(self, floor: str) -> Side:
        """Return the side of the door that serves this floor."""
        return self.stops[floor].side


class CarPosition(msgspec.Struct, frozen=True):
    """The car's position, as far as the core believes the floor code.

    `trusted`: the last landing that was believed. `seen_at`: the time of the last reading of that
    landing. `suspect`: a landing that the floor code shows, but that the car cannot have reached.
    `moved_at`: the time of the last reading in which the car did not stand.
    """

    trusted: str | None = None
    seen_at: float = 0.0
    suspect: str | None = None
    moved_at: float | None = None


class LiftSenses(msgspec.Struct, frozen=True):
    """Every input, debounced, and the time of the last reading."""

    read_at: float | None = None
    code: Settled[tuple[str | None, str]] | None = None
    doors: tuple[Settled[DoorReading | None] | None, Settled[DoorReading | None] | None] = (
        None,
        None,
    )
    motion: Settled[Motion | None] | None = None
    agv: Settled[bool | None] | None = None
    hazards: dict[Hazard, Settled[bool]] = {}
    position: CarPosition = CarPosition()


class ForgottenSession(msgspec.Struct, frozen=True):
    """The mark that RMF's supervisor has forgotten or ended a session
    (`bridges/kinds/lift/forgotten.py`).

    `by`: the other session for which the supervisor asks; "" if there is none. `since`: the time of the
    mark. `ended`: the robot's own END was heard once. `disowned`: the supervisor has ended this
    session, but its robot goes on asking.
    """

    by: str
    since: float
    ended: bool = False
    disowned: bool = False


class OwnWords(msgspec.Struct, frozen=True):
    """The messages of a robot's own fleet adapter.

    `stamp`: the newest stamp (ns), by the adapter's clock. `asked_at`: the time of the last request for
    the lift. `ended_at`: the time of the first END after that request. `floor`: the destination of that
    request. `opened`: since that request, OPEN has been published at `floor`. `told`: the adapter has
    sent a request after that OPEN, so it knows of the open door. `clock`: the stamps (s) that show
    whether a stamp older than `stamp` comes from a clock that was set back.
    """

    stamp: int = 0
    asked_at: float = AGES_AGO
    ended_at: float = AGES_AGO
    floor: str = ""
    opened: bool = False
    told: bool = False
    clock: Requester = Requester()


class Doubted(msgspec.Struct, frozen=True):
    """A requested destination that does not count yet, because it may belong to an earlier ride
    (`bridges/kinds/lift/replayed.py`). `since`: the time of its first request."""

    destination: str
    since: float


class LiftSession(msgspec.Struct, frozen=True):
    """The session that has the lift: its request, and the progress of its ride.

    `boarded`: OPEN at the destination has been published for this session, so a robot may be inside.
    `agv_seen`: AGV mode has come on at our request. `arrived`: the car has stood at the destination.
    `call_at`: the start of the present call, which is the first reading after the call was written.
    `waiting`: the step for which the ride waits. `since`: the start of that wait. `tries`: how often
    that step has failed. `retry_at`: the outputs stay off until this time; inf means that the fault has
    latched. `forgotten`: the mark of a session that RMF's supervisor has forgotten or ended. `robot`:
    the messages of the robot's own adapter. `doubted`: a destination that does not count yet. `ends`:
    the stamps that show whether an END is older than the session.
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
    forgotten: ForgottenSession | None = None
    robot: OwnWords = OwnWords()
    doubted: Doubted | None = None
    ends: Requester = Requester()


class Grace(msgspec.Struct, frozen=True):
    """The time after END in which only the ended session can be granted again.

    `until`: the end of the grace. `off_at`: the time when the session's outputs go off. `in_car`: the
    robot may still be inside, and its own requests restore the session too.
    """

    session: LiftSession
    until: float
    off_at: float = NEVER
    in_car: bool = False


class LiftMemory(msgspec.Struct, frozen=True):
    """The memory of one lift from scan to scan.

    `rival_at`: the time when another node for this lift was last heard. `io_fault`: the error of the
    last read or write; "" if both succeeded. `unwritten_since`: no write has succeeded since this time.
    `write_failed`: the last scan's write failed. `not_kept`: the reason why `fire_latched` is not on
    disk; "" if it is. `own` maps a session to the destination that the session's robot itself last
    requested.
    """

    senses: LiftSenses = LiftSenses()
    session: LiftSession | None = None
    grace: Grace | None = None
    relays: Relays = Relays()
    fire_latched: bool = False
    rival_at: float | None = None
    io_fault: str = ""
    unwritten_since: float | None = None
    write_failed: bool = False
    not_kept: str = ""
    own: Mapping[str, str] = {}
