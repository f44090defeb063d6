"""RMF's own fleet adapter, `rmf_adapter`. Only this module imports `rmf_adapter`.

Debian's package is ros-jazzy-rmf-fleet-adapter-python. RMF's adapter plans the tasks and the traffic,
and negotiates with other fleets. It calls our callbacks on its own threads, and `robot.py` and
`light.py` turn each call into an order.

The source for its interface: open-rmf/rmf_ros2, branch jazzy, rmf_fleet_adapter_python/src/adapter.cpp,
and EasyFullControl.cpp of rmf_fleet_adapter.

`Adapter.make` waits for RMF's schedule node. The whole process waits too, because the binding does not
release Python's global lock. Therefore one attempt waits at most MAKE_S.
"""

import datetime
from collections.abc import Iterator
from types import ModuleType
from typing import Any, Final

from bridges.kinds.fleet.places import EVERY_LEVEL
from bridges.kinds.fleet.report import RobotReport
from bridges.runtime.drop_in import JOINS_RMF_S
from bridges.runtime.fleet.light import RmfLight
from bridges.runtime.fleet.robot import Put, RmfRobot
from bridges.settings.fleet_site import FleetSite
from bridges.transports.transport import TransportError

NOT_PASSED: Final = "RMF's adapter is of another version, or config.yaml does not have the robot"


def installed() -> ModuleType:
    """Import RMF's adapter. Raises TransportError, whose text names the package to install."""
    try:
        import rmf_adapter
        import rmf_adapter.easy_full_control
        import rmf_adapter.easy_traffic_light
    except ImportError as error:
        how = "sudo apt install ros-jazzy-rmf-fleet-adapter-python, and rmf: {ros_setup: …/setup.bash}"
        raise TransportError(f"kind: fleet needs RMF's fleet adapter ({error}): {how}") from None
    found: ModuleType = rmf_adapter
    return found


class FleetAdapter:
    """RMF's adapter for one fleet, with `EasyFullControl` or with an `EasyTrafficLight` for each robot.

    `orders(robot, order)` is a callback for RMF's orders, and for its answers to our questions.
    `failed` maps each robot to the reason why RMF did not accept it, or to "".

    For each robot, only one thread calls `update`.
    """

    def __init__(
        self,
        rmf: Any,
        site: FleetSite,
        uri: str | None,
        orders: Put,
        numbers: Iterator[int],
        *,
        light: bool = False,
    ) -> None:
        self.failed: dict[str, str] = {}
        self.name = f"{site.fleet.fleet.name}_fleet_adapter"
        self._rmf, self._site, self._uri = rmf, site, uri
        self._orders, self._numbers, self._light = orders, numbers, light
        self._fleet: Any = None
        self._configuration: Any = None
        self._robots: dict[str, RmfRobot | RmfLight] = {}
        rmf.init_rclcpp()

    def connect(self) -> bool:
        """Join RMF. Return False if RMF has no schedule node. The whole process waits for up to
        JOINS_RMF_S.

        Raises TransportError if RMF's adapter refuses the fleet's configuration or navigation graph.
        """
        easy = self._rmf.easy_full_control
        files = self._site.config_file, self._site.graph_file
        try:
            configuration = easy.FleetConfiguration.from_config_files(*files, self._uri)
        except RuntimeError as error:
            raise TransportError(f"RMF's adapter refuses {' or '.join(files)}: {error}") from None
        if configuration is None:
            raise TransportError(f"RMF's adapter refuses {files[0]}; its own log has the reason")
        for level in self._site.graph.levels():
            found = self._site.transforms.get(level, self._site.transforms.get(EVERY_LEVEL))
            if found and self._site.estimated:
                shift = [found.shift.real, found.shift.imag]
                transform = self._rmf.Transformation(found.rotation, found.scale, shift)
                configuration.add_robot_coordinates_transformation(level, transform)
        wait = datetime.timedelta(seconds=JOINS_RMF_S)
        self._adapter = self._rmf.Adapter.make(self.name, wait_time=wait)
        if self._adapter is None:
            return False
        self._configuration = configuration
        light, adapter = self._light, self._adapter
        fleet = adapter if light else adapter.add_easy_fleet(configuration)
        adapter.start()
        self._fleet = fleet
        return True

    def update(self, name: str, report: RobotReport) -> None:
        """Pass a robot's report to RMF: first the robot's position, and then whether its command has
        ended."""
        if self._fleet is None:
            return
        if name not in self._robots:
            self._robots[name] = self._robot(name)
        robot = self._robots[name]
        try:
            if robot.handle is None:
                self.failed[name] = robot.add(self._fleet, self._configuration, report)
            else:
                robot.update(report)
        except RuntimeError as error:  # an exception of C++
            self.failed[name] = str(error)
        except TypeError as error:  # pybind11 does not take a value; its text has many lines
            self.failed[name] = f"{NOT_PASSED}: {str(error).partition(chr(10))[0]}"

    def _robot(self, name: str) -> RmfRobot | RmfLight:
        if self._light:
            return RmfLight(name, self._rmf, self._orders, self._site.fleet.fleet.name)
        return RmfRobot(name, self._rmf, self._orders, self._numbers)

    def close(self) -> None:
        """Leave RMF's graph."""
        if self._fleet is not None:
            self._fleet = None
            self._adapter.stop()
