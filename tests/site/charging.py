"""RMF's charging: the reports of a fleet adapter, and the robots' dedicated places.

ChargeBattery drives the robot to its dedicated place. There the robot waits in the mode CHARGING until
the battery is full (rmf_ros2 9dedd0f, ChargeBattery.cpp). The message `charging_assignments` names the
dedicated place.
"""

from bridges.kinds.charger_coordinator.settings import (
    CoordinatorSettings,
    FleetSettings,
    RobotSettings,
    StationSettings,
    Waypoint,
)
from bridges.messages import definitions as d

FLEET = "fleet"
LOW, FULL = 30.0, 100.0


def settings(chargers: tuple[str, ...], robots: tuple[str, ...]) -> CoordinatorSettings:
    """Return a coordinator's settings. Each robot may use every charger, and waits at its own place."""
    places = [*chargers, *map(waits_at, robots)]
    waypoints = {name: Waypoint(level="L1", x=10.0 * n, y=0.0) for n, name in enumerate(places)}
    known = {
        robot: RobotSettings(stations=list(chargers), waits_at=waits_at(robot)) for robot in robots
    }
    fleets = {FLEET: FleetSettings(waypoints=waypoints, robots=known)}
    return CoordinatorSettings(
        stations={name: StationSettings() for name in chargers}, fleets=fleets, start_timeout_s=40.0
    )


def waits_at(robot: str) -> str:
    """Return the name of a robot's own waiting place."""
    return f"wait_{robot}"


class Charge:
    """The reports of a fleet adapter on its robot. `place` is the robot's waypoint, or "" between
    waypoints."""

    def __init__(self, robot: str, known: CoordinatorSettings) -> None:
        self.robot = robot
        self.dedicated = waits_at(robot)
        self.place = ""
        self.task_id = ""
        self.battery = FULL
        self._waypoints = known.fleets[FLEET].waypoints
        self._tasks = 0

    def begins(self) -> None:
        """Begin a charging task, because the battery is low."""
        self._tasks += 1
        self.task_id, self.battery = f"charge-{self._tasks}", LOW

    def ends(self) -> None:
        """End the charging task, because the battery is full or RMF has called the robot away."""
        self.task_id, self.battery, self.place = "", FULL, ""

    def hear(self, message: d.ChargingAssignments) -> None:
        """Note the robot's dedicated place, which the coordinator can change."""
        for assignment in message.assignments:
            if assignment.robot_name == self.robot:
                self.dedicated = assignment.waypoint_name

    def state(self) -> d.RobotState:
        """Return the state of the robot."""
        modes = d.RobotModeValue
        at = self._waypoints.get(self.place)
        away = d.Location(x=-1000.0, y=-1000.0, level_name="L1")
        where = d.Location(x=at.x, y=at.y, level_name=at.level) if at else away
        mode = d.RobotMode(int(modes.MODE_CHARGING if self.task_id else modes.MODE_MOVING))
        return d.RobotState(self.robot, "model", self.task_id, 0, mode, self.battery, where)
