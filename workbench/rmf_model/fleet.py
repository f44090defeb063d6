"""A fleet adapter and its robots, for charging only.

The rules come from rmf_ros2 9dedd0f (TaskManager.cpp, tasks/ChargeBattery.cpp,
phases/WaitForCharge.cpp, FleetUpdateHandle.cpp), and from tests with Jazzy's adapter:
1. ChargeBattery goes to the robot's dedicated waypoint and waits there for its battery. An assignment
   with a new waypoint or mode restarts a running ChargeBattery, and moves no other robot. A waypoint
   missing in the graph crashes the adapter.
2. ChargeBattery is a task in two cases: RMF's planner plans it, or RMF starts the automatic retreat.
   The retreat begins when the battery is too low for the drive to the dedicated waypoint. A robot at
   that waypoint never retreats. With Jazzy, no robot below the recharge threshold retreats. The task
   ends at recharge_soc. With `finishing_request: charge` the fleet's robots run ChargeBattery after
   their tasks. This ChargeBattery is no task, and lasts until the next task, even with a full battery.
   With `nothing` a robot stays. With `park` a robot drives to a parking spot. Jazzy's adapter (branch
   jazzy, 7eef65a) knows no parking spots. With `park`, its robots go to their dedicated waypoints, and
   go there again after each assignment.
3. A robot without a task shows the mode IDLE and no task id, even while it charges. Only WaitForCharge
   sets CHARGING, and nothing resets CHARGING. Therefore every later task shows CHARGING too.
4. An EasyFullControl adapter forgets the assignments in a restart. First the adapter takes the retained
   assignment. A moment later, the adapter replaces the assignment by the charger in its file.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from bridges.messages import definitions as d
from bridges.messages.topics import CHARGING_ASSIGNMENTS, FLEET_STATES, AnyTopic
from workbench.rmf_model import Party, Said

EVERY_S: Final = 1.0
RECHARGE_PERCENT: Final = 100.0
RETREAT_PERCENT: Final = 12.0
TOO_LATE_PERCENT: Final = 10.0
IDLE: Final = d.RobotModeValue.MODE_IDLE
Graph = Mapping[str, tuple[str, float, float]]
"""Waypoint -> level, x (m), y (m)."""
Finishing = Literal["charge", "park", "nothing"]
Doing = Literal["", "work", "charge", "idle charge", "idle park"]


class AdapterCrashed(Exception):
    """RMF's fleet adapter crashed, because an assignment named an unknown waypoint."""


@dataclass
class FleetRobot:
    """A robot of a fleet.

    - `place`: the waypoint at which the robot stands; "" on the road.
    - `goes_to`: the robot's destination.
    - `dedicated`: the waypoint of the robot's charging assignment.
    - `waits`: whether the assignment has MODE_WAIT, so that the robot waits at `dedicated`.
    - `doing`: the robot's task, or the robot's activity without a task.
    - `task_id`: the id of the task; "" without a task.
    - `mode`: the last mode that a phase set.
    - `stuck`: whether the robot cannot drive.
    """

    name: str
    place: str
    dedicated: str
    battery_percent: float = 100.0
    waits: bool = False
    doing: Doing = ""
    task_id: str = ""
    goes_to: str = ""
    arrives_at: float = 0.0
    came_from: str = ""
    mode: d.RobotModeValue = d.RobotModeValue.MODE_IDLE
    stuck: bool = False

    @property
    def charges(self) -> bool:
        """Return whether the robot's ChargeBattery runs, as a task or without a task."""
        return self.doing in ("charge", "idle charge")


