"""Plays for a lift, a door and a charger: their conditions, their course, and the device's release."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import topics, words
from bridges.messages.stamps import duration, stamp
from bridges.messages.topics import AnyTopic
from bridges.observe.lift import HAZARDS
from workbench.judge.law import shown
from workbench.judge.played_nodes import PlayedNodes, Step, Traveller
from workbench.rmf_model import NEVER, Said, door_request
from workbench.rmf_model.phases import DoorClose, DoorOpen, EndLiftSession, RequestLift
from workbench.rmf_model.robot import RobotContext
from workbench.rmf_model.supervisors import DoorSupervisor, LiftSupervisor

FLEET: Final = "rmf_bridge_judge"
DRIVES_S: Final = 3.0
DOORWAY_S: Final = 15.0
"""Longer than the wait of any node that closes a door in silence."""
SERVED: Final = (d.ChargerStateValue.CHARGER_ASSIGNED, d.ChargerStateValue.CHARGER_CHARGING)
STRANGER: Final = f"{FLEET}/nobody"
STAYS_S: Final = 5.0
LEAVES_S: Final = 10.0
REPEAT_S: Final = 1.0
MOST_FLOORS: Final = 20
START_TIMEOUT_S: Final = 30.0


def busy(state: words.Stated) -> str:
    """Return why nothing may be played for this device now; "" if it is idle."""
    match state:
        case d.LiftState():
            idle = not state.session_id and state.current_mode not in HAZARDS
        case d.DoorState():
            idle = state.current_mode.value == d.DoorModeValue.MODE_CLOSED
        case d.ChargerState():
            idle = state.state == d.ChargerStateValue.CHARGER_IDLE
    return "" if idle else f"{shown(words.device(state))} is not idle: {words.described(state)}"


class Scenario(ABC):
    """A play, its topics, and its end. `speaks`: the topics that we publish; `sole`: those without
    any other publisher, because two supervisors would spoil the test. However the play ends,
    `leave` is then called every REPEAT_S until `left`."""

    speaks: tuple[AnyTopic, ...]
    hears: tuple[AnyTopic, ...]
    play: PlayedNodes
    failed = ""

    @property
    def over(self) -> bool:
        """Is the play finished, or unable to go on?"""
        return bool(self.failed) or self.play.over

    @property
    def why(self) -> str:
        """Why the play did not reach its end; "" if it did."""
        return self.failed or self.play.failed

    def unfit(self, state: words.Stated) -> str:
        """Return why it may not be played now; "" if allowed."""
        return busy(state)

    def begin(self, now: float) -> list[Said]:
        """Begin the play."""
        return self.play.begin(now)

    def hear(self, topic: str, message: d.Message, now: float) -> list[Said]:
        """Take a message of the graph."""
        return self.play.hear(topic, message, now)

    def tick(self, now: float) -> list[Said]:
        """Fire due timers."""
        return self.play.tick(now)

    def wake_at(self) -> float:
        """Time of the next timer."""
        return self.play.wake_at()

    @abstractmethod
    def leave(self, now: float) -> list[Said]:
        """Release the device."""

    @property
    @abstractmethod
    def left(self) -> bool:
        """Is the device released?"""


class RideScenario(Scenario):
    """Robots ride from one floor to another, every second one back.

    `through`: a supervisor is on the graph. `restarts`: the played supervisor restarts with a robot
    in the car. While the first robot is in the car, a robot without a session sends END, as rmf-web
    does.
    """

    def __init__(
        self,
        lift: str,
        floors: tuple[str, str],
        robots: int,
        patience_s: float,
        *,
        through: bool = False,
        restarts: bool = False,
    ) -> None:
        self.lift = lift
        self._floors = floors
        self._restarts = restarts
        self._through = through
        self._state: d.LiftState | None = None
        self._leaving = 0
        self._restart_due = self._stranger_due = False
        self.speaks = (topics.ADAPTER_LIFT_REQUESTS,)
        if not through:
            self.speaks = (*self.speaks, topics.LIFT_REQUESTS)
        self.hears = (topics.LIFT_STATES,)
        travellers = [
            Traveller(f"{FLEET}/robot{n + 1}", lambda robot, n=n: self._ride(robot, floors, n))  # type: ignore[misc]
            for n in range(robots)
        ]
        supervisor = None if through else LiftSupervisor
        self.play = PlayedNodes(lift, travellers, supervisor, patience_s * robots)

    def _ride(self, robot: RobotContext, floors: tuple[str, str], number: int) -> Iterator[Step]:
        start, goal = floors if number % 2 == 0 else floors[::-1]
        yield RequestLift(self.lift, start, inside=False)
        yield DRIVES_S
        robot.in_car = True
        self._restart_due, self._stranger_due = self._restarts, not self._through
        yield RequestLift(self.lift, goal, inside=True)
        yield DRIVES_S
        robot.in_car = False
        yield EndLiftSession(self.lift)

    def unfit(self, state: words.Stated) -> str:
        """Require an idle lift that serves both floors."""
        served = state.available_floors if isinstance(state, d.LiftState) else ()
        missing = [shown(floor) for floor in self._floors if served and floor not in served]
        if not missing:
            return busy(state)
        return f"{', '.join(missing)}: it serves {', '.join(map(shown, served[:MOST_FLOORS]))}"

    def hear(self, topic: str, message: d.Message, now: float) -> list[Said]:
        """Take states, until another session has the lift."""
        if isinstance(message, d.LiftState) and message.lift_name == self.lift:
            self._state = message
            if message.session_id and message.session_id not in self.play.names:
                self.failed = f"{shown(message.session_id)} has the lift now"
                return []
        said = self.play.hear(topic, message, now)
        return said + self._disturb(now)

    def _disturb(self, now: float) -> list[Said]:
        """Disturb a ride: what may happen with a robot in the car, between two states."""
        said: list[Said] = []
        if self._stranger_due:
            self._stranger_due = False
            said.append((topics.LIFT_REQUESTS, self._end(STRANGER, "", now)))
        if self._restart_due:
            self._restart_due = False
            said += self.play.restart_supervisor(now)
        return said

    def leave(self, now: float) -> list[Said]:
        """Send END for each of us, as fleet adapters do; with a floor if that has no effect."""
        self._leaving += 1
        floor = self._state.current_floor if self._state and self._leaving > 3 else ""
        ends = [self._end(name, floor, now) for name in sorted(self.play.names)]
        return [(topic, end) for end in ends for topic in self.speaks]

    def _end(self, session: str, floor: str, now: float) -> d.LiftRequest:
        return d.LiftRequest(
            lift_name=self.lift,
            request_time=stamp(now),
            session_id=session,
            request_type=d.LiftRequestType.REQUEST_END_SESSION,
            destination_floor=floor,
        )

    @property
    def left(self) -> bool:
        """Was END sent, and does the lift show none of our sessions?"""
        free = self._state is None or self._state.session_id not in self.play.names
        return self._leaving > 0 and free


class PassageScenario(Scenario):
    """A robot goes through a door, so many times."""

    def __init__(
        self,
        door: str,
        times: int,
        patience_s: float,
        *,
        through: bool = False,
        restarts: bool = False,
    ) -> None:
        self.door = door
        self._restarts = restarts
        self._restart_due = False
        self._leaving = 0
        self._mode = -1
        self.speaks = (topics.ADAPTER_DOOR_REQUESTS,)
        if not through:
            self.speaks = (*self.speaks, topics.DOOR_REQUESTS, topics.DOOR_SUPERVISOR_HEARTBEAT)
        self.hears = (topics.DOOR_STATES, topics.DOOR_SUPERVISOR_HEARTBEAT)
        script = lambda robot: self._pass(times)  # noqa: E731
        travellers = [Traveller(f"{FLEET}/robot1", script)]
        self.play = PlayedNodes(door, travellers, None if through else DoorSupervisor, patience_s)

    def _pass(self, times: int) -> Iterator[Step]:
        for _ in range(times):
            self._restart_due = self._restarts
            yield DoorOpen(self.door)
            yield DOORWAY_S
            yield DoorClose(self.door)
            yield from self._until_closed()

    def _until_closed(self) -> Iterator[Step]:
        """Wait until closed, so the next passage begins at a closed door; RMF would not wait."""
        for _ in range(30):
            if self._mode == d.DoorModeValue.MODE_CLOSED:
                return
            yield 1.0

    def hear(self, topic: str, message: d.Message, now: float) -> list[Said]:
        """Take states and heartbeats. A restart comes with the first state after the OPEN."""
        if isinstance(message, d.DoorState) and message.door_name == self.door:
            self._mode = message.current_mode.value
        said = self.play.hear(topic, message, now)
        if self._restart_due and isinstance(message, d.DoorState):
            self._restart_due = False
            said += self.play.restart_supervisor(now)
        return said

    def leave(self, now: float) -> list[Said]:
        """Send CLOSE, to the supervisor or in its name."""
        self._leaving += 1
        [name] = self.play.names
        closed = d.DoorModeValue.MODE_CLOSED
        said: list[Said] = [
            (topics.ADAPTER_DOOR_REQUESTS, door_request(self.door, name, closed, now))
        ]
        if topics.DOOR_REQUESTS in self.speaks:
            request = door_request(self.door, DoorSupervisor.REQUESTER_ID, closed, now)
            said.append((topics.DOOR_REQUESTS, request))
        return said

    @property
    def left(self) -> bool:
        """Was CLOSE sent, and is the door no longer OPEN?"""
        return self._leaving > 0 and self._mode != d.DoorModeValue.MODE_OPEN


@dataclass
class _Asked:
    """The progress of a charger's request: the time of each step (s)."""

    asked_at: float = NEVER
    assigned_at: float = NEVER
    cancelled_at: float = NEVER
    states: set[int] = field(default_factory=set)


