"""An object in place of the module `rmf_adapter`. The object has the names that the daemon uses
(hal_fakes/rmf/__init__.py)."""

import threading
import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, Final

from bridges.kinds.fleet.places import RobotSite
from bridges.kinds.fleet.signals import Pose
from bridges.kinds.shared.similarity import Similarity
from bridges.messages.definitions import FleetState
from bridges.settings.fleet_config import Charger, RobotConfig, load_fleet
from bridges.settings.nav_graph import load_graph
from bridges.yaml.problems import SettingsError
from hal_fakes.rmf.lights import (
    Lights,
    MovingInstruction,
    TrafficLight,
    WaitingInstruction,
    Waypoint,
)
from hal_fakes.rmf.patrol import PatrolRobot, Patrols

STEP_S: Final = 0.2
OFF_GRAPH_M: Final = 1.0


class RobotState(SimpleNamespace):
    """A stand-in for `easy_full_control.RobotState`."""

    def __init__(self, map: str, position: list[float], battery_soc: float) -> None:
        if len(position) != 3:
            raise TypeError("position: a vector of three numbers")
        self.map, self.position, self.battery_soc = map, position, battery_soc

    def pose(self) -> Pose:
        """Return the place on the robot's map."""
        return Pose(self.map, *self.position)


class RobotCallbacks(SimpleNamespace):
    """A stand-in for `easy_full_control.RobotCallbacks`."""

    localize: Callable[[Any, Any], None] | None = None

    def __init__(self, navigate: Any, stop: Any, action_executor: Any) -> None:
        self.navigate, self.stop, self.action_executor = navigate, stop, action_executor


class FleetConfiguration:
    """A stand-in for `easy_full_control.FleetConfiguration`."""

    def __init__(self, config: str, graph: str) -> None:
        self.file = load_fleet(config)
        self.graph = load_graph(graph)
        self.transforms: dict[str, Similarity] = {}
        self.vehicle_traits = self.file.fleet.limits

    @staticmethod
    def from_config_files(
        config_file: str, nav_graph_path: str, server_uri: str | None = None
    ) -> "FleetConfiguration | None":
        """Return the configuration. Return None if RMF cannot read the configuration file. Raise
        RuntimeError if RMF cannot read the graph, or if a charger is no text."""
        try:
            found = FleetConfiguration(config_file, nav_graph_path)
        except SettingsError as error:
            if any(problem.file == nav_graph_path for problem in error.problems):
                raise RuntimeError(str(error.problems[0])) from None
            return None
        robots = filter(None, found.file.fleet.robots.values())
        if any(isinstance(robot.charger, Charger) for robot in robots):
            raise RuntimeError("bad conversion")
        return found

    def add_robot_coordinates_transformation(self, level: str, transform: Similarity) -> None:
        """Add a level's transform."""
        self.transforms[level] = transform

    def get_known_robot_configuration(self, robot: str) -> SimpleNamespace | None:
        """Return a robot's charger. Return None for a robot that is not below `rmf_fleet`."""
        robots = self.file.fleet.robots
        if robot not in robots:
            return None
        charger = (robots[robot] or RobotConfig()).charger
        return SimpleNamespace(compatible_chargers=[charger] if charger else [])


def transformation(rotation: float, scale: float, translation: list[float]) -> Similarity:
    """Make the stand-in for a `Transformation`."""
    from cmath import rect

    return Similarity(rect(scale, rotation), complex(*translation), 0.0)


class RobotHandle:
    """A stand-in for `EasyRobotUpdateHandle`. It is also the `RobotUpdateHandle` that `more()`
    returns."""

    def __init__(self, robot: PatrolRobot, lock: threading.RLock) -> None:
        self.robot = robot
        self.issues: list[tuple[str, dict[str, str]]] = []
        self._lock = lock

    def update(self, state: RobotState, activity: Any) -> None:
        """Take the robot's state."""
        with self._lock:
            self.robot.update(state.pose(), state.battery_soc, activity)

    def more(self) -> "RobotHandle":
        """Return the `RobotUpdateHandle`, which is this object as well."""
        return self

    def commission(self) -> SimpleNamespace:
        """Return a copy of the commission."""
        return SimpleNamespace(accept_dispatched_tasks=self.robot.commissioned)

    def set_commission(self, commission: Any) -> None:
        """Set the commission."""
        with self._lock:
            self.robot.commissioned = commission.accept_dispatched_tasks

    def reassign_dispatched_tasks(self) -> None:
        """Do nothing: there are no tasks."""

    def create_issue(self, tier: object, category: str, detail: dict[str, str]) -> Any:
        """Note an issue until its ticket is resolved."""
        issue = (category, detail)
        self.issues.append(issue)
        return SimpleNamespace(resolve=lambda message: self.issues.remove(issue))


