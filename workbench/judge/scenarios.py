"""Plays (series of test messages) for a lift and for a door. Each play checks that it may begin, sends
its messages, and releases the device."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import topics, words
from bridges.messages.stamps import stamp
from bridges.messages.topics import AnyTopic
from bridges.observe.lift import HAZARDS
from workbench.judge.law import shown
from workbench.judge.played_nodes import PlayedNodes, Step, Traveller
from workbench.rmf_model import Said, door_request
from workbench.rmf_model.phases import DoorClose, DoorOpen, EndLiftSession, RequestLift
from workbench.rmf_model.robot import RobotContext
from workbench.rmf_model.supervisors import DoorSupervisor, LiftSupervisor

FLEET: Final = "rmf_bridge_judge"
DRIVES_S: Final = 6.0
DOORWAY_S: Final = 12.0
"""Time (s) for which the robot stands in the doorway. A faulty node that closes a door because of
silence does so within this time."""
SHOWS_S: Final = 4.0
"""Time (s) to wait after a message that must have no effect. A faulty node would show an effect within
this time."""
STRANGER: Final = f"{FLEET}/nobody"
BYPASSER: Final = f"{FLEET}/robot_without_supervisor"
NOWHERE: Final = f"{FLEET} nowhere"
"""A name that no device and no floor has."""
AGV: Final = d.LiftRequestType.REQUEST_AGV_MODE
END: Final = d.LiftRequestType.REQUEST_END_SESSION
LEAVES_S: Final = 10.0
REPEAT_S: Final = 1.0
MOST_FLOORS: Final = 20


def busy(state: words.Stated) -> str:
    """Return the reason why a play must not use the device now. Return "" if the device is idle."""
    match state:
        case d.LiftState():
            idle = not state.session_id and state.current_mode not in HAZARDS
        case d.DoorState():
            idle = state.current_mode.value == d.DoorModeValue.MODE_CLOSED
        case d.ChargerState():
            idle = state.state == d.ChargerStateValue.CHARGER_IDLE
        case d.DispenserState() | d.IngestorState():
            idle = state.mode == d.WorkcellMode.IDLE and not state.request_guid_queue
    return "" if idle else f"{shown(words.device(state))} is not idle: {words.described(state)}"


class Scenario(ABC):
    """A play for one device.

    - `speaks`: the topics on which we publish.
    - `sole`: topics that must have no other publisher, because two supervisors would spoil the test.

    When a play has ended, for whatever reason, the caller calls `leave` every REPEAT_S (s). The caller
    stops when `left` is true.
    """

    speaks: tuple[AnyTopic, ...]
    hears: tuple[AnyTopic, ...]
    play: PlayedNodes
    failed = ""
    _disturbs: Callable[[float], list[Said]] | None = None

    @property
    def over(self) -> bool:
        """Return whether the play is finished, or cannot go on."""
        return bool(self.failed) or self.play.over

    @property
    def why(self) -> str:
        """The reason why the play was not completed; "" if it was completed."""
        return self.failed or self.play.failed

    def unfit(self, state: words.Stated) -> str:
        """Return the reason why the play may not begin now. Return "" if the play may begin."""
        return busy(state)

    def begin(self, now: float) -> list[Said]:
        """Begin the play."""
        return self.play.begin(now)

    def hear(self, topic: str, message: d.Message, now: float) -> list[Said]:
        """Take a message of the graph."""
        return self.play.hear(topic, message, now)

    def _disturb(self, now: float) -> list[Said]:
        """Send the disturbing message that is due after the present state, if there is one."""
        disturbs, self._disturbs = self._disturbs, None
        return disturbs(now) if disturbs else []

    def tick(self, now: float) -> list[Said]:
        """Fire the timers whose time has come."""
        return self.play.tick(now)

    def wake_at(self) -> float:
        """Time (s) of the next timer."""
        return self.play.wake_at()

    @abstractmethod
    def leave(self, now: float) -> list[Said]:
        """Release the device."""

    @property
    @abstractmethod
    def left(self) -> bool:
        """Return whether the device is released."""


class RideScenario(Scenario):
    """A play in which robots ride from one floor to another. Every second robot rides in the other
    direction.

    `through` tells whether a supervisor is on the graph. `restarts` tells whether the played supervisor
    restarts while a robot is in the car.

    Without `through`, the play also sends messages that tempt a faulty node to break a law about
    sessions.

    - Before the ride: a request for another lift, and a request that no supervisor forwards.
    - During the first robot's session: an END of another session in rmf-web's form, a request of that
      session, and a request for an unknown floor.
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
        if not self._through:
            yield from self._ask_aside(start, first=number == 0)
        disturbed = number == 0 and not self._through
        yield RequestLift(self.lift, start, inside=False)
        yield DRIVES_S / 2
        if disturbed:
            self._disturbs = lambda now: [self._send(STRANGER, "", now, END)]
        yield DRIVES_S / 2
        robot.in_car = True
        self._disturbs = self.play.restart_supervisor if self._restarts else None
        yield RequestLift(self.lift, goal, inside=True)
        yield DRIVES_S
        if disturbed:
            self._disturbs = lambda now: [self._send(STRANGER, start, now)]
            yield SHOWS_S
            self._disturbs = lambda now: [self._send(robot.requester_id, NOWHERE, now)]
            yield SHOWS_S
        robot.in_car = False
        yield EndLiftSession(self.lift)

    def _ask_aside(self, floor: str, first: bool) -> Iterator[Step]:
        """With `first`, request another lift. Then request this lift on the fleet adapters' topic, so
        that no supervisor has forwarded the request. Meanwhile, the other robots wait."""
        if first:
            self._disturbs = lambda now: [self._send(STRANGER, floor, now, lift=NOWHERE)]
        yield SHOWS_S
        if first:
            around = topics.ADAPTER_LIFT_REQUESTS
            self._disturbs = lambda now: [(around, self._send(BYPASSER, floor, now)[1])]
        yield SHOWS_S

    def unfit(self, state: words.Stated) -> str:
        """Return the reason why the play may not use this lift. The lift must be idle, and must serve
        both floors."""
        served = state.available_floors if isinstance(state, d.LiftState) else ()
        missing = [shown(floor) for floor in self._floors if served and floor not in served]
        if not missing:
            return busy(state)
        return (
            f"the lift does not serve {', '.join(missing)}: it serves"
            f" {', '.join(map(shown, served[:MOST_FLOORS]))}"
        )

    def hear(self, topic: str, message: d.Message, now: float) -> list[Said]:
        """Take a message of the graph. The play fails if a session that is not ours has the lift."""
        stated = isinstance(message, d.LiftState) and message.lift_name == self.lift
        if isinstance(message, d.LiftState) and stated:
            self._state = message
            if message.session_id and message.session_id not in self.play.names:
                self.failed = f"{shown(message.session_id)} has the lift now"
                return []
        said = self.play.hear(topic, message, now)
        return said + (self._disturb(now) if stated else [])

    @property
    def _names(self) -> set[str]:
        return {*self.play.names, STRANGER, BYPASSER}

    def leave(self, now: float) -> list[Said]:
        """Send END for each of our sessions, as fleet adapters do. If this END has no effect, send END
        with a floor."""
        self._leaving += 1
        floor = self._state.current_floor if self._state and self._leaving > 3 else ""
        shown_now = {self._state.session_id} & self._names if self._state else set()
        names = sorted(self.play.names | shown_now)
        ends = [self._send(name, floor, now, END)[1] for name in names]
        return [(topic, end) for end in ends for topic in self.speaks]

    def _send(
        self, session: str, floor: str, now: float, kind: int = AGV, lift: str = ""
    ) -> tuple[AnyTopic, d.LiftRequest]:
        """Make a request in the supervisor's name."""
        door = d.LiftRequestDoor.DOOR_OPEN if kind == AGV else d.LiftRequestDoor.DOOR_CLOSED
        request = d.LiftRequest(lift or self.lift, stamp(now), session, kind, floor, door)
        return topics.LIFT_REQUESTS, request

    @property
    def left(self) -> bool:
        """Return whether END was sent, and the lift shows no session of ours."""
        free = self._state is None or self._state.session_id not in self._names
        return self._leaving > 0 and free