class FleetAdapter(Party):
    """A fleet adapter that publishes FleetState at 1 Hz and hears ChargingAssignments."""

    subscribes: Sequence[AnyTopic] = (CHARGING_ASSIGNMENTS,)

    def __init__(
        self,
        name: str,
        graph: Graph,
        robots: Mapping[str, str],
        drive_s: float,
        finishing: Finishing = "nothing",
        jazzy: bool = False,
    ) -> None:
        """Begin with `robots` at their parking spots.

        - `drive_s`: time (s) that each drive takes.
        - `finishing`: the fleet's `finishing_request`.
        - `jazzy`: whether the adapter is Jazzy's, whose rules differ in part.
        """
        self.name = name
        self.graph = graph
        self.drive_s = drive_s
        self.finishing = finishing
        self.jazzy = jazzy
        self.robots = {who: FleetRobot(who, place, place) for who, place in robots.items()}
        self._spots = dict(robots)
        self._tasks = 0
        self._told_at = -EVERY_S
        for robot in self.robots.values():
            self._rest(robot, 0.0)

    def charge(self, who: str, now: float, percent: float = 40.0) -> None:
        """Begin ChargeBattery as a task, because RMF's planner finds the battery low."""
        self.robots[who].battery_percent = percent
        self._begin(self.robots[who], "charge", now)

    def works(self, who: str, place: str, now: float) -> None:
        """Begin another task."""
        self._begin(self.robots[who], "work", now, place)

    def rests(self, who: str, now: float) -> None:
        """End the task and begin the fleet's finishing request."""
        self._rest(self.robots[who], now)

    def starts_again(self, now: float) -> None:
        """Restart the adapter after a kill. Each robot then has the charger in the adapter's file."""
        for robot in self.robots.values():
            robot.dedicated, robot.waits, robot.mode = self._spots[robot.name], False, IDLE
            self._rest(robot, now)

    def strays(self, who: str, place: str, now: float) -> None:
        """Let the robot drive to a place to which its task does not send it."""
        self._go(self.robots[who], place, now)

    def hear(self, message: d.Message, now: float) -> list[Said]:
        """Take a charging assignment."""
        if isinstance(message, d.ChargingAssignments) and message.fleet_name == self.name:
            for assignment in message.assignments:
                if assignment.waypoint_name not in self.graph:
                    raise AdapterCrashed(assignment.waypoint_name)
                robot = self.robots.get(assignment.robot_name)
                if robot is not None:
                    waits = assignment.mode == d.ChargingMode.MODE_WAIT
                    self._dedicate(robot, assignment.waypoint_name, waits, now)
        return []

    def tick(self, now: float) -> list[Said]:
        """Publish the fleet's state when it is due. Before that, move driving robots, and end the
        charging task of each full robot. Send robots with a low battery to their chargers."""
        for robot in self.robots.values():
            self._move(robot, now)
            self._retreat(robot, now)
        if now < self._told_at + EVERY_S:
            return []
        self._told_at = now
        states = tuple(self._state(robot, now) for robot in self.robots.values())
        return [(FLEET_STATES, d.FleetState(self.name, states))]

    def wake_at(self) -> float:
        """Time (s) of the next state or arrival."""
        ways = [robot.arrives_at for robot in self.robots.values() if robot.goes_to]
        return min([self._told_at + EVERY_S, *ways])

    # ---- tasks

    def _begin(self, robot: FleetRobot, doing: Doing, now: float, place: str = "") -> None:
        named = "patrol.dispatch-" if doing == "work" else "Charge"
        robot.doing, robot.task_id = doing, f"{named}{self._tasks}"
        self._tasks += 1
        self._go(robot, place or robot.dedicated, now)

    def _rest(self, robot: FleetRobot, now: float) -> None:
        robot.doing, robot.task_id = "", ""
        if self.finishing == "charge":
            robot.doing = "idle charge"
            self._go(robot, robot.dedicated, now)
        elif self.finishing == "park":
            robot.doing = "idle park"
            self._go(robot, robot.dedicated if self.jazzy else self._spots[robot.name], now)

    def _retreat(self, robot: FleetRobot, now: float) -> None:
        """Begin the automatic retreat of a robot with a low battery (consider_retreating_to_charger). A
        robot with a task, or a robot at its dedicated waypoint, does not retreat."""
        low = robot.battery_percent < RETREAT_PERCENT
        if self.jazzy and robot.battery_percent <= TOO_LATE_PERCENT:
            return
        if low and not robot.task_id and robot.dedicated not in (robot.place, robot.goes_to):
            self._begin(robot, "charge", now)

    def _dedicate(self, robot: FleetRobot, waypoint: str, waits: bool, now: float) -> None:
        changed = (waypoint, waits) != (robot.dedicated, robot.waits)
        robot.dedicated, robot.waits = waypoint, waits
        if changed and (robot.charges or (self.jazzy and robot.doing == "idle park")):
            self._go(robot, waypoint, now)

    # ---- on the road

    def _go(self, robot: FleetRobot, place: str, now: float) -> None:
        if robot.place == place:
            robot.goes_to = ""
            self._arrived(robot)
            return
        if robot.stuck:
            return
        robot.came_from = robot.place or robot.came_from
        robot.place, robot.goes_to, robot.arrives_at = "", place, now + self.drive_s

    def _move(self, robot: FleetRobot, now: float) -> None:
        if robot.goes_to and now >= robot.arrives_at:
            robot.place, robot.goes_to = robot.goes_to, ""
            self._arrived(robot)
        if robot.doing == "charge" and robot.battery_percent >= RECHARGE_PERCENT:
            self._rest(robot, now)

    def _arrived(self, robot: FleetRobot) -> None:
        if robot.charges:
            robot.mode = d.RobotModeValue.MODE_CHARGING

    def _state(self, robot: FleetRobot, now: float) -> d.RobotState:
        level, x, y = self.graph[robot.place or robot.came_from]
        if robot.goes_to:
            level, x_to, y_to = self.graph[robot.goes_to]
            done = 1.0 - max(0.0, robot.arrives_at - now) / self.drive_s
            x, y = x + (x_to - x) * done, y + (y_to - y) * done
        mode = robot.mode if robot.task_id else d.RobotModeValue.MODE_IDLE
        return d.RobotState(
            name=robot.name,
            task_id=robot.task_id,
            mode=d.RobotMode(int(mode)),
            battery_percent=robot.battery_percent,
            location=d.Location(x=x, y=y, level_name=level),
        )
