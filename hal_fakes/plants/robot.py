"""A simulated mobile robot. It turns, drives straight to its goal, and turns again. It drains its
battery, and charges it at a charger.

The robot's far side is a manager's HTTP interface or VDA 5050. The far side gives the robot orders as
JSON through `drive`, and reads `RobotSeen`. The order `press` sets these signals:

- `fault`: the robot has a fault of its own.
- `manual`: the robot takes no orders.
- `lost`: the manager only repeats the robot's last report.
- `lies`: the robot reports each command as completed at once.

These parts can fail:

| part      | off, stuck      | slow              | wrong                | garbage              |
| wheels    | does not move   | a fifth the speed | stops halfway        | stops halfway        |
| localiser | no effect       | no effect         | is on an unknown map | is far off the graph |
| battery   | stays as it is  | stays as it is    | reports 250 %        | reports -3 %         |
| pause     | is not obeyed, in each mode                                                         |

With `missions` the robot's own manager sends the robot along paths. If the robot stands for PATIENCE_S,
for example because it is paused, the manager chooses another path. A robot that stands in a lift's car
rides with the car. The car stops at its floors one after the other, at each floor for RIDE_S.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Final

import msgspec
from msgspec.structs import replace

from bridges.kinds.fleet.places import RobotSite
from bridges.kinds.fleet.settings import FleetFiles
from bridges.kinds.fleet.signals import Pose
from bridges.settings.config import Config
from bridges.settings.fleet_site import read_site
from hal_fakes.plants.machine import WiredPlant
from hal_fakes.rmf.ways import Ways

SPEED: Final = 0.7
TURNS: Final = 1.0
SLOWNESS: Final = 0.2
RIDE_S: Final = 8.0
ACTS_S: Final = 5.0
AT_CHARGER_M: Final = 0.3
DRAINS: Final = 0.0005
CHARGES: Final = 0.005
"""The charge that the battery gains in each second. DRAINS is the charge that it loses. Both are so
large that a person sees the change."""
PARTS: Final = ("wheels", "localiser", "battery", "pause")
BUTTONS: Final = ("fault", "manual", "lost", "lies")
NEVER: Final = math.inf
RESTS_S: Final = 4.0
"""The pause between two missions."""
PATIENCE_S: Final = 30.0
Missions = Callable[[Pose], Sequence[Pose]]
"""A function that returns the places of the next mission. Its argument is the robot's present place."""


class RobotOrder(msgspec.Struct, frozen=True):
    """An order to the robot. `doing` is go, stop, act, localize, pause or resume. `at` is the goal, on
    the robot's map."""

    id: str
    doing: str
    at: Pose | None = None
    speed_limit: float | None = None


class RobotSeen(msgspec.Struct, frozen=True):
    """The robot's report. `completed` is the id of the last completed order, and "" before the first.
    `path` has the places of the mission that the robot has still to reach. `mission` is the
    mission's number."""

    at: Pose
    battery: float
    moving: bool
    charging: bool
    completed: str
    current: str
    fault: str
    manual: bool
    said_at: float
    path: tuple[Pose, ...] = ()
    paused: bool = False
    mission: int = 0


