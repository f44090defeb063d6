"""A lift in virtual time: the real node and core, and a building that tests control.

The node scans every `scan_s`, at every `wake_at`, and whenever a request comes, as in the daemon's
loop. Histories are lists of (s, event), so a test can compare a whole history with ==.
"""

import math
from collections.abc import Callable
from typing import Any

from msgspec.structs import replace

from bridges.kinds.lift import KIND
from bridges.kinds.lift.memory import LiftLimits
from bridges.kinds.lift.settings import Floor, LiftDurations, LiftSettings
from bridges.kinds.lift.signals import DoorReading, Hazard, LiftOutputs, LiftSample, Motion
from bridges.kinds.shared import alarming, fleet_alarm
from bridges.kinds.shared.decision import OperatorReset, RivalSeen
from bridges.kinds.shared.fleet_alarm_memory import DeviceTells
from bridges.kinds.shared.graph_kind import MaySpeak
from bridges.kinds.shared.kind import AnyDeviceKind
from bridges.messages.definitions import (
    LiftDoor,
    LiftMode,
    LiftMotion,
    LiftRequest,
    LiftRequestType,
    LiftState,
    Message,
)
from bridges.messages.topics import LIFT_REQUESTS, LIFT_STATES, Topic
from bridges.runtime.clock import Clock
from bridges.runtime.device import Node
from bridges.runtime.device_memory import DeviceMemories
from drivers import DriverError
from tests.accepted import accepted
from tests.runtime.virtual_graph import Disk

SCAN_S = 0.05
LEAST_GAP_S = 0.001
WALL = 1_000_000.0
"""The wall clock at the beginning of the story (s since the epoch)."""

DEBOUNCE: dict[str, float] = {"floor": 0.08, "door": 0.03, "rear_door": 0.03}
DEBOUNCE |= dict.fromkeys(("motion", "agv_mode", *Hazard), 0.05)
FLOORS = ["L1", "L2", "L3", "L4"]
AGV, HUMAN, END = (
    LiftRequestType.REQUEST_AGV_MODE,
    LiftRequestType.REQUEST_HUMAN_MODE,
    LiftRequestType.REQUEST_END_SESSION,
)

OUTPUTS = ("agv_request", "call", "hold_door")

STANDING = LiftSample("L1", DoorReading.CLOSED, motion=Motion.STOPPED, agv=False)
"""The reading of a car that stands at L1 with its door closed and without a session."""


class Building:
    """A lift that does nothing by itself, in the place of a driver (`drivers.Driver[LiftSample,
    LiftOutputs]`). The test sets its inputs.

    `edges` has (s, output, value). `unreadable` is the reason why reading fails, or "" if reading
    succeeds. `unwritable` is the same for writing.
    """

    def __init__(self, sample: LiftSample = STANDING) -> None:
        self.now = 0.0
        self.sample = sample
        self.driven = LiftOutputs()
        self.edges: list[tuple[float, str, Any]] = []
        self.unreadable = ""
        self.unwritable = ""
        self.writes = 0
        self.opened = 0

    def set(self, **inputs: Any) -> None:
        """Change some inputs."""
        self.sample = replace(self.sample, **inputs)

    def hazard(self, *hazards: Hazard) -> None:
        """Set the present hazards."""
        self.set(hazards=frozenset(hazards))

    def advance(self, now: float) -> None:
        """Let time pass."""
        self.now = now

    def open(self) -> None:
        self.opened += 1
        self.write(LiftOutputs())

    def read(self) -> LiftSample:
        if self.unreadable:
            raise DriverError(self.unreadable)
        return self.sample

    def write(self, outputs: LiftOutputs) -> None:
        self.writes += 1
        if self.unwritable:
            raise DriverError(self.unwritable)
        at, changed = (
            round(self.now, 2),
            [n for n in OUTPUTS if _of(outputs, n) != _of(self.driven, n)],
        )
        self.edges += [(at, n, _of(outputs, n)) for n in reversed(changed) if not _of(outputs, n)]
        self.edges += [(at, n, _of(outputs, n)) for n in changed if _of(outputs, n)]
        self.driven = outputs

    def make_safe(self) -> None:
        self.write(LiftOutputs())

    def close(self) -> None:
        self.make_safe()


def _of(outputs: LiftOutputs, name: str) -> Any:
    value = getattr(outputs, name)
    return getattr(value, "value", value)


