"""The phases of a robot's task that send messages to us: RequestLift, EndLiftSession, DoorOpen,
DoorClose.

Source: rmf_ros2 9dedd0f, rmf_fleet_adapter/src/rmf_fleet_adapter/phases/. No phase gives up. Three
other phases are left out, because they send nothing to us: the lift watchdog, localisation, and holding
points.
"""

from typing import Final

from msgspec.structs import replace

from bridges.messages import definitions as d
from workbench.rmf_model import Said, has_session
from workbench.rmf_model.robot import LiftDestination, Phase, RobotContext

REPEAT_S: Final = 1.0


class RequestLift(Phase):
    """Wait for a LiftState with our floor, DOOR_OPEN and our session. RMF ignores modes.

    The phase has a 1 s timer, which publishes nothing after a destination is set. From then on, the
    context repeats the request at each LiftState.
    """

    claims_lift = True

    def __init__(self, lift: str, floor: str, *, inside: bool) -> None:
        self.wanted = LiftDestination(lift, floor, inside)

    def begin(self, robot: RobotContext, now: float) -> list[Said]:
        """Send the request. If the robot is outside and the lift has already come, end the phase
        immediately."""
        if not self.wanted.inside and robot.has_lift_arrived(self.wanted.lift, self.wanted.floor):
            self.done = True
            return robot.set_lift_destination(replace(self.wanted, inside=True), now)
        return robot.set_lift_destination(self.wanted, now)

    def hear(self, robot: RobotContext, message: d.Message, now: float) -> list[Said]:
        """Take a message. After the lift has come, send the request of a robot inside the car
        (RequestLift.cpp:322-326, _finish)."""
        match message:
            case d.LiftState(
                lift_name=self.wanted.lift,
                current_floor=self.wanted.floor,
                door_state=d.LiftDoor.DOOR_OPEN,
                session_id=robot.requester_id,
            ):
                self.done = True
        if not self.done or self.wanted.inside:
            return []
        said = robot.set_lift_destination(replace(self.wanted, inside=True), now)
        robot.lift_arrived = True
        return said


class EndLiftSession(Phase):
    """Release the lift. The phase ends when a LiftState shows a session other than ours."""

    def __init__(self, lift: str) -> None:
        self.lift = lift

    def begin(self, robot: RobotContext, now: float) -> list[Said]:
        """Send nothing, because END_SESSION follows the next LiftState with our session."""
        return robot.release_lift()

    def hear(self, robot: RobotContext, message: d.Message, now: float) -> list[Said]:
        """Take a message. End the phase when the session has ended (EndLiftSession.cpp, _init_obs)."""
        if isinstance(message, d.LiftState) and message.lift_name == self.lift:
            self.done = message.session_id != robot.requester_id
        return []


class DoorOpen(Phase):
    """Send OPEN at the start and every second, until the door is OPEN *and* the heartbeat lists us.

    The messages before the start do not count. After the start, only the latest heartbeat and the
    latest state count, and the state may be of any door.
    """

    def __init__(self, door: str) -> None:
        self.door = door
        self._state: d.DoorState | None = None
        self._heartbeat: d.SupervisorHeartbeat | None = None

    def begin(self, robot: RobotContext, now: float) -> list[Said]:
        """Begin to hold the door, and send OPEN."""
        robot.holding_door = self.door
        return self.tick(robot, now)

    def hear(self, robot: RobotContext, message: d.Message, now: float) -> list[Said]:
        """Take a message. Check the door and the heartbeat (DoorOpen.cpp, _update_status)."""
        match message:
            case d.DoorState():
                self._state = message
            case d.SupervisorHeartbeat():
                self._heartbeat = message
        self.done = (
            self._state is not None
            and self._heartbeat is not None
            and self._state.door_name == self.door
            and self._state.current_mode.value == d.DoorModeValue.MODE_OPEN
            and has_session(self._heartbeat, robot.requester_id, self.door)
        )
        return []

    def tick(self, robot: RobotContext, now: float) -> list[Said]:
        """Send OPEN again."""
        self.due_at = now + REPEAT_S
        return [robot.ask_door(self.door, d.DoorModeValue.MODE_OPEN, now)]


class DoorClose(Phase):
    """Send CLOSE at the start and every second, until a heartbeat no longer lists us.

    The phase does not wait for the door.
    """

    def __init__(self, door: str) -> None:
        self.door = door

    def begin(self, robot: RobotContext, now: float) -> list[Said]:
        """Stop holding the door, and send CLOSE."""
        if robot.holding_door == self.door:
            robot.holding_door = None
        return self.tick(robot, now)

    def hear(self, robot: RobotContext, message: d.Message, now: float) -> list[Said]:
        """Take a message. Check the heartbeat (DoorClose.cpp, _update_status)."""
        if isinstance(message, d.SupervisorHeartbeat):
            self.done = not has_session(message, robot.requester_id, self.door)
        return []

    def tick(self, robot: RobotContext, now: float) -> list[Said]:
        """Send CLOSE again."""
        self.due_at = now + REPEAT_S
        return [robot.ask_door(self.door, d.DoorModeValue.MODE_CLOSED, now)]