class RobotPlant(WiredPlant):
    """The robot. `start` is its first place. `chargers` are the chargers' places. `cars` has the places
    of each lift's car, floor by floor. All places are on the robot's map."""

    def __init__(
        self,
        name: str,
        start: Pose,
        chargers: Sequence[Pose] = (),
        cars: Mapping[str, Sequence[Pose]] = {},
        parts: Sequence[str] = (),
        missions: Missions | None = None,
    ) -> None:
        super().__init__(name, (), (*PARTS, *parts), BUTTONS)
        self.at = start
        self.battery = 0.8
        self._chargers, self._cars = chargers, cars
        self._order: RobotOrder | None = None
        self._completed = ""
        self._ran_at: float | None = None
        self._floor_at = NEVER
        self._act_until = NEVER
        self._last: RobotSeen | None = None
        self.paused = False
        self._missions = missions
        self._mission, self._mission_at = 0, NEVER
        self._path: list[Pose] = []

    def contact(self, signal: str) -> bool:
        """Return False: the robot has no contacts."""
        return False

    def drive(self, signal: str, asserted: bool, now: float) -> None:
        """Take an order, as JSON."""
        self.advance(now)
        self.run()  # first obey the last order up to this moment
        order = msgspec.json.decode(signal, type=RobotOrder)
        if self.pressed["manual"]:
            return
        if order.at is not None and not order.at.map:
            order = replace(order, at=replace(order.at, map=self.at.map))
        self.note("relay", order.doing, order.id)
        self._settled = False
        if order.doing in ("pause", "resume"):
            self.paused = order.doing == "pause" and "pause" not in self.failures
            return
        self._act_until = now + ACTS_S if order.doing == "act" else NEVER
        self._order = order
        if order.doing == "stop":
            self._end(order)
        elif order.doing == "localize" and order.at:
            self.at = replace(order.at, yaw=self.at.yaw)
            self._end(order)
        elif self.pressed["lies"]:
            self._completed = order.id
        self._wait_in_car()

    def run(self) -> None:
        """Bring the robot's place and battery up to the present moment."""
        left_s = 0.0 if self._ran_at is None else max(0.0, self.now - self._ran_at)
        self._ran_at = self.now
        moved = self._legs()
        self._drain(left_s)
        if moved and self._order:
            self._go(left_s)
        if self._order and self.now >= self._act_until:
            self._act_until = NEVER
            self._end(self._order)
        if self.now >= self._floor_at:
            self._next_floor()
        self._follow()

    def _follow(self) -> None:
        """Drive to the next place of the mission, or begin the next mission."""
        if self._missions and self._mission_at == NEVER:
            self._mission_at = self.now + RESTS_S
        if self._path and self._legs():
            self._mission_at = self.now + PATIENCE_S
        elif self._missions and self.now >= self._mission_at:
            self._order = None
            self._path, self._mission = [*self._missions(self.at)], self._mission + 1
            self._mission_at = self.now + (PATIENCE_S if self._path else RESTS_S)
        if self._path and self._order is None:
            self._order = RobotOrder(f"mission-{self._mission}", "go", self._path[0])

    def event_at(self) -> float:
        """Return the time of arrival, of the end of an action, or of the car's next floor."""
        legs = self._legs()
        arrives_at = (self._ran_at or self.now) + sum(legs) + 1e-6 if legs else NEVER
        mission_at = NEVER if legs else self._mission_at
        return min(arrives_at, self._act_until, self._floor_at, mission_at)

    def reading(self) -> RobotSeen:
        """Return the robot's report. Failing parts and pressed signals change the report."""
        self.run()
        if self.pressed["lost"] and self._last is not None:
            return self._last
        at, battery = self.at, self.battery
        match self.failures.get("localiser"):
            case "wrong":
                at = replace(at, map="unmapped")
            case "garbage":
                at = replace(at, x=at.x + 500.0)
        strange = {"wrong": 2.5, "garbage": -0.03}
        self._last = RobotSeen(
            at=at,
            battery=strange.get(self.failures.get("battery") or "", battery),
            moving=bool(self._legs()),
            charging=self._charging(),
            completed=self._completed,
            current=self._order.id if self._order else "",
            fault="wheel motor too hot" if self.pressed["fault"] else "",
            manual=self.pressed["manual"],
            said_at=self.now,
            path=tuple(self._path),
            paused=self.paused,
            mission=self._mission,
        )
        return self._last

    def _legs(self) -> tuple[float, ...]:
        """Return the seconds that the robot still needs to turn, to drive and to turn again. Return an
        empty tuple for a robot that stands."""
        order = self._order
        wheels = self.failures.get("wheels")
        broken = wheels in ("off", "stuck") or any(self.pressed[b] for b in ("fault", "manual"))
        if order is None or order.doing != "go" or order.at is None or broken or self.paused:
            return ()
        if order.at.map != self.at.map:
            return ()  # the car has carried the robot to another floor
        goal, share = order.at, 0.5 if wheels in ("wrong", "garbage") else 1.0
        length = math.hypot(goal.x - self.at.x, goal.y - self.at.y) * share
        pace = SLOWNESS if wheels == "slow" else 1.0
        speed = min(SPEED, order.speed_limit or SPEED) * pace
        heading = self._heading(goal) if length > 0.01 else goal.yaw
        turn = abs(math.remainder(heading - self.at.yaw, math.tau))
        last = abs(math.remainder(goal.yaw - heading, math.tau))
        return turn / TURNS / pace, length / speed, last / TURNS / pace

    def _heading(self, goal: Pose) -> float:
        return math.atan2(goal.y - self.at.y, goal.x - self.at.x)

    def _go(self, left_s: float) -> None:
        """Drive for so many seconds."""
        order, legs = self._order, self._legs()
        assert order is not None
        assert order.at is not None
        goal = order.at
        if left_s >= sum(legs):
            halfway = self.failures.get("wheels") in ("wrong", "garbage")
            x, y = (self.at.x + goal.x) / 2, (self.at.y + goal.y) / 2
            self.at = replace(self.at, x=x, y=y) if halfway else goal
            self._end(order)
            self._wait_in_car()
            return
        turn, driving, _ = legs
        heading = self._heading(goal) if driving * SPEED > 0.01 else goal.yaw
        if left_s < turn:
            rest = math.remainder(heading - self.at.yaw, math.tau) * left_s / turn
            self.at = replace(self.at, yaw=self.at.yaw + rest)
            return
        share = min(1.0, (left_s - turn) / driving) if driving else 1.0
        x = self.at.x + (goal.x - self.at.x) * share
        y = self.at.y + (goal.y - self.at.y) * share
        self.at = Pose(self.at.map, x, y, heading)

    def _end(self, order: RobotOrder) -> None:
        self._completed, self._order = order.id, None
        if self._path and order.at == self._path[0]:
            del self._path[0]
            self._mission_at = self.now + RESTS_S
            self._follow()
        self.note("sensor", "completed", order.id)

    def _drain(self, for_s: float) -> None:
        if "battery" not in self.failures:
            rate = CHARGES if self._charging() else -DRAINS * (1 if self._order else 0.2)
            self.battery = min(1.0, max(0.0, self.battery + rate * for_s))

    def _charging(self) -> bool:
        near = (c for c in self._chargers if c.map == self.at.map)
        stands = self._order is None or self._order.doing != "go"
        return stands and any(_apart(c, self.at) <= AT_CHARGER_M for c in near)

    def _wait_in_car(self) -> None:
        self._floor_at = self.now + RIDE_S if self._car() and not self._legs() else NEVER

    def _car(self) -> Sequence[Pose]:
        return next(
            (
                floors
                for floors in self._cars.values()
                for at in floors
                if at.map == self.at.map and _apart(at, self.at) <= AT_CHARGER_M
            ),
            (),
        )

    def _next_floor(self) -> None:
        floors = self._car()
        here = [at.map for at in floors].index(self.at.map)
        self.at = replace(floors[(here + 1) % len(floors)], yaw=self.at.yaw)
        self.note("sensor", "floor", self.at.map)
        self._wait_in_car()


