"""Robots that patrol over a navigation graph: the orders that RMF's adapter would give them.

A robot drives from vertex to vertex, along the graph's lanes, to one named waypoint after the other. A
vertex belongs to one robot at a time. In a lift the robot rides to the floor of its next vertex, and is
localized there. With a low battery it drives to its charger. This module has no side effects except the
robots' callbacks. `now` is monotonic seconds.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from types import SimpleNamespace
from typing import Any, Final

from bridges.kinds.fleet.places import NavGraph, RobotSite
from bridges.kinds.fleet.signals import Pose
from bridges.kinds.shared.similarity import Similarity
from bridges.messages.definitions import FleetState, Location, RobotMode, RobotState
from bridges.messages.stamps import stamp
from hal_fakes.rmf.ways import Ways

LOW: Final = 0.2
FULL: Final = 0.9
PAUSE_S: Final = 2.0
PATIENCE_S: Final = 15.0
"""A robot that waits longer for a vertex takes another goal."""
TELL_S: Final = 1.0
MOVING, IDLE, CHARGING = 2, 0, 1
Calls = list[Callable[[], None]]


class Execution:
    """A stand-in for `CommandExecution`, which is its own identifier."""

    def __init__(self) -> None:
        self.is_finished = False
        self.given_up = False

    @property
    def identifier(self) -> "Execution":
        """The activity's identifier."""
        return self

    def is_same(self, other: object) -> bool:
        """Is this the same activity?"""
        return self is other

    def okay(self) -> bool:
        """Does RMF still want this command to be carried out?"""
        return not self.given_up

    def finished(self) -> None:
        """Note the end of the command. RMF ignores a second call."""
        self.is_finished = True


class PatrolRobot:
    """One robot. `at`: its last place, on RMF's map. `path`: the vertices to come."""

    def __init__(
        self, name: str, site: RobotSite, callbacks: Any, at: Pose, battery: float
    ) -> None:
        self.name, self.site, self.callbacks = name, site, callbacks
        self.at, self.battery = at, battery
        self.commissioned = True
        self.path: list[int] = []
        self.holds: set[int] = set()
        self.vertex = Ways(site.graph).nearest(at)
        self.execution: Execution | None = None
        self.activity: object = None
        self.updates = 0
        self.refused = 0
        self.visited = 0
        self.waits_since: float | None = None
        self.rests_until = -math.inf

    def update(self, at: Pose, battery: float, activity: object) -> None:
        """Take a state, in the robot's coordinates."""
        self.updates += 1
        self.at, self.activity = self.site.on_rmfs_map(at), activity
        if 0.0 <= battery <= 1.0:
            self.battery = battery
        else:
            self.refused += 1

    def mode(self) -> int:
        """Return the value of RobotMode."""
        if self.execution is not None:
            return MOVING
        here = self.site.graph.vertices[self.vertex]
        return CHARGING if here.charger and self.battery < FULL else IDLE


