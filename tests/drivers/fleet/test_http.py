"""Robots behind HTTP interfaces: the interface of the tutorial's manager, and interfaces of other
forms."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import pytest

from bridges.kinds.fleet.signals import Goal, Pose, RobotCommand, RobotOutputs, RobotSample
from drivers import DriverError
from drivers.fleet.http import HttpRobot, HttpRobotSettings
from drivers.hal import HalError, http
from drivers.hal.http_json import RefusedCall
from drivers.http_call import Call
from hal_fakes.http import HttpServer
from hal_fakes.http_fleet import PARTS, FakeFleetRobot
from hal_fakes.plants import robot as robot_plant
from hal_fakes.plants.plant import FailureMode
from hal_fakes.plants.robot import RobotPlant
from hal_fakes.realtime import RealTime
from tests.drivers.hal.modbus.module import Time
from tests.settings.reading import texts_of
from tests.waiting import wait_until

DEMOS = HttpRobotSettings(profile="rmf-demos")
ONE_BY_ONE: dict[str, Any] = {
    "state_path": "/robots/$robot/pose",
    "paths": {"battery": "/robots/$robot/battery", "status": "/robots/$robot/status"},
    "fields": {
        "name": "id",
        "map": "pose.floor",
        "x": "pose.x_mm",
        "y": "pose.y_mm",
        "yaw": "pose.heading",
        "battery": "charge",
        "moving": {"field": "activity", "when": ["driving"]},
        "charging": {"field": "docked"},
        "ready": {"field": "mode", "when": ["auto"]},
        "fault": "alarm",
        "time": "uptime",
    },
    "units": {"length": "mm", "angle": "deg", "battery": "fraction", "y_axis": "down"},
    "navigate": {
        "path": "/robots/$robot/goto",
        "method": "PUT",
        "body": '{"to": {"x": "$x", "y": "$y", "heading": "$yaw"}, "note": "to $goal", "job": "$id"}',
    },
    "stop": {"path": "/robots/$robot/stop"},
    "localize": {"path": "/robots/$robot/floor?name=$map&x=$x&y=$y&heading=$yaw"},
}
MILLIMETRES = msgspec.convert({"api": ONE_BY_ONE}, HttpRobotSettings)
START = Pose("L1", 1.0, 2.0, 0.5)
TIMEOUT_S = 1.0
"""Long enough for a busy machine."""


@dataclass
class Bench:
    """The robots of one manager on one bus, each with its driver. After a failure the bus pauses.
    `clock` measures these pauses."""

    plants: dict[str, RobotPlant]
    drivers: dict[str, HttpRobot]
    bus: http.HttpBus
    clock: Time

    def read(self, name: str = "AMR01") -> RobotSample:
        """Read a robot after all pauses of the bus."""
        self.clock.now += 60.0
        return self.drivers[name].read()

    def send(self, command: RobotCommand, name: str = "AMR01") -> None:
        """Send a command after all pauses of the bus."""
        self.clock.now += 60.0
        self.drivers[name].write(RobotOutputs(command))


@contextmanager
def fleet(settings: HttpRobotSettings, *names: str) -> Iterator[Bench]:
    plants = {name: RobotPlant(name, START, parts=PARTS) for name in names or ("AMR01",)}
    world = RealTime(dict(plants))
    stations = [FakeFleetRobot(name, world.plants[name], settings) for name in plants]
    server = HttpServer(stations, "/api", TIMEOUT_S)
    base, clock = str(server.replace["api_base"]), Time()
    bus = http.HttpBus(http.HttpSettings(api_base=base, timeout_s=TIMEOUT_S), lambda: clock.now)
    try:
        drivers = {name: HttpRobot(name, settings, bus) for name in plants}
        yield Bench(plants, drivers, bus, clock)
    finally:
        server.close()
        world.close()


@pytest.fixture(params=[DEMOS, MILLIMETRES], ids=["rmf-demos", "millimetres"])
def bench(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    monkeypatch.setattr(robot_plant, "SPEED", 20.0)
    monkeypatch.setattr(robot_plant, "TURNS", 50.0)
    with fleet(request.param) as standing:
        yield standing


def to(x: float, y: float = 2.0, number: int = 12) -> RobotCommand:
    return RobotCommand(number, "navigate", goal=Goal(Pose("L1", x, y, 0.25), "pantry"))


def rounded(at: Pose) -> Pose:
    return Pose(at.map, round(at.x, 6), round(at.y, 6), round(at.yaw, 6))


def test_a_robot_drives_to_its_goal_in_the_managers_units(bench: Bench) -> None:
    assert rounded(bench.read().at) == START
    bench.send(to(4.0))
    wait_until(lambda: bench.read().at.x == pytest.approx(4.0), "the robot has arrived")
    wait_until(lambda: bench.read().at.yaw == pytest.approx(0.25), "the robot has turned")
    sample = bench.read()
    assert rounded(sample.at) == Pose("L1", 4.0, 2.0, 0.25)
    assert 0.7 < sample.battery <= 0.8
    assert sample.completed in ("12", None)


def test_a_command_is_sent_once_for_each_attempt(bench: Bench) -> None:
    for attempt in (1, 1, 2, 2, 2):
        bench.send(msgspec.structs.replace(to(4.0), attempt=attempt))
    relays = [edge for edge in bench.plants["AMR01"].edges if edge.what == "relay"]
    assert [(edge.signal, edge.value) for edge in relays] == [("go", "12"), ("go", "12")]


def test_no_command_sends_nothing(bench: Bench) -> None:
    bench.read()
    calls = bench.bus.calls
    bench.drivers["AMR01"].write(RobotOutputs())
    assert bench.bus.calls == calls


def test_a_stop_stops_the_robot(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robot_plant, "SPEED", 0.5)
    bench.send(to(400.0))
    wait_until(lambda: bench.read().at.x > 1.01, "the robot drives")
    bench.send(RobotCommand(13, "stop", of=12))
    here = bench.read().at
    assert bench.read().moving in (False, None)
    assert bench.read().at == here


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("mode", ["off", "stuck", "slow", "garbage"])
def test_a_manager_that_fails_is_a_driver_error_and_never_a_place(
    bench: Bench, part: str, mode: FailureMode
) -> None:
    if (part, mode) == ("server", "stuck"):
        pytest.skip("the last answer again: times are compared in the core")
    bench.plants["AMR01"].fail(part, mode)
    with pytest.raises(DriverError):
        bench.read()
    bench.plants["AMR01"].fail(part, None)
    assert rounded(bench.read().at) == START


def test_a_battery_that_is_a_text_is_named(bench: Bench) -> None:
    bench.plants["AMR01"].fail("server", "wrong")
    with pytest.raises(DriverError, match="is '\\?', and a number is expected"):
        bench.read()


def test_a_command_that_failed_on_the_wire_is_sent_in_the_next_scan(bench: Bench) -> None:
    bench.plants["AMR01"].fail("server", "off")
    with pytest.raises(DriverError):
        bench.send(to(4.0))
    bench.plants["AMR01"].fail("server", None)
    bench.send(to(4.0))
    assert [edge.value for edge in bench.plants["AMR01"].edges if edge.what == "relay"] == ["12"]


def test_a_robot_in_manual_mode_refuses() -> None:
    with fleet(DEMOS) as bench:
        bench.plants["AMR01"].press("manual", True, bench.plants["AMR01"].now)
        bench.send(to(4.0))
        assert bench.read().refused == "navigate is refused: the robot is in manual mode"
        bench.plants["AMR01"].press("manual", False, bench.plants["AMR01"].now)
        bench.send(msgspec.structs.replace(to(4.0), attempt=2))
        assert bench.read().refused == ""


def test_a_stop_is_taken_when_the_manager_has_accepted_it() -> None:
    with fleet(DEMOS) as bench:
        plant = bench.plants["AMR01"]
        stop = RobotCommand(13, "stop", of=12)
        plant.fail("server", "off")
        with pytest.raises(DriverError):
            bench.send(stop)
        plant.fail("server", None)
        assert bench.read().taken == (0, 0)
        plant.press("manual", True, plant.now)
        bench.send(stop)
        assert bench.read().taken == (0, 0)
        plant.press("manual", False, plant.now)
        bench.send(msgspec.structs.replace(stop, attempt=2))
        assert bench.read().taken == (13, 2)


def test_a_stop_does_not_wait_for_the_pause_after_a_failed_reading() -> None:
    with fleet(DEMOS) as bench:
        bench.plants["AMR01"].fail("server", "off")
        with pytest.raises(DriverError):
            bench.read()
        bench.plants["AMR01"].fail("server", None)
        bench.drivers["AMR01"].write(RobotOutputs(RobotCommand(13, "stop", of=12)))
        assert bench.read().taken == (13, 1)


def test_a_map_of_another_name_is_its_level() -> None:
    renamed = msgspec.structs.replace(DEMOS, maps={"L1": "ground floor"})
    with fleet(renamed) as bench:
        at = bench.drivers["AMR01"]._bus.get_json("/status/")["data"]
        assert at["all_robots"][0]["map_name"] == "ground floor"  # type: ignore[index]
        bench.send(to(4.0))
        assert bench.read().at.map == "L1"
        assert bench.plants["AMR01"]._order.at.map == "L1"  # type: ignore[union-attr]


def test_states_and_faults_are_read_by_fields_and_tests() -> None:
    with fleet(MILLIMETRES) as bench:
        plant = bench.plants["AMR01"]
        assert (bench.read().taken_out, bench.read().fault, bench.read().moving) == ("", "", False)
        plant.press("fault", True, plant.now)
        plant.press("manual", True, plant.now)
        sample = bench.read()
        assert sample.fault == "wheel motor too hot"
        assert sample.taken_out == "its manager calls it not ready"


def test_a_lost_robots_last_report_keeps_its_time() -> None:
    with fleet(MILLIMETRES) as bench:
        plant = bench.plants["AMR01"]
        before = bench.read().said_at
        assert before is not None
        wait_until(lambda: (bench.read().said_at or 0.0) > before, "a newer report")
        plant.press("lost", True, plant.now)
        lost = bench.read().said_at
        assert bench.read().said_at == lost


def test_one_answer_serves_all_robots_in_each_round() -> None:
    with fleet(DEMOS, "AMR01", "AMR02", "AMR03") as bench:
        for _ in range(3):
            for name in bench.drivers:
                bench.read(name)
        assert bench.bus.calls == 3


def test_a_robot_that_the_manager_does_not_know_is_named() -> None:
    stranger = msgspec.structs.replace(DEMOS, known_as="AMR99")
    named = pytest.raises(DriverError, match="no robot 'AMR99'; it has AMR01, AMR02")
    with fleet(DEMOS, "AMR01", "AMR02") as bench, named:
        HttpRobot("AMR01", stranger, bench.bus).read()


def test_an_answer_about_another_robot_is_refused() -> None:
    answers: dict[str, object] = {
        "id": "AMR07",
        "pose": {"floor": "L1", "x_mm": 0, "y_mm": 0, "heading": 0},
    }

    class Confused:
        def get_json(self, path: str) -> dict[str, object]:
            return answers

    driver = HttpRobot("AMR01", MILLIMETRES, Confused())  # type: ignore[arg-type]
    with pytest.raises(
        DriverError, match="answers about robot 'AMR07', but was asked about 'AMR01'"
    ):
        driver.read()


def test_an_action_takes_its_values_from_the_description() -> None:
    sent: list[tuple[str, str, str | None]] = []

    class Heard:
        def ask(self, path: str, method: str, body: str | None, safe: bool) -> dict[str, object]:
            sent.append((method, path, body))
            return {"success": True}

    driver = HttpRobot("AMR 1", DEMOS, Heard())  # type: ignore[arg-type]
    command = RobotCommand(9, "act", activity="clean", description='{"zone": "lobby \\"east\\""}')
    driver.write(RobotOutputs(command))
    body = '{"activity":"clean","label":"lobby \\"east\\""}'
    assert sent == [("POST", "/start_activity/?robot_name=AMR%201&cmd_id=9", body)]


def test_an_action_without_a_call_is_refused_by_name() -> None:
    with fleet(DEMOS) as bench:
        bench.send(RobotCommand(9, "act", activity="dance"))
        assert bench.read().refused == "there is no call for the action 'dance'"


def test_no_pause_resume_or_stop_of_a_death_has_the_number_of_an_earlier_one() -> None:
    sent: list[object] = []

    class Heard:
        def ask(self, path: str, method: str, body: str | None, safe: bool) -> dict[str, object]:
            sent.append(path)
            return {"success": True}

    calls = {doing: Call(path=f"/{doing}?id=$id") for doing in ("pause", "resume", "stop")}
    api = msgspec.structs.replace(DEMOS.interface(), **calls)
    settings = HttpRobotSettings(api=api, on_death="pause")
    for doing in ("pause", "resume") * 2:
        HttpRobot("AMR01", settings, Heard()).write(RobotOutputs(RobotCommand(1, doing)))  # type: ignore[arg-type]
        HttpRobot("AMR01", settings, Heard()).make_safe()  # type: ignore[arg-type]
    assert len(set(sent)) == 8


def test_a_pause_that_is_sent_again_in_the_same_attempt_has_the_same_number() -> None:
    sent: list[object] = []

    class Deaf:
        def ask(self, path: str, method: str, body: str | None, safe: bool) -> dict[str, object]:
            sent.append(path)
            raise HalError("timeout")

    api = msgspec.structs.replace(DEMOS.interface(), pause=Call(path="/pause?id=$id"))
    driver = HttpRobot("AMR01", HttpRobotSettings(api=api), Deaf())  # type: ignore[arg-type]
    for attempt in (1, 1, 2, 2):
        with pytest.raises(HalError):
            driver.write(RobotOutputs(RobotCommand(1, "pause", attempt)))
    assert (sent[0], sent[2], len(set(sent))) == (sent[1], sent[3], 2)


@pytest.mark.parametrize("doing", ["act", "navigate"])
def test_a_status_4xx_refuses_the_command(doing: Any) -> None:
    class Refuses:
        def ask(self, path: str, method: str, body: str | None, safe: bool) -> dict[str, object]:
            raise RefusedCall("http://x/go answered status 409: check api_base")

    driver = HttpRobot("AMR01", DEMOS, Refuses())  # type: ignore[arg-type]
    act = RobotCommand(9, "act", activity="clean", description='{"zone": "a"}')
    driver.write(RobotOutputs(act if doing == "act" else to(4.0)))
    assert (driver._refused, driver._unanswered) == (
        f"{doing} is refused: http://x/go answered status 409: check api_base",
        False,
    )


def test_an_action_whose_answer_is_lost_is_not_sent_again() -> None:
    with fleet(DEMOS) as bench:
        bench.plants["AMR01"].fail("body", "stuck")
        act = RobotCommand(9, "act", activity="clean", description='{"zone": "a"}')
        with pytest.raises(DriverError):
            bench.send(act)
        bench.plants["AMR01"].fail("body", None)
        bench.send(act)
        assert bench.read().unanswered
        assert [e.value for e in bench.plants["AMR01"].edges if e.what == "relay"] == ["9"]


def test_a_death_leaves_the_robot_driving_unless_the_yaml_says_stop() -> None:
    with fleet(DEMOS) as bench:
        bench.drivers["AMR01"].make_safe()
        assert bench.bus.calls == 0
        stops = msgspec.structs.replace(DEMOS, on_death="stop")
        HttpRobot("AMR01", stops, bench.bus).make_safe()
        assert [e.signal for e in bench.plants["AMR01"].edges if e.what == "relay"] == ["stop"]


def test_a_stop_at_death_that_the_manager_refuses_is_an_error() -> None:
    with fleet(msgspec.structs.replace(DEMOS, on_death="stop")) as bench:
        bench.plants["AMR01"].press("manual", True, bench.plants["AMR01"].now)
        with pytest.raises(DriverError, match="stop is refused: the robot is in manual mode"):
            bench.drivers["AMR01"].make_safe()


@pytest.mark.parametrize("last", [to(4.0), RobotCommand(13, "stop", of=12)])
def test_a_stop_at_death_names_the_command_that_it_stops(last: RobotCommand) -> None:
    sent: list[str] = []

    class Heard:
        def ask(self, path: str, method: str, body: str | None, safe: bool) -> dict[str, object]:
            sent.append(path)
            return {"success": True}

    driver = HttpRobot("AMR01", msgspec.structs.replace(DEMOS, on_death="stop"), Heard())  # type: ignore[arg-type]
    driver.write(RobotOutputs(last))
    driver.make_safe()
    assert "running_cmd_id=12" in sent[-1]


YAML = """\
kind: fleet
driver: http
fleet: {config: fleet_tiny.yaml, graph: fleet_tiny_graph.yaml}
buses: {manager: {type: http, api_base: "127.0.0.1:1/api"}}
robots:
  AMR01:
    api:
      state_path: /robots/$robot
      fields: {map: map, x: px, y: py, yaw: yaw, battery: soc}
      navigate: {path: "/go?x=$x&y=$y&to=$where"}
      stop: {path: /stop}
      actions: {clean: {path: /clean}}
"""


def test_a_placeholder_without_a_value_and_an_action_without_an_end_are_refused(
    tmp_path: Path,
) -> None:
    assert texts_of(tmp_path / "robots.yaml", YAML) == [
        "'path': '$where' has no value here; the placeholders here are $robot, $id, $running,"
        " $map, $x, $y, $yaw, $goal, $dock, $speed_limit, $activity",
        "'actions' needs the field 'completed', which shows the end of an action",
    ]


def test_an_interface_is_needed_once(tmp_path: Path) -> None:
    neither = YAML[: YAML.index("    api:")].replace("AMR01:", "AMR01: {}")
    assert texts_of(tmp_path / "robots.yaml", neither) == [
        "'AMR01' needs 'api', or a profile: rmf-demos"
    ]
