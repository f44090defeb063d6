"""The daemon's calls of `rmf_adapter`. The tests use a stand-in, and RMF's own adapter where ROS is
installed (`make test-ros`)."""

import itertools
import shutil
import subprocess
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import pytest

from bridges.kinds.fleet.report import RobotReport
from bridges.kinds.fleet.signals import Act, LightAnswer, Localize, Navigate, Order, Pose, Stop
from bridges.kinds.shared.decision import Fault
from bridges.runtime.fleet import robot as rmf_robot
from bridges.runtime.fleet.adapter import NOT_PASSED, FleetAdapter, installed
from bridges.settings.fleet_site import FleetSite, read_site
from bridges.settings.load import load
from bridges.transports.transport import TransportError
from hal_fakes.rmf.adapter import RobotHandle, StandIn
from hal_fakes.rmf.patrol import Execution
from tests.waiting import wait_until

CONFIG = Path(__file__).parents[3] / "config" / "robots_http.yaml"
SITE: FleetSite = read_site(load(CONFIG))
FIT: dict[str, Any] = {"battery": 0.8, "fit": True}


def place(waypoint: str) -> Pose:
    """Return the place of a waypoint, as a pose on the robots' map."""
    vertex = SITE.graph.called(waypoint)
    assert vertex
    return SITE.of("AMR01").on_robots_map(vertex.pose())


@dataclass
class Joined:
    """The daemon's adapter, connected to RMF or to the stand-in. `orders` lists the orders that RMF has
    given."""

    adapter: FleetAdapter
    orders: list[Order] = field(default_factory=list)
    threads: set[threading.Thread] = field(default_factory=set)

    def put(self, robot: str, order: Order) -> None:
        self.orders.append(order)
        self.threads.add(threading.current_thread())

    def says(self, at: str = "wait_1", robot: str = "AMR01", **levels: Any) -> None:
        """Give RMF a robot's position and other fields of the robot's report, such as the battery."""
        self.adapter.update(robot, RobotReport(at=place(at), **{**FIT, **levels}))


def joined(rmf: Any) -> Joined:
    made = Joined.__new__(Joined)
    numbers = itertools.count(7)
    adapter = FleetAdapter(rmf, SITE, None, lambda robot, order: made.put(robot, order), numbers)
    made.__init__(adapter)  # type: ignore[misc]
    wait_until(adapter.connect, "RMF's schedule node")
    return made


@pytest.fixture
def schedule() -> Iterator[None]:
    """Run RMF's own schedule node."""
    ros2 = shutil.which("ros2")
    assert ros2, "source ROS's setup file first"
    node = subprocess.Popen([ros2, "run", "rmf_traffic_ros2", "rmf_traffic_schedule"])
    yield
    node.terminate()
    node.wait()


class AdapterContract:
    def test_a_robot_near_the_graph_is_taken_and_its_levels_are_accepted(self, rmf: Joined) -> None:
        rmf.says()
        assert rmf.adapter.failed == {"AMR01": ""}
        for battery in (0.0, 0.5, 1.0):
            rmf.says(battery=battery)
        rmf.says(fit=False, faults=(Fault("ROBOT_FAULT", "hot"),))
        rmf.says()
        assert rmf.adapter.failed == {"AMR01": ""}

    def test_a_robot_off_the_graph_is_not_taken_and_the_reason_is_told(self, rmf: Joined) -> None:
        far = Pose("L1", 500.0, 500.0)
        rmf.adapter.update("AMR01", RobotReport(at=far, battery=0.8, fit=True))
        assert rmf.adapter.failed == {"AMR01": rmf_robot.NOT_TAKEN}

    def test_nothing_is_told_of_a_robot_that_was_not_read(self, rmf: Joined) -> None:
        rmf.adapter.update("AMR01", RobotReport())
        assert rmf.adapter.failed == {"AMR01": ""}