class Patrols:
    """The robots of one fleet. If `alone` is true, the robots patrol. Otherwise a robot goes only where
    `send` sends it."""

    def __init__(
        self, fleet: str, graph: NavGraph, transforms: Mapping[str, Similarity], alone: bool
    ) -> None:
        self.graph, self.transforms = graph, transforms
        self.robots: list[PatrolRobot] = []
        self._fleet, self._alone = fleet, alone
        self._ways = Ways(graph)
        self._goals = self._ways.goals()
        self._chargers = [i for i, v in enumerate(graph.vertices) if v.charger and not v.lift]
        self._tell_at = -math.inf

    def send(self, robot: PatrolRobot, waypoint: str) -> bool:
        """Send a robot to a waypoint; return False if there is no way."""
        goals = [i for i, v in enumerate(self.graph.vertices) if v.name == waypoint]
        robot.path = self._way(robot.vertex, goals[0], set())[1:] if goals else []
        return bool(robot.path)

    def due(self, now: float) -> Calls:
        """Return the callbacks that are due."""
        return [call for robot in self.robots for call in self._step(robot, now)]

    def state(self, wall: float) -> FleetState | None:
        """Return the fleet's state once each second. Return None at other times."""
        if wall < self._tell_at:
            return None
        self._tell_at = wall + TELL_S
        at = stamp(wall)
        return FleetState(
            name=self._fleet,
            robots=tuple(
                RobotState(
                    name=r.name,
                    mode=RobotMode(mode=r.mode()),
                    battery_percent=100 * r.battery,
                    location=Location(t=at, x=r.at.x, y=r.at.y, yaw=r.at.yaw, level_name=r.at.map),
                )
                for r in self.robots
            ),
        )

    def _step(self, robot: PatrolRobot, now: float) -> Iterator[Callable[[], None]]:
        if robot.execution is not None:
            if not robot.execution.is_finished:
                return
            robot.execution = None
            robot.vertex, robot.path = robot.path[0], robot.path[1:]
            robot.holds = {robot.vertex}
            robot.rests_until = now if robot.path else now + PAUSE_S
        robot.holds.add(robot.vertex)
        if now < robot.rests_until or not robot.commissioned:
            return
        if not robot.path and self._alone:
            self._choose(robot)
        if robot.path and self._is_free(robot, now):
            yield self._order(robot)

    def _choose(self, robot: PatrolRobot) -> None:
        """Choose the next goal. With a low battery the goal is a charger. Otherwise it is the next
        waypoint in turn."""
        here, taken = self.graph.vertices[robot.vertex], self._taken(robot)
        if here.charger and robot.battery < FULL:
            return
        chargers = [i for i in self._chargers if i not in taken]
        chargers.sort(key=lambda i: self.graph.vertices[i].name != robot.site.charger)
        turn = (robot.visited + self.robots.index(robot)) % len(self._goals)
        robot.visited += 1
        goal = chargers[0] if chargers and robot.battery < LOW else self._goals[turn]
        robot.path = self._way(robot.vertex, goal, taken)[1:]

    def _taken(self, robot: PatrolRobot) -> set[int]:
        return {i for other in self.robots if other is not robot for i in other.holds}

    def _is_free(self, robot: PatrolRobot, now: float) -> bool:
        """Reserve the next vertex for the robot if no other robot holds it. Return whether it is
        reserved. A patrolling robot that waits for PATIENCE_S gives up its path."""
        if robot.path[0] not in self._taken(robot):
            robot.holds.add(robot.path[0])
            robot.waits_since = None
            return True
        if robot.waits_since is None:
            robot.waits_since = now
        elif now >= robot.waits_since + PATIENCE_S and self._alone:
            robot.path, robot.waits_since = [], None
        return False

    def _order(self, robot: PatrolRobot) -> Callable[[], None]:
        here, there = (self.graph.vertices[i] for i in (robot.vertex, robot.path[0]))
        robot.execution = execution = Execution()
        yaw = math.atan2(there.y - here.y, there.x - here.x)
        at = robot.site.on_robots_map(Pose(there.level, there.x, there.y, yaw))
        lane = next(
            (e for e in self.graph.lanes if (e.start, e.end) == (robot.vertex, robot.path[0])),
            None,
        )
        destination = SimpleNamespace(
            map=there.level,
            position=[at.x, at.y, at.yaw],
            xy=[at.x, at.y],
            yaw=at.yaw,
            name=there.name,
            dock=(lane.dock or None) if lane else None,
            speed_limit=lane.speed_limit if lane else None,
            inside_lift=SimpleNamespace(name=there.lift) if there.lift else None,
            graph_index=robot.path[0],
        )
        rides = here.level != there.level
        call = robot.callbacks.localize if rides else robot.callbacks.navigate
        return lambda: call(destination, execution)

    def _way(self, start: int, goal: int, avoided: set[int]) -> list[int]:
        """Return the shortest way over free vertices. If there is none, return the shortest way over
        all vertices. Return [] if there is no way."""
        found = self._ways.shortest(start, goal, avoided - {start, goal})
        return found or self._ways.shortest(start, goal, set())
