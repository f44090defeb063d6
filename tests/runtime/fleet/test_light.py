"""Robots that obey RMF's traffic light. One part tests the daemon's calls of RMF's
`easy_traffic_light`.

In the other part the paths of two robots cross in virtual time. Each robot has the daemon's decision
code (core), a simulated body (plant) and a traffic light.
"""

import itertools
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import pytest
from msgspec.structs import replace

from bridges.kinds.fleet import core
from bridges.kinds.fleet.light import LightQuestion
from bridges.kinds.fleet.memory import RobotLimits
from bridges.kinds.fleet.report import RobotReport
from bridges.kinds.fleet.signals import LightAnswer, Order, Pose, RobotSample
from bridges.kinds.shared.decision import Sampled
from bridges.runtime.fleet import light as rmf_light
from bridges.runtime.fleet.adapter import FleetAdapter, installed
from bridges.settings.fleet_site import read_site
from bridges.settings.load import load
from hal_fakes.plants.robot import RobotOrder, RobotPlant
from hal_fakes.rmf.adapter import StandIn
from hal_fakes.rmf.lights import Lights, TrafficLight, Waypoint
from tests.runtime.fleet.test_adapter import schedule
from tests.waiting import wait_until

__all__ = ["schedule"]
SITE = read_site(load(Path(__file__).parents[3] / "config" / "robots_traffic_light.yaml"))
WAY = tuple(Pose("L1", x, 5.0) for x in (0.0, 3.0, 6.0))


@dataclass
class Lit:
    """The daemon's adapter, connected to RMF's traffic light. `answers` lists RMF's answers about the
    robot."""

    adapter: FleetAdapter
    answers: list[Order] = field(default_factory=list)

    def asks(self, checkpoint: int = 0, stands: Any = "at", number: int = 1, **more: Any) -> None:
        """Report a robot's progress to RMF's traffic light. The light answers whether the robot may go
        on."""
        here = more.pop("here", WAY[0])
        asked = LightQuestion(more.pop("path", WAY), number, checkpoint, stands, here, held=True)
        self.adapter.update("AMR01", RobotReport(at=here, battery=0.8, light=asked))

    @property
    def handle(self) -> Any:
        return self.adapter._robots["AMR01"].handle


def lit(rmf: Any) -> Lit:
    answers: list[Order] = []
    adapter = FleetAdapter(
        rmf, SITE, None, lambda robot, order: answers.append(order), itertools.count(), light=True
    )
    wait_until(adapter.connect, "RMF's schedule node")
    made = Lit(adapter, answers)
    made.asks(path=())
    wait_until(lambda: made.handle, "a traffic light")
    return made


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rmf_light, "ASKS_S", 0.0)


