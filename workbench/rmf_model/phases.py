"""The phases of a robot's task that send messages to our nodes: RequestLift, EndLiftSession, DoorOpen,
DoorClose.

Source: rmf_ros2 9dedd0f, rmf_fleet_adapter/src/rmf_fleet_adapter/phases/. No phase gives up. Three
other phases are left out, because they send nothing to our nodes: the lift watchdog, localisation, and
holding points.
"""

from typing import Final

from msgspec.structs import replace

from bridges.messages import definitions as d
from workbench.rmf_model import Said, has_session
from workbench.rmf_model.robot import LiftDestination, Phase, RobotContext

REPEAT_S: Final = 1.0


class RequestLift(Phase):
    """The phase in which a robot waits for the lift. It ends at a LiftState with the robot's floor,
    DOOR_OPEN and the robot's session. RMF ignores modes.

    The context (RobotContext) repeats the request after each LiftState. The phase's own 1 s timer then
    publishes nothing.
    """

    claims_lift = True

    def __init__(self, lift: str, floor: str, *, inside: bool) -> None:
        self.wanted = LiftDestination(lift, floor, inside)

    def begin(self, robot: RobotContext, now: float) -> list[Said]:
        """Send the request. If the lift has already come for a robot outside the car, end the phase.
        This robot may enter the car from now on, so set `inside` in its destination."""
        if not self.wanted.inside and robot.has_lift_arrived(self.wanted.lift, self.wanted.floor):
            self.done = True
            return robot.set_lift_destination(replace(self.wanted, inside=True), now)
        return robot.set_lift_destination(self.wanted, now)

    def hear(self, robot: RobotContext, message: d.Message, now: float) -> list[Said]:
        """Take a message. When the lift has come, end the phase. A robot that waited outside may enter
        the car from now on. So send its request once more, and set `inside` in its destination
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
    """The phase in which a robot releases the lift. It ends when a LiftState shows another session, or
    none."""

    def __init__(self, lift: str) -> None:
        self.lift = lift

    def begin(self, robot: RobotContext, now: float) -> list[Said]:
        """Release the lift. END_SESSION is sent later, when the next LiftState shows the robot's
        session. Jazzy also sends END_SESSION now."""
        return robot.release_lift()

    def hear(self, robot: RobotContext, message: d.Message, now: float) -> list[Said]:
        """Take a message. End the phase when the session has ended (EndLiftSession.cpp, _init_obs)."""
        if isinstance(message, d.LiftState) and message.lift_name == self.lift:
            self.done = message.session_id != robot.requester_id
        return []


class DoorOpen(Phase):
    """The phase in which a robot opens a door. It sends OPEN at the start and every second, until the
    door is OPEN *and* the heartbeat lists the robot.

    Messages from before the start do not count. After the start, only the latest heartbeat and the
    latest DoorState count. A DoorState of another door also replaces the latest state.
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
    """The phase in which a robot releases a door. It sends CLOSE at the start and every second, until a
    heartbeat no longer lists the robot.

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
