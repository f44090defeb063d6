"""Robots that RMF can only pause, on both drivers: their path, and pause and resume."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import msgspec
import pytest
from msgspec.structs import replace

from bridges.kinds.fleet.signals import Pose, RobotCommand, RobotOutputs, RobotSample
from drivers import Driver, DriverError
from drivers.fleet.http import HttpRobot, HttpRobotSettings
from drivers.fleet.vda5050 import VdaRobot, VdaRobotSettings
from drivers.fleet.vda_state import places_left
from drivers.hal import http
from drivers.hal.mqtt import MqttBus, MqttSettings
from hal_fakes.http import HttpServer
from hal_fakes.http_fleet import PARTS, FakeFleetRobot
from hal_fakes.plants import robot as robot_plant
from hal_fakes.plants.robot import RobotPlant
from hal_fakes.realtime import RealTime
from hal_fakes.vda5050 import FakeVdaRobot
from hal_fakes.vda_site import VdaSite
from tests.waiting import wait_until

WAY = (Pose("L1", 40.0, 2.0), Pose("L1", 40.0, 9.0))
API: dict[str, Any] = {
    "state_path": "/robots/$robot",
    "fields": {
        "map": "floor",
        "x": "pose.x",
        "y": "pose.y",
        "yaw": "pose.heading",
        "battery": "battery",
        "moving": {"field": "state", "when": ["driving"]},
        "paused": {"field": "paused"},
        "path": {"list": "plan.points", "map": "floor"},
    },
    "units": {"length": "cm", "y_axis": "down"},
    "pause": {"path": "/robots/$robot/pause"},
    "resume": {"path": "/robots/$robot/resume"},
}
HTTP = msgspec.convert({"api": API, "maps": {"L1": "floor 1"}}, HttpRobotSettings)


@dataclass
class Bench:
    plant: RobotPlant
    driver: Driver[RobotSample, RobotOutputs]

    def until(self, condition: Callable[[RobotSample], object], what: str) -> RobotSample:
        """Read until a good sample meets the condition."""
        found: list[RobotSample] = []

        def seen() -> bool:
            try:
                found.append(self.driver.read())
            except DriverError:
                return False
            return bool(condition(found[-1]))

        wait_until(seen, what)
        return found[-1]

    def tells(self, number: int, doing: Any) -> None:
        self.driver.write(RobotOutputs(RobotCommand(number, doing)))


@contextmanager
def on_http(plant: RobotPlant, settings: HttpRobotSettings = HTTP) -> Iterator[Bench]:
    world = RealTime({"AMR01": plant})
    server = HttpServer([FakeFleetRobot("AMR01", world.plants["AMR01"], settings)], "/api", 1.0)
    bus = http.HttpBus(http.HttpSettings(api_base=str(server.replace["api_base"]), timeout_s=1.0))
    try:
        yield Bench(plant, HttpRobot("AMR01", settings, bus))
    finally:
        server.close()
        world.close()


@contextmanager
def on_vda(plant: RobotPlant, version: Any = "2.1", **more: Any) -> Iterator[Bench]:
    made = VdaRobotSettings(
        manufacturer="acme", known_as="0001", version=version, maps={"L1": "floor 1"}, **more
    )
    world = RealTime({"AMR01": plant})
    site = VdaSite(MqttSettings(host="x"), [FakeVdaRobot("AMR01", world.plants["AMR01"], made)])
    bus = MqttBus(msgspec.structs.replace(MqttSettings(host="x"), **site.replace))
    try:
        yield Bench(plant, VdaRobot("AMR01", made, bus))
    finally:
        bus.close()
        site.close()
        world.close()


def plant() -> RobotPlant:
    ways = iter([WAY])
    parts = tuple({*PARTS, "unit"})
    return RobotPlant(
        "AMR01", Pose("L1", 1.0, 2.0), parts=parts, missions=lambda at: next(ways, ())
    )


@pytest.fixture(params=["http", "2.1", "3.0"])
def bench(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    monkeypatch.setattr(robot_plant, "RESTS_S", 1.0)
    made = on_http(plant()) if request.param == "http" else on_vda(plant(), request.param)
    with made as standing:
        yield standing


def rounded(path: tuple[Pose, ...] | None) -> tuple[Pose, ...]:
    return tuple(Pose(at.map, round(at.x, 6), round(at.y, 6)) for at in path or ())


def test_its_path_is_read_and_it_pauses_and_goes_on(bench: Bench) -> None:
    sample = bench.until(lambda sample: sample.path, "a path")
    assert (rounded(sample.path), sample.paused) == (WAY, False)
    bench.tells(1, "pause")
    sample = bench.until(lambda sample: sample.paused, "a pause")
    assert (sample.moving, rounded(sample.path)) == (False, WAY)
    bench.tells(2, "resume")
    bench.until(lambda sample: sample.paused is False and sample.moving, "it goes on")
    doings = [edge.signal for edge in bench.plant.edges if edge.what == "relay"]
    assert doings == ["pause", "resume"]


def test_a_repeated_scan_repeats_no_command(bench: Bench) -> None:
    bench.until(lambda sample: sample.path, "a path")
    for _ in range(3):
        bench.tells(1, "pause")
    bench.until(lambda sample: sample.paused, "a pause")
    assert [edge.signal for edge in bench.plant.edges if edge.what == "relay"] == ["pause"]


@pytest.mark.parametrize("way", ["http", "vda"])
def test_after_a_death_it_is_paused(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robot_plant, "RESTS_S", 0.2)
    dies = {"on_death": "pause"}
    found = on_http(plant(), replace(HTTP, **dies)) if way == "http" else on_vda(plant(), **dies)
    with found as bench:
        bench.until(lambda sample: sample.moving, "motion")
        bench.driver.make_safe()
        bench.until(lambda sample: sample.paused, "a pause")


@pytest.mark.parametrize(
    ("plan", "said"),
    [
        ({"points": 3}, "'plan.points' is 3, and a list of places is expected"),
        ({"points": [7]}, "'plan.points' is 7, and a place is expected"),
        ({"points": [{"x": 1.0}]}, "an item of 'plan.points' has no 'x' or no 'y'"),
        ({"points": [{"x": "?", "y": 1}]}, "'x' is '?', and a number is expected"),
        ({}, "the answer has no 'plan.points'"),
    ],
)
def test_a_path_that_makes_no_sense_is_named(plan: object, said: str) -> None:
    answer = {"floor": "floor 1", "pose": {"x": 1, "y": 2, "heading": 0}, "battery": 50}
    rest = {"state": "idle", "paused": False, "plan": plan}

    class Bus:
        def get_json(self, path: str) -> dict[str, object]:
            return json.loads(json.dumps({**answer, **rest}))  # type: ignore[no-any-return]

    with pytest.raises(DriverError) as error:
        HttpRobot("AMR01", HTTP, Bus()).read()  # type: ignore[arg-type]
    assert said in str(error.value)


@pytest.mark.parametrize("path", [None, []])
def test_no_path_is_an_empty_one(path: object) -> None:
    answer = {"floor": "floor 1", "pose": {"x": 1, "y": 2, "heading": 0}, "battery": 50}

    class Bus:
        def get_json(self, _: str) -> dict[str, object]:
            return {**answer, "state": "idle", "paused": True, "plan": {"points": path}}

    sample = HttpRobot("AMR01", HTTP, Bus()).read()  # type: ignore[arg-type]
    assert (sample.path, sample.paused) == ((), True)


def test_a_node_without_a_known_place_makes_the_path_unknown() -> None:
    at = {"x": 1.0, "y": 2.0, "mapId": "m"}
    state: dict[str, object] = {"orderId": "7", "nodeStates": [{"sequenceId": 2}]}
    order: dict[str, object] = {"orderId": "7", "nodes": [{"sequenceId": 2, "nodePosition": at}]}
    assert places_left(state, order) == [at]
    assert places_left(state, {**order, "orderId": "8"}) is None
    assert places_left(state, {}) is None
    assert places_left({"nodeStates": []}, {}) == []
    known: dict[str, object] = {"nodeStates": [{"sequenceId": 2, "nodePosition": at}]}
    assert places_left(known, {}) == [at]


def test_an_interface_that_lacks_a_call_for_the_control_is_named() -> None:
    demos = HttpRobotSettings(profile="rmf-demos")
    assert demos.lacks("full") == ""
    light = "control: traffic_light needs pause, resume, fields: path in the interface"
    assert demos.lacks("traffic_light") == light
    assert HTTP.lacks("traffic_light") == ""
    assert HTTP.lacks("full") == "control: full needs navigate, stop in the interface"
    dies = replace(HTTP, on_death="stop").lacks("traffic_light")
    assert dies == "on_death: stop needs the call 'stop' in the interface"
    assert VdaRobotSettings(manufacturer="acme").lacks("traffic_light") == ""