class Controller(Building):
    """A lift that works. It grants AGV mode, goes to called floors, and opens its door when the door is
    held.

    A ride of one floor takes `FLOOR_S`. In the middle of the ride the lift shows no floor. The door
    opens or closes in `DOOR_S`.
    """

    AGV_S, FLOOR_S, DOOR_S = 0.5, 2.0, 1.0

    def __init__(self, floors: list[str] | None = None) -> None:
        self.floors = floors or FLOORS
        self.height = 0.0
        self.openness = 0.0
        self.goal: int | None = None
        self.asked_at = math.inf
        super().__init__(replace(STANDING, level=self.floors[0]))

    def advance(self, now: float) -> None:
        passed_s, self.now = now - self.now, now
        agv = self.driven.agv_request and not self.sample.hazards and now >= self.asked_at
        if agv and self.driven.call:
            self.goal = self.floors.index(self.driven.call)
        self._move_door(passed_s, agv)
        self._move_car(passed_s)
        self.set(agv=agv, level=self._level(), door=self._door(), motion=self._motion())

    def write(self, outputs: LiftOutputs) -> None:
        if outputs.agv_request and not self.driven.agv_request and not self.unwritable:
            self.asked_at = self.now + self.AGV_S
        super().write(outputs)

    @property
    def standing(self) -> bool:
        return self.goal is None

    def _move_door(self, passed_s: float, agv: bool) -> None:
        opens = agv and self.driven.hold_door is not None and self.standing
        step = passed_s / self.DOOR_S
        self.openness = min(1.0, self.openness + step) if opens else max(0.0, self.openness - step)

    def _move_car(self, passed_s: float) -> None:
        if self.goal is None or self.openness:
            return
        left, step = self.goal - self.height, passed_s / self.FLOOR_S
        if abs(left) <= step:
            self.height, self.goal = float(self.goal), None
        else:
            self.height += math.copysign(step, left)

    def _level(self) -> str | None:
        nearest = round(self.height)
        return self.floors[nearest] if abs(self.height - nearest) < 0.25 else None

    def _door(self) -> DoorReading:
        return {0.0: DoorReading.CLOSED, 1.0: DoorReading.OPEN}.get(
            self.openness, DoorReading.BETWEEN
        )

    def _motion(self) -> Motion:
        if self.goal is None or self.openness:
            return Motion.STOPPED
        return Motion.UP if self.goal > self.height else Motion.DOWN


def words(state: LiftState) -> str:
    """Return a state in words."""
    door = LiftDoor(state.door_state).name.removeprefix("DOOR_").lower()
    mode = LiftMode(state.current_mode).name.removeprefix("MODE_")
    session = f", {state.session_id} to {state.destination_floor}" if state.session_id else ""
    return f"{mode}, {door} at {state.current_floor or '?'}{session}"