class LightContract:
    def test_a_robot_waits_for_its_first_resume_and_then_for_its_end(self, rmf: Lit) -> None:
        rmf.asks(path=())
        rmf.asks()

        def resumed() -> bool:
            rmf.asks()
            return LightAnswer(1, 0, "resume") in rmf.answers

        wait_until(resumed, "RMF lets it go")
        assert rmf.answers == [LightAnswer(1, 0, "stay"), LightAnswer(1, 0, "resume")]
        rmf.asks(0, "moving", here=Pose("L1", 0.5, 5.0))
        assert rmf.answers[-1] in (LightAnswer(1, 0, "wait"), LightAnswer(1, 0, "continue"))
        assert rmf.adapter.failed == {"AMR01": ""}

    def test_a_robot_that_goes_before_it_may_gets_an_error(
        self, rmf: Lit, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(rmf_light, "TAKES_S", 0.0)
        rmf.asks(path=())
        rmf.asks()

        def planned() -> bool:
            rmf.asks(0, "moving", here=Pose("L1", 0.5, 5.0))
            return LightAnswer(1, 0, "error") in rmf.answers

        wait_until(planned, "RMF has a plan, which the robot does not follow")


class TestOnTheStandIn(LightContract):
    @pytest.fixture
    def stand_in(self) -> StandIn:
        return StandIn()

    @pytest.fixture
    def rmf(self, stand_in: StandIn) -> Iterator[Lit]:
        made = lit(stand_in)
        yield made
        made.adapter.close()

    def test_a_negotiation_pauses_the_robot_at_once(self, stand_in: StandIn, rmf: Lit) -> None:
        rmf.asks(path=())
        rmf.asks()
        light = stand_in.lights.handles["AMR01"]
        wait_until(lambda: light.planned, "a plan")
        rmf.asks()
        light.negotiates()
        assert rmf.answers[-1] == LightAnswer(1, 0, "pause")
        rmf.asks()
        assert rmf.answers[-1] == LightAnswer(1, 0, "stay")
        light.agrees()
        rmf.asks()
        assert rmf.answers[-1] == LightAnswer(1, 0, "resume")

    def test_an_unchanged_answer_is_told_once(self, stand_in: StandIn, rmf: Lit) -> None:
        rmf.asks()
        light = stand_in.lights.handles["AMR01"]
        wait_until(lambda: light.planned, "a plan")
        light.negotiates()
        for _ in range(5):
            rmf.asks()
        assert rmf.answers == [LightAnswer(1, 0, "stay")]

    def test_a_robot_without_a_path_is_at_its_place_and_off_the_schedule(
        self, stand_in: StandIn, rmf: Lit
    ) -> None:
        rmf.asks()
        rmf.asks(path=(), here=Pose("L1", 1.0, 2.0, 0.5))
        light = stand_in.lights.handles["AMR01"]
        assert (light.path, light.idle) == ((), ("L1", [1.0, 2.0, 0.5]))

    def test_rmf_is_asked_seldom_while_nothing_changes(
        self, stand_in: StandIn, rmf: Lit, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        rmf.asks()
        wait_until(lambda: stand_in.lights.handles["AMR01"].planned, "a plan")
        monkeypatch.setattr(rmf_light, "ASKS_S", 3600.0)
        rmf.asks()
        rmf.asks()
        assert len(rmf.answers) == 1
        rmf.asks(0, "after")
        assert len(rmf.answers) == 2

    def test_what_rmf_refuses_is_told(self, rmf: Lit) -> None:
        rmf.asks(path=WAY[:1])
        assert "less than two checkpoints" in rmf.adapter.failed["AMR01"]

    def test_a_robot_without_a_light_for_long_is_told(
        self, stand_in: StandIn, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(StandIn, "_make", lambda *_, **__: Silent())
        adapter = FleetAdapter(stand_in, SITE, None, lambda *_: None, itertools.count(), light=True)
        assert adapter.connect()
        adapter.update("AMR01", RobotReport())
        assert adapter.failed == {"AMR01": ""}
        monkeypatch.setattr(rmf_light, "AGAIN_S", 0.0)
        adapter.update("AMR01", RobotReport())
        assert adapter.failed == {"AMR01": rmf_light.NO_LIGHT}


class Silent:
    """An RMF whose schedule never answers."""

    def add_easy_traffic_light(self, *_: object) -> None:
        """Ignore the request for a traffic light."""

    def start(self) -> None:
        """Do nothing."""

    def stop(self) -> None:
        """Do nothing."""


@pytest.mark.ros
class TestOnRmf(LightContract):
    @pytest.fixture
    def rmf(self, schedule: None) -> Iterator[Lit]:
        blockade = subprocess.Popen(["ros2", "run", "rmf_traffic_ros2", "rmf_traffic_blockade"])
        made = lit(installed())
        yield made
        made.adapter.close()
        blockade.terminate()
        blockade.wait()


# ---- two robots whose paths cross


class Crossing:
    """One robot in virtual time: its simulated body (plant), its decision code (core) and its traffic
    light."""

    def __init__(self, name: str, lights: Lights, places: list[Pose]) -> None:
        self.light = lights.handles[name] = TrafficLight(name, lambda: None, lights)
        ways = iter([places[1:]])
        self.plant = RobotPlant(name, places[0], missions=lambda at: next(ways, ()))
        self.limits = RobotLimits(light=True)
        self.memory = core.initial(self.limits, 0.0)
        self.goal, self.path, self.sent = places[-1], 0, (0, 0)
        self.said: list[str] = []

    def scan(self, now: float) -> None:
        self.plant.advance(now)
        seen: Any = self.plant.reading()
        sample = RobotSample(seen.at, 0.8, moving=seen.moving, path=seen.path, paused=seen.paused)
        decision = core.decide(self.memory, Sampled(sample), now, self.limits)
        self.memory = decision.memory
        command = decision.outputs.command
        if command and (command.id, command.attempt) != self.sent:
            self.sent = command.id, command.attempt
            order = RobotOrder(str(command.id), command.doing)
            self.plant.drive(msgspec.json.encode(order).decode(), True, now)
        asks = decision.report.light
        if asks is not None:
            self.ask(asks, now)

    def ask(self, asks: LightQuestion, now: float) -> None:
        at = [asks.here.x, asks.here.y, 0.0]
        if not asks.path:
            self.light.update_idle_location(asks.here.map, at)
        elif asks.number != self.path:
            self.path = asks.number
            self.light.follow_new_path(
                [Waypoint("L1", [p.x, p.y, 0.0], 0, True) for p in asks.path]
            )
        else:
            if asks.stands == "at":
                found: Any = self.light.waiting_at(asks.checkpoint)
            elif asks.stands == "moving":
                found = self.light.moving_from(asks.checkpoint, at)
            else:
                found = self.light.waiting_after(asks.checkpoint, at)
            says = rmf_light.ANSWERS[found.name]
            self.said.append(says)
            answer = LightAnswer(asks.number, asks.checkpoint, says)
            self.memory = core.decide(self.memory, answer, now, self.limits).memory


@pytest.mark.parametrize("seed", range(6))
def test_two_robots_never_meet_at_the_crossing_and_both_arrive(seed: int) -> None:
    lights = Lights()
    late = 1.0 + 0.37 * seed
    spots = (
        [Pose("L1", x, 0.0) for x in (0.0, 3.0, 6.0, 9.0)],
        [Pose("L1", 4.5, y) for y in (-late * 2, -2.0, 2.0, 6.0)],
    )
    robots = [Crossing(f"R{i}", lights, places) for i, places in enumerate(spots)]
    nearest = 99.0
    for step in range(1, 1200):
        now = step / 10
        for robot in robots:
            robot.scan(now)
            robot.light.step()
        (a, b) = (robot.plant.at for robot in robots)
        nearest = min(nearest, abs(complex(a.x - b.x, a.y - b.y)))
    assert [replace(r.plant.at, yaw=0.0) for r in robots] == [r.goal for r in robots]
    assert not any("error" in robot.said for robot in robots)
    assert nearest > 0.8, f"{nearest:.2f} m apart"