class TestOnTheStandIn(AdapterContract):
    @pytest.fixture
    def stand_in(self) -> StandIn:
        return StandIn(patrols=False)

    @pytest.fixture
    def rmf(self, stand_in: StandIn) -> Iterator[Joined]:
        made = joined(stand_in)
        yield made
        made.adapter.close()

    def handle(self, stand_in: StandIn, robot: str = "AMR01") -> RobotHandle:
        assert stand_in.fleet
        return stand_in.fleet.handles[robot]

    def sent(self, stand_in: StandIn, rmf: Joined, to: str = "pharmacy") -> Navigate:
        """Let RMF send the robot to a waypoint. Return RMF's order."""
        assert stand_in.fleet
        rmf.says()
        assert stand_in.fleet.patrols.send(self.handle(stand_in).robot, to)
        wait_until(lambda: rmf.orders, "an order")
        order = rmf.orders[-1]
        assert isinstance(order, Navigate)
        return order

    def test_without_a_schedule_node_it_tries_again(self) -> None:
        rmf = StandIn(schedule=False)
        adapter = FleetAdapter(rmf, SITE, None, lambda robot, order: None, itertools.count())
        assert not adapter.connect()
        adapter.update("AMR01", RobotReport(at=place("wait_1"), **FIT))
        adapter.close()
        rmf.schedule = True
        assert adapter.connect()
        adapter.close()

    def test_a_robot_that_config_yaml_lacks_is_told_with_the_reason(
        self, stand_in: StandIn, rmf: Joined
    ) -> None:
        rmf.says(robot="AMR99")
        reason = rmf.adapter.failed["AMR99"]
        assert reason == f"{NOT_PASSED}: add_robot(): incompatible function arguments."

    def test_files_at_which_rmf_throws_are_told_by_name(self, tmp_path: Path) -> None:
        config = tmp_path / "config.yaml"
        text = Path(SITE.config_file).read_text()
        config.write_text(text.replace("{charger: wait_1}", "{charger: {waypoint: wait_1}}"))
        site = msgspec.structs.replace(SITE, config_file=str(config))
        rmf = StandIn(patrols=False)
        adapter = FleetAdapter(rmf, site, None, lambda robot, order: None, itertools.count())
        with pytest.raises(TransportError, match=r"refuses .*config.yaml or .*: bad conversion"):
            adapter.connect()

    def test_goals_come_on_a_foreign_thread_in_the_robots_coordinates(
        self, stand_in: StandIn, rmf: Joined
    ) -> None:
        order = self.sent(stand_in, rmf)
        assert order.id == 7
        assert (order.goal.at.map, order.goal.name) == ("L1", "")
        corridor = SITE.of("AMR01").on_robots_map(Pose("L1", 7.0, 2.0))
        assert (order.goal.at.x, order.goal.at.y) == pytest.approx((corridor.x, corridor.y))
        assert threading.current_thread() not in rmf.threads

    def test_the_end_of_a_command_is_told_once_after_its_place(
        self, stand_in: StandIn, rmf: Joined
    ) -> None:
        order = self.sent(stand_in, rmf)
        robot = self.handle(stand_in).robot
        execution = robot.execution
        assert execution
        rmf.says(activity=order.id)
        assert robot.activity is execution
        updates = robot.updates
        rmf.says(activity=0, finished=order.id)
        assert execution.is_finished
        assert robot.updates == updates + 1
        assert robot.activity is None
        wait_until(lambda: len(rmf.orders) == 2, "the next order")
        rmf.says(finished=order.id)
        assert not robot.execution.is_finished

    def test_a_place_that_was_not_read_is_not_sent(self, stand_in: StandIn, rmf: Joined) -> None:
        rmf.says()
        rmf.adapter.update("AMR01", RobotReport(at=None, fit=False))
        robot = self.handle(stand_in).robot
        assert (robot.updates, robot.commissioned) == (0, False)

    @pytest.mark.parametrize("commissioned", [True, False])
    def test_a_robot_that_is_fit_again_is_commissioned_as_before(
        self, stand_in: StandIn, rmf: Joined, commissioned: bool
    ) -> None:
        rmf.says()
        robot = self.handle(stand_in).robot
        robot.commissioned = commissioned  # by a person, in RMF
        rmf.says(fit=False)
        assert not robot.commissioned
        rmf.says()
        assert robot.commissioned == commissioned

    def test_a_stop_of_the_present_activity_is_an_order_and_of_another_none(
        self, stand_in: StandIn, rmf: Joined
    ) -> None:
        order = self.sent(stand_in, rmf)
        robot = self.handle(stand_in).robot
        robot.callbacks.stop(Execution())
        assert rmf.orders == [order]
        robot.callbacks.stop(robot.execution)
        assert rmf.orders == [order, Stop(8, of=order.id)]

    def test_what_rmf_gives_up_is_stopped_after_a_moment(
        self, stand_in: StandIn, rmf: Joined, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        order = self.sent(stand_in, rmf)
        self.handle(stand_in).robot.execution.given_up = True  # type: ignore[union-attr]
        rmf.says(activity=order.id)
        assert rmf.orders == [order]
        monkeypatch.setattr(rmf_robot, "GIVEN_UP_S", 0.0)
        rmf.says(activity=order.id)
        rmf.says(activity=order.id)
        assert rmf.orders == [order, Stop(8, of=order.id)]

    def test_actions_and_floors_are_orders(self, stand_in: StandIn, rmf: Joined) -> None:
        rmf.says()
        callbacks = self.handle(stand_in).robot.callbacks
        callbacks.action_executor("clean", {"zone": "lobby"}, Execution())
        assert rmf.orders == [Act(7, "clean", '{"zone": "lobby"}')]
        robot = self.handle(stand_in).robot
        stand_in.fleet.patrols.send(robot, "ward")  # type: ignore[union-attr]
        for number in range(1, 5):
            wait_until(lambda: len(rmf.orders) > number, "the next order")  # noqa: B023
            last = rmf.orders[-1]
            assert not isinstance(last, LightAnswer)
            rmf.says(finished=last.id)
        floors = [order.goal.at.map for order in rmf.orders if isinstance(order, Localize)]
        assert floors == ["L2"]

    def test_an_issue_lasts_as_long_as_its_fault(self, stand_in: StandIn, rmf: Joined) -> None:
        rmf.says()
        rmf.says(faults=(Fault("ROBOT_FAULT", "wheel motor too hot"),), fit=False)
        issues = self.handle(stand_in).issues
        assert issues == [("ROBOT_FAULT", {"detail": "wheel motor too hot"})]
        rmf.says()
        assert issues == []

    def test_an_issue_has_the_text_of_its_fault_and_two_faults_are_two_issues(
        self, stand_in: StandIn, rmf: Joined
    ) -> None:
        def told(*details: str) -> list[str]:
            rmf.says(faults=tuple(Fault("CHARGER_REPORTS_ERROR", text) for text in details))
            return sorted(issue["detail"] for _, issue in self.handle(stand_in).issues)

        rmf.says()
        assert told("charger_a: hot") == ["charger_a: hot"]
        assert told("charger_a: no power") == ["charger_a: no power"]
        both = ["charger_a: no power", "charger_b: hot"]
        assert told(*both) == both
        assert told("charger_b: hot") == ["charger_b: hot"]

    def test_an_issue_lasts_while_its_fault_only_counts(
        self, stand_in: StandIn, rmf: Joined
    ) -> None:
        rmf.says()
        for age_s in (4, 5, 6):
            text = f"its reported position is {age_s} s old"
            rmf.says(faults=(Fault("ROBOT_NOT_READ", text),))
        first = {"detail": "its reported position is 4 s old"}
        assert self.handle(stand_in).issues == [("ROBOT_NOT_READ", first)]

    def test_the_fleets_state_goes_out_while_rmf_is_a_stand_in(
        self, stand_in: StandIn, rmf: Joined
    ) -> None:
        heard: list[Any] = []
        stand_in.speak = heard.append
        rmf.says()
        wait_until(lambda: heard and heard[-1].robots, "a fleet state")
        assert [robot.name for robot in heard[-1].robots] == ["AMR01"]


@pytest.mark.ros
class TestOnRmf(AdapterContract):
    @pytest.fixture
    def rmf(self, schedule: None) -> Iterator[Joined]:
        made = joined(installed())
        yield made
        made.adapter.close()


def test_a_machine_without_rmf_names_the_package() -> None:
    try:
        import rmf_adapter  # noqa: F401
    except ImportError:
        with pytest.raises(TransportError, match="ros-jazzy-rmf-fleet-adapter-python"):
            installed()