class Story:
    """A lift with its node, in service.

    `told` has (s, LiftState) of every published state. For each state the story calls `hear`. Messages
    that `hear` puts into `incoming` reach the node right after the scan.
    """

    def __init__(
        self,
        building: Building | None = None,
        *,
        floors: list[str] | dict[str, Floor] | None = None,
        scan_s: float = SCAN_S,
        debounce: dict[str, float] | None = None,
        fire_reset: Any = "auto",
        alarm: Any = "none",
        alarm_on: Any = ("fire_alarm",),
        agv_mode: Any = "requested",
        kind: AnyDeviceKind = KIND,
        **limits: Any,
    ) -> None:
        self.building = building or Building()
        self.settings = LiftSettings(
            floors=floors or FLOORS,
            limits=LiftDurations(**limits),
            fire_reset=fire_reset,
            alarm=alarm,
            alarm_on=list(alarm_on),
            agv_mode=agv_mode,
        )
        self.limits = LiftLimits.of(self.settings, DEBOUNCE if debounce is None else debounce)
        self.now = 0.0
        self.wall_step_s = 0.0
        self.deaf = False  # if True, sending fails
        self.told: list[tuple[float, LiftState]] = []
        self.alarms: list[tuple[float, Message]] = []
        self.hear: Callable[[LiftState], None] = lambda state: None
        self.incoming: list[tuple[Topic[Any], LiftRequest]] = []
        self.disk = Disk()
        self._kind = kind
        self._scan_s = scan_s
        self._scans = 0
        self.restart()

    # ---- events

    def restart(self) -> None:
        """Start a new daemon on the same lift. It remembers only what is on its disk."""
        clock = Clock(lambda: self.now, lambda: WALL + self.now + self.wall_step_s)
        self.node = Node(
            "Lift1",
            self._kind,
            self.settings,
            self.limits,
            self.building,
            self._publish,
            clock,
            tell_alarm=lambda name, inputs: self._alarm_hears(DeviceTells(name, inputs)),
            memories=DeviceMemories(self.disk),
        )
        self._alarm = fleet_alarm.initial()
        self._alarm_hears(MaySpeak(True))
        self._scan()

    def run(self, until: float) -> None:
        """Scan from now until the time `until`."""
        while self.now < until:
            due = min(self._scans * self._scan_s, max(self.node.wake_at, self.now + LEAST_GAP_S))
            while due == self._scans * self._scan_s:
                self._scans += 1
            if due > self.now:
                self.now = min(due, until)
                self._scan()

    def until(self, what: Callable[[], object], within: float = 60.0) -> float:
        """Scan until the condition holds, and return that time (s)."""
        end = self.now + within
        while not what():
            assert self.now < end, f"not within {within} s: {self.state}"
            self.run(self.now + self._scan_s)
        return round(self.now, 2)

    def asks(self, session: str, floor: str, mode: LiftRequestType = AGV) -> None:
        """Let a request for this floor arrive, with the fields that fleet adapters and rmf-web fill
        in."""
        self.request(LiftRequest("Lift1", session_id=session, request_type=int(mode),
                                 destination_floor=floor, door_state=2))  # fmt: skip

    def ends(self, session: str) -> None:
        """Let END_SESSION arrive without a floor and with door_state 0, as fleet adapters send it."""
        self.request(LiftRequest("Lift1", session_id=session, request_type=int(END)))

    def request(self, *requests: LiftRequest) -> None:
        """Let these requests of the supervisor arrive in one scan."""
        self.receive(*((LIFT_REQUESTS, request) for request in requests))

    def receive(self, *said: tuple[Topic[Any], LiftRequest]) -> None:
        """Let these messages arrive in one scan. Each message arrives on its topic."""
        self._scan(*accepted(self.node, self._kind, self.settings, *said))

    def rival(self) -> None:
        """Let another node publish a state of this lift."""
        self._scan(RivalSeen())

    def resets(self) -> None:
        """Reset, as an operator does with `rmf-bridge reset`."""
        self._scan(OperatorReset())
        self._alarm_hears(OperatorReset())

    # ---- results

    @property
    def edges(self) -> list[tuple[float, str, Any]]:
        """Return each change of an output."""
        return self.building.edges

    @property
    def outputs(self) -> LiftOutputs:
        """Return the driven outputs."""
        return self.building.driven

    @property
    def state(self) -> str:
        """Return the last state for RMF, in words."""
        return words(self.told[-1][1])

    @property
    def states(self) -> list[tuple[float, str]]:
        """Return the states for RMF, in words and without repeats."""
        changes: list[tuple[float, str]] = []
        for at, state in self.told:
            if not changes or words(state) != changes[-1][1]:
                changes.append((round(at, 2), words(state)))
        return changes

    @property
    def motions(self) -> list[LiftMotion]:
        """Return the motions in the states for RMF, without repeats."""
        told = [LiftMotion(state.motion_state) for _, state in self.told]
        return [m for m, before in zip(told, [None, *told], strict=False) if m != before]

    @property
    def faults(self) -> list[str]:
        """Return the faults in the status file."""
        return [fault["code"] for fault in self.node.status()["faults"]]

    # ---- inside

    def _scan(self, *events: Any) -> None:
        self.building.advance(self.now)
        self.node.scan(events)
        if self.incoming:
            arrived, self.incoming = self.incoming, []
            self.receive(*arrived)

    def _alarm_hears(self, event: Any) -> None:
        """Give this event to the daemon's core for the fleets' alarm, and note what it publishes."""
        limits = alarming.alarm_limits({"Lift1": self.settings})
        if limits is not None:
            made = fleet_alarm.decide(self._alarm, event, self.now, limits)
            self._alarm = made.memory
            self.alarms += [(round(self.now, 2), message) for _, message in made.publish]

    def _publish(self, topic: Topic[Any], message: Any) -> bool:
        if self.deaf:
            return False
        assert topic == LIFT_STATES
        self.told.append((self.now, message))
        self.hear(message)
        return True


OPEN_AT_L1 = LiftSample("L1", DoorReading.OPEN, motion=Motion.STOPPED, agv=True)


def boarding(**inputs: object) -> Story:
    """Return a story in which A has requested L1, where the car stands with an open door. `inputs`
    changes the lift's inputs."""
    story = Story(Building(replace(OPEN_AT_L1, **inputs)))
    story.run(1.0)
    story.asks("A", "L1")
    story.run(2.0)
    return story
