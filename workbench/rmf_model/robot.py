"""A fleet adapter's context of one robot, with the actions that all phases share.

Source: rmf_ros2 9dedd0f, rmf_fleet_adapter/src/rmf_fleet_adapter/agv/RobotContext.cpp:1281-1324 and
1600-1800. The phases are in `phases.py`. With `jazzy`, the context follows Jazzy's adapter where it
differs (branch jazzy, 7eef65a, RobotContext.cpp:1054-1095 and 1329-1419).
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence

from msgspec import Struct

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import stamp
from workbench.rmf_model import NEVER, Party, Said, door_request


class LiftDestination(Struct, frozen=True):
    """The lift and the floor that the robot requests. `inside` tells whether the robot may be in the
    car."""

    lift: str
    floor: str
    inside: bool


class Phase(ABC):
    """One step of a robot's task.

    `due_at` is the time (s) of the phase's wall timer. With `claims_lift`, the robot still needs the
    lift. Then the context does not release the lift, even if the robot seems not to use it.
    """

    done = False
    due_at = NEVER
    claims_lift = False

    @abstractmethod
    def begin(self, robot: "RobotContext", now: float) -> list[Said]:
        """Start the phase."""

    @abstractmethod
    def hear(self, robot: "RobotContext", message: d.Message, now: float) -> list[Said]:
        """Take a message, after the context (RobotContext) has reacted to it."""

    def tick(self, robot: "RobotContext", now: float) -> list[Said]:
        """Fire the phase's wall timer."""
        return []


class RobotContext(Party):
    """A fleet adapter's RobotContext, with its running phase, if there is one. `requester_id` is
    fleet/robot.

    The caller sets `on_task` if the robot has a task, and `in_car` if the robot's position is inside
    the lift. To cancel a phase, set `robot.phase = None`.
    """

    subscribes: Sequence[topics.AnyTopic] = (
        topics.LIFT_STATES,
        topics.DOOR_STATES,
        topics.DOOR_SUPERVISOR_HEARTBEAT,
    )

    def __init__(self, requester_id: str, jazzy: bool = False) -> None:
        self.requester_id = requester_id
        self.jazzy = jazzy
        self.phase: Phase | None = None
        self.on_task = True
        self.in_car = False
        self.destination: LiftDestination | None = None
        self.lift_arrived = False
        self.holding_door: str | None = None
        self._idle_since: float | None = None
        self._tasked_at = float("-inf")

    def begin(self, phase: Phase, now: float) -> list[Said]:
        """Start this phase. Drop the previous phase, even if it is not finished."""
        self.phase = phase
        return phase.begin(self, now)

    @property
    def done(self) -> bool:
        """Return whether no phase is running."""
        return self.phase is None or self.phase.done

    def hear(self, message: d.Message, now: float) -> list[Said]:
        """Take a message. First the context reacts to it, and then the running phase."""
        said: list[Said] = []
        match message:
            case d.LiftState():
                said += self._check_lift_state(message, now)
            case d.SupervisorHeartbeat():
                said += self._check_door_supervisor(message, now)
        if self.phase is not None and not self.phase.done:
            said += self.phase.hear(self, message, now)
        return said

    def tick(self, now: float) -> list[Said]:
        """Fire the phase's wall timer."""
        return [] if self.phase is None or self.done else self.phase.tick(self, now)

    def wake_at(self) -> float:
        """Time (s) of the phase's wall timer."""
        return NEVER if self.phase is None or self.done else self.phase.due_at

    # ---- lift

    def set_lift_destination(self, wanted: LiftDestination, now: float) -> list[Said]:
        """Request the lift now, and again at each LiftState."""
        self.lift_arrived = self.has_lift_arrived(wanted.lift, wanted.floor)
        self.destination = wanted
        self._idle_since = None
        return self._publish_destination(now)

    def has_lift_arrived(self, lift: str, floor: str) -> bool:
        """Return whether the lift has already come to this floor for the robot's present request."""
        at = self.destination
        return self.lift_arrived and at is not None and (at.lift, at.floor) == (lift, floor)

    def release_lift(self) -> list[Said]:
        """Stop requesting the lift. END follows when the next LiftState shows the robot's session.
        Jazzy also sends END immediately."""
        said = []
        if self.jazzy and self.destination is not None:
            said = [self._end(self.destination.lift, self.destination.floor, 0.0)]
        self.destination = None
        self.lift_arrived = False
        self._idle_since = None
        return said

    def _end(self, lift: str, floor: str, now: float) -> Said:
        end = d.LiftRequest(
            lift_name=lift,
            request_time=stamp(now),
            session_id=self.requester_id,
            request_type=d.LiftRequestType.REQUEST_END_SESSION,
            destination_floor=floor,
        )
        return topics.ADAPTER_LIFT_REQUESTS, end

    def _publish_destination(self, now: float) -> list[Said]:
        if self.destination is None:
            return []
        request = d.LiftRequest(
            lift_name=self.destination.lift,
            request_time=stamp(now),
            session_id=self.requester_id,
            request_type=d.LiftRequestType.REQUEST_AGV_MODE,
            destination_floor=self.destination.floor,
            door_state=d.LiftRequestDoor.DOOR_OPEN,
        )
        return [(topics.ADAPTER_LIFT_REQUESTS, request)]

    def _check_lift_state(self, state: d.LiftState, now: float) -> list[Said]:
        said = self._release_if_idle(now)
        if self.destination is not None and self.destination.lift == state.lift_name:
            return said + self._publish_destination(now)
        if state.session_id == self.requester_id:
            said.append(self._end(state.lift_name, "", 0.0 if self.jazzy else now))
        return said + (self._publish_destination(now) if self.jazzy else [])

    def _release_if_idle(self, now: float) -> list[Said]:
        claimed = self.phase is not None and self.phase.claims_lift and not self.phase.done
        if self.destination is None or claimed:
            return []
        if self.destination.inside and self.on_task:
            return []
        if self.destination.inside and self.in_car:
            self._idle_since = None
        elif self.jazzy and not self.destination.inside:
            return self.release_lift()
        elif self._idle_since is None:
            self._idle_since = now
        elif self.jazzy or now - self._idle_since > (10.0 if self.destination.inside else 30.0):
            return self.release_lift()
        return []

    # ---- door

    def ask_door(self, door: str, mode: d.DoorModeValue, now: float) -> Said:
        """Make the adapter's DoorRequest."""
        return topics.ADAPTER_DOOR_REQUESTS, door_request(door, self.requester_id, mode, now)

    def _check_door_supervisor(self, heartbeat: d.SupervisorHeartbeat, now: float) -> list[Said]:
        if self.on_task:
            self._tasked_at = now
        elif self._tasked_at + 10.0 < now:
            self.holding_door = None
        return [
            self.ask_door(door.door_name, d.DoorModeValue.MODE_CLOSED, now)
            for door in heartbeat.all_sessions
            if any(session.requester_id == self.requester_id for session in door.sessions)
            and door.door_name != self.holding_door
        ]