def _apart(one: Pose, other: Pose) -> float:
    return math.hypot(one.x - other.x, one.y - other.y)


def build(config: Config, name: str, parts: Sequence[str] = ()) -> RobotPlant:
    """Build a robot that stands at its charger. Raises SettingsError."""
    fleet = read_site(config)
    site = fleet.of(name)
    start = fleet.graph.called(site.charger)
    assert start is not None
    cars: dict[str, list[Pose]] = {}
    for vertex in fleet.graph.vertices:
        if vertex.lift:
            cars.setdefault(vertex.lift, []).append(site.on_robots_map(vertex.pose()))
    missions = None
    if isinstance(config.section, FleetFiles) and config.section.control == "traffic_light":
        turn = list(config.devices).index(name)
        missions = partial(_mission, site, Ways(fleet.graph), itertools.count(turn))
    chargers = [site.on_robots_map(v.pose()) for v in fleet.graph.vertices if v.charger]
    return RobotPlant(name, site.on_robots_map(start.pose()), chargers, cars, parts, missions)


def _mission(site: RobotSite, ways: Ways, turn: Iterator[int], at: Pose) -> Sequence[Pose]:
    """Return the places on the way to the next named waypoint of the robot's floor."""
    here = ways.nearest(site.on_rmfs_map(at))
    goals = ways.goals(at.map)
    way = ways.shortest(here, goals[next(turn) % len(goals)], set())
    legs = pairwise(ways.graph.vertices[number].pose() for number in way)
    ahead = (replace(b, yaw=math.atan2(b.y - a.y, b.x - a.x)) for a, b in legs)
    return [site.on_robots_map(place) for place in ahead]