class EasyFleet:
    """A stand-in for `EasyFullControl`."""

    def __init__(self, patrols: Patrols, lock: threading.RLock) -> None:
        self.handles: dict[str, RobotHandle] = {}
        self.patrols = patrols
        self._lock = lock

    def add_robot(
        self, name: str, state: RobotState, configuration: Any, callbacks: RobotCallbacks
    ) -> RobotHandle | None:
        """Add a robot. Return None for a robot that RMF refuses. Raise TypeError without a
        configuration, as pybind11 does."""
        if configuration is None:
            raise TypeError("add_robot(): incompatible function arguments.\nInvoked with: ...")
        if name in self.handles or not configuration.compatible_chargers:
            return None
        site = RobotSite(
            self.patrols.graph, self.patrols.transforms, configuration.compatible_chargers[0]
        )
        on_map = site.on_rmfs_map(state.pose())
        charger = self.patrols.graph.called(site.charger)
        if charger is None or self.patrols.graph.off_m(on_map) > OFF_GRAPH_M:
            return None
        with self._lock:
            robot = PatrolRobot(name, site, callbacks, on_map, state.battery_soc)
            self.patrols.robots.append(robot)
            self.handles[name] = RobotHandle(robot, self._lock)
        return self.handles[name]


class StandInAdapter:
    """A stand-in for `Adapter`, with a thread that runs the patrols."""

    def __init__(self, owner: "StandIn") -> None:
        self.fleet: EasyFleet | None = None
        self._owner = owner
        self._new: list[Callable[[], None]] = []
        self._lock = threading.RLock()
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run, name="rmf stand-in", daemon=True)

    def add_easy_fleet(self, configuration: FleetConfiguration) -> EasyFleet:
        """Add the fleet."""
        name, graph = configuration.file.fleet.name, configuration.graph
        patrols = Patrols(name, graph, configuration.transforms, self._owner.patrols)
        self.fleet = self._owner.fleet = EasyFleet(patrols, self._lock)
        return self.fleet

    def add_easy_traffic_light(
        self,
        handle_callback: Callable[[TrafficLight], None],
        fleet_name: str,
        robot_name: str,
        traits: object,
        pause_callback: Callable[[], None],
        resume_callback: Callable[[], None],
    ) -> None:
        """Add a traffic light. `handle_callback` gets the light later, on the thread that stands for
        RMF."""
        lights = self._owner.lights
        handle = lights.handles[robot_name] = TrafficLight(robot_name, pause_callback, lights)
        self._new.append(lambda: handle_callback(handle))

    def start(self) -> None:
        """Start the thread that calls the callbacks."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._ends.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ends.wait(STEP_S):
            for light in [*self._owner.lights.handles.values()]:
                light.step()
            while self._new:
                self._new.pop(0)()
            if self.fleet is None:
                continue
            with self._lock:
                due = self.fleet.patrols.due(time.monotonic())
                state = self.fleet.patrols.state(time.time())
            for call in due:  # without the lock: a callback may call update
                call()
            if state is not None:
                self._owner.speak(state)


class StandIn:
    """A stand-in for the module `rmf_adapter`. `speak` publishes the fleet's state, as RMF's adapter
    does by itself. `schedule` tells whether there is a schedule node. `patrols` tells whether the
    robots patrol. If not, they wait for `EasyFleet.patrols.send`."""

    def __init__(self, schedule: bool = True, patrols: bool = True) -> None:
        self.schedule, self.patrols = schedule, patrols
        self.fleet: EasyFleet | None = None
        self.lights = Lights()
        self.Waypoint = Waypoint
        self.easy_traffic_light = SimpleNamespace(
            MovingInstruction=MovingInstruction, WaitingInstruction=WaitingInstruction
        )
        self.speak: Callable[[FleetState], object] = lambda state: None
        self.Transformation = transformation
        self.Adapter = SimpleNamespace(make=self._make)
        self.robot_update_handle = SimpleNamespace(Tier=SimpleNamespace(Error="error"))
        self.easy_full_control = SimpleNamespace(
            FleetConfiguration=FleetConfiguration,
            RobotState=RobotState,
            RobotCallbacks=RobotCallbacks,
        )

    def init_rclcpp(self) -> None:
        """Do nothing."""

    def _make(self, name: str, wait_time: object = None) -> StandInAdapter | None:
        return StandInAdapter(self) if self.schedule else None
