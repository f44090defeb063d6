"""A fleet adapter and its robots, as far as charging goes.

ChargeBattery goes to the robot's dedicated waypoint and waits there for its battery, as the mode
CHARGING shows; nothing sets that mode back while another task runs. A changed charging assignment
restarts it. A waypoint that the graph does not have is the end of the adapter. (rmf_ros2 9dedd0f:
ChargeBattery.cpp, WaitForCharge.cpp, TaskManager::robot_mode, update_charging_assignments.)
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from bridges.rmf import definitions as d
from bridges.rmf.topics import CHARGING_ASSIGNMENTS, FLEET_STATES, AnyTopic
from hal_fakes.rmf import Party, Said

EVERY_S: Final = 1.0
Graph = Mapping[str, tuple[str, float, float]]
"""Waypoint -> level, x, y (m)."""


class AdapterCrashed(Exception):
    """What RMF's fleet adapter does when it is sent to a waypoint that it does not know."""


@dataclass
class FleetRobot:
    """`place`: the waypoint at which it stands; "" on the road. `goes_to`: where its task wants it.
    `dedicated`: its charger or waiting place. `task_id`: "" when it has none."""

    name: str
    place: str
    dedicated: str
    battery_percent: float = 40.0
    task_id: str = ""
    goes_to: str = ""
    arrives_at: float = 0.0
    came_from: str = ""
    mode: d.RobotModeValue = d.RobotModeValue.MODE_IDLE


class Fleet(Party):
    """Publishes FleetState at 1 Hz and hears ChargingAssignments."""

    subscribes: Sequence[AnyTopic] = (CHARGING_ASSIGNMENTS,)

    def __init__(self, name: str, graph: Graph, robots: Mapping[str, str], drive_s: float) -> None:
        """`robots`: each where it stands. `drive_s`: how long every way takes."""
        self.name = name
        self.graph = graph
        self.drive_s = drive_s
        self.robots = {who: FleetRobot(who, place, place) for who, place in robots.items()}
        self._tasks = 0
        self._told_at = -EVERY_S

    def charge(self, who: str, now: float) -> None:
        """RMF finds its battery low: ChargeBattery begins."""
        robot = self.robots[who]
        self._tasks += 1
        robot.task_id = f"charge-{self._tasks}"
        self._go(robot, robot.dedicated, now)

    def works(self, who: str, place: str, now: float) -> None:
        """Another task takes it away."""
        robot = self.robots[who]
        self._tasks += 1
        robot.task_id = f"work-{self._tasks}"
        self._go(robot, place, now)

    def strays(self, who: str, place: str, now: float) -> None:
        """It drives there in the task that it has, whatever that wants."""
        self._go(self.robots[who], place, now)

    def hear(self, message: d.Message, now: float) -> list[Said]:
        """Charging assignments."""
        if isinstance(message, d.ChargingAssignments) and message.fleet_name == self.name:
            for assignment in message.assignments:
                if assignment.waypoint_name not in self.graph:
                    raise AdapterCrashed(assignment.waypoint_name)
                robot = self.robots.get(assignment.robot_name)
                if robot is not None:
                    self._dedicate(robot, assignment.waypoint_name, now)
        return []

    def tick(self, now: float) -> list[Said]:
        """Robots drive on, batteries that are full end their task, and the state goes out."""
        for robot in self.robots.values():
            self._move(robot, now)
        if now < self._told_at + EVERY_S:
            return []
        self._told_at = now
        states = tuple(self._state(robot, now) for robot in self.robots.values())
        return [(FLEET_STATES, d.FleetState(self.name, states))]

    def wake_at(self) -> float:
        """The next state, or the next arrival."""
        ways = [robot.arrives_at for robot in self.robots.values() if robot.goes_to]
        return min([self._told_at + EVERY_S, *ways])

    def _dedicate(self, robot: FleetRobot, waypoint: str, now: float) -> None:
        if waypoint != robot.dedicated and robot.task_id.startswith("charge"):
            self._go(robot, waypoint, now)
        robot.dedicated = waypoint

    def _go(self, robot: FleetRobot, place: str, now: float) -> None:
        if robot.place == place:
            robot.goes_to = ""
            self._arrived(robot)
            return
        robot.came_from = robot.place or robot.came_from
        robot.place, robot.goes_to, robot.arrives_at = "", place, now + self.drive_s

    def _move(self, robot: FleetRobot, now: float) -> None:
        if robot.goes_to and now >= robot.arrives_at:
            robot.place, robot.goes_to = robot.goes_to, ""
            self._arrived(robot)
        if robot.task_id.startswith("charge") and robot.battery_percent >= 100.0:
            robot.task_id, robot.mode = "", d.RobotModeValue.MODE_IDLE

    def _arrived(self, robot: FleetRobot) -> None:
        if robot.task_id.startswith("charge"):
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