class PassageScenario(Scenario):
    """A play in which a robot passes a door, several times.

    While the robot stands in the doorway, the play sends two CLOSE messages that must not close this
    door. One CLOSE is for another door. The other CLOSE is from an unknown fleet adapter.
    """

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
        self._through = through
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
            self._disturbs = self.play.restart_supervisor if self._restarts else None
            yield DoorOpen(self.door)
            self._disturbs = lambda now: self._tempt(now, NOWHERE)
            yield DOORWAY_S
            self._disturbs = lambda now: self._tempt(now, self.door, STRANGER)
            yield SHOWS_S
            yield DoorClose(self.door)
            yield from self._until_closed()

    def _until_closed(self) -> Iterator[Step]:
        """Wait until the door is closed, because the next passage must begin at a closed door. RMF
        itself does not wait."""
        for _ in range(30):
            if self._mode == d.DoorModeValue.MODE_CLOSED:
                return
            yield 1.0

    def hear(self, topic: str, message: d.Message, now: float) -> list[Said]:
        """Take a message of the graph. After a state of the door, send the disturbing message that is
        due."""
        stated = isinstance(message, d.DoorState) and message.door_name == self.door
        if isinstance(message, d.DoorState) and stated:
            self._mode = message.current_mode.value
        said = self.play.hear(topic, message, now)
        return said + (self._disturb(now) if stated else [])

    def _tempt(self, now: float, door: str, who: str = DoorSupervisor.REQUESTER_ID) -> list[Said]:
        """Send a CLOSE that must not close this door."""
        direct = who == DoorSupervisor.REQUESTER_ID
        self.play.deafen(now + (DOORWAY_S if direct else SHOWS_S))
        return [] if direct and self._through else [_closes(door, now, who)]

    def leave(self, now: float) -> list[Said]:
        """Send CLOSE as the robot's fleet adapter. If the graph has no supervisor of its own, send
        CLOSE in the supervisor's name too."""
        self._leaving += 1
        [name] = self.play.names
        said = [_closes(self.door, now, name)]
        return said if self._through else [*said, _closes(self.door, now)]

    @property
    def left(self) -> bool:
        """Return whether CLOSE was sent, and the door is no longer OPEN."""
        return self._leaving > 0 and self._mode != d.DoorModeValue.MODE_OPEN


def _closes(door: str, now: float, who: str = DoorSupervisor.REQUESTER_ID) -> Said:
    """Return a CLOSE from the supervisor or from a fleet adapter."""
    direct = who == DoorSupervisor.REQUESTER_ID
    request = door_request(door, who, d.DoorModeValue.MODE_CLOSED, now)
    return topics.DOOR_REQUESTS if direct else topics.ADAPTER_DOOR_REQUESTS, request