class ChargeScenario(Scenario):
    """Request a station, cancel another's request, then cancel ours.

    `robot`: FLEET/ROBOT. No robot need come.
    """

    def __init__(self, charger: str, robot: str, request_id: str, patience_s: float) -> None:
        self.charger = charger
        self._fleet, _, self._robot = robot.partition("/")
        self._id = request_id
        self._patience_s = patience_s
        self._at = _Asked()
        self._state: d.ChargerState | None = None
        self.speaks = (topics.CHARGER_REQUESTS, topics.CHARGER_CANCELS)
        self.hears = (topics.CHARGER_STATES, topics.CHARGER_REFUSALS)
        self.play = PlayedNodes(charger, [], None, patience_s)

    @property
    def over(self) -> bool:
        """Is our request cancelled, or was it never granted?"""
        return bool(self.failed) or self._at.cancelled_at < NEVER

    def begin(self, now: float) -> list[Said]:
        """Ask."""
        self._at.asked_at = now
        timeout = duration(START_TIMEOUT_S)
        request = d.ChargerRequest(self.charger, self._fleet, self._robot, timeout, self._id)
        return [(topics.CHARGER_REQUESTS, request)]

    def hear(self, topic: str, message: d.Message, now: float) -> list[Said]:
        """Take its states, and a refusal."""
        if isinstance(message, d.DiagnosticStatus) and message.hardware_id == self.charger:
            if any((v.key, v.value) == ("request_id", self._id) for v in message.values):
                self.failed = f"refused: {shown(message.message)}"
            return []
        if not isinstance(message, d.ChargerState) or message.charger_name != self.charger:
            return []
        self._state = message
        if (
            message.state in SERVED
            and message.request_id == self._id
            and self._at.assigned_at == NEVER
        ):
            self._at.assigned_at = now
            return [(topics.CHARGER_CANCELS, d.ChargerCancel(self.charger, f"{self._id}-other"))]
        return []

    def tick(self, now: float) -> list[Said]:
        """Cancel, or give up."""
        if now - self._at.assigned_at >= STAYS_S:
            self._at.cancelled_at = now
            return self.leave(now)
        if self._at.assigned_at == NEVER and now - self._at.asked_at >= self._patience_s:
            self.failed = f"not assigned in {self._patience_s:.0f} s"
        return []

    def wake_at(self) -> float:
        """Time of the cancel, or of giving up."""
        if self._at.assigned_at < NEVER:
            return self._at.assigned_at + STAYS_S
        return self._at.asked_at + self._patience_s

    def leave(self, now: float) -> list[Said]:
        """Cancel."""
        self._at.cancelled_at = min(self._at.cancelled_at, now)
        return [(topics.CHARGER_CANCELS, d.ChargerCancel(self.charger, self._id))]

    @property
    def left(self) -> bool:
        """Has the charger stopped serving our request?"""
        state = self._state
        shows = state is not None and state.state in SERVED and state.request_id == self._id
        return self._at.cancelled_at < NEVER and not shows
