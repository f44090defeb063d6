"""A lift behind a gateway with an HTTP API.

The tests cover the contract of lifts, false and old answers, commands that must be renewed, and errors
in the YAML file.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

import msgspec
import pytest

from bridges.kinds.lift.signals import DoorReading, Hazard, LiftOutputs, LiftSample, Motion, Side
from bridges.settings.load import load
from drivers import DriverError
from drivers.hal import HalError, http
from drivers.lift.http import HttpLiftSettings, create, describe, warnings
from hal_fakes.http_lift import FakeHttpLift, build
from hal_fakes.plants.plant import FailureMode
from hal_fakes.realtime import RealTime
from tests.drivers.benches import on_http
from tests.drivers.lift.contract import AGV, CALL, HOLD, OFF, QUICK, Bench, WiredLiftContract
from tests.drivers.lift.wirings import FLOORS
from tests.settings.reading import changed, texts_of
from tests.waiting import wait_until

EXAMPLE = Path(__file__).parents[3] / "config" / "lift_http.yaml"
SETTINGS: HttpLiftSettings = load(EXAMPLE).devices["Lift1"]


def timed(path: str, off_s: float | None = 10.0, **more: Any) -> dict[str, Any]:
    off = {} if off_s is None else {"switches_off_after_s": off_s}
    return {"ask": {"path": f"{path}/on"}, "release": {"path": f"{path}/off"}, **off, **more}


STATE: dict[str, Any] = {
    "floor": {"field": "car.floor", "values": {"B1": -1, "G": 0, "1": 1}},
    "door": {"field": "car.door", "open": [2], "closed": [0], "moving": [1]},
    "motion": {"field": "car.motion", "stopped": ["still"], "moving": ["moves"]},
    "agv_mode": {"field": "agv"},
    "fire_alarm": {"field": "alarms.fire", "when": ["FIRE"]},
    "online": {"field": "online"},
    "age": {"field": "age"},
}
COMMANDS: dict[str, Any] = {
    "agv_mode_request": timed("/agv", shown={"field": "out.agv"}),
    "door_open": timed("/door"),
    "call": {"path": "/call", "body": '{"to": "{level}"}'},
    "cancel": {"path": "/call/none"},
}


def settings_of(
    state: dict[str, Any] | None = None, commands: dict[str, Any] | None = None, **more: Any
) -> HttpLiftSettings:
    api = {"state_path": "/state", "state": state or STATE, "commands": commands or COMMANDS}
    plain = {"floors": FLOORS, "api": {**api, **more.pop("api", {})}, **more}
    found = msgspec.convert(plain, HttpLiftSettings)
    assert list(found.problems()) == []
    return found


class HttpLiftContract(WiredLiftContract):
    settings: ClassVar[HttpLiftSettings]

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        world = RealTime({"lift": build("lift", self.settings, QUICK)})
        station = FakeHttpLift(world.plants["lift"], self.settings)
        with on_http(world, station, timeout_s=0.3) as (bus, clock):
            yield Bench(create("lift", self.settings, bus), station.plant, clock)

    @pytest.mark.parametrize("part", ["server", "headers"])
    def test_a_link_that_is_gone_is_a_driver_error_and_the_outputs_survive_it(
        self, bench: Bench, part: str
    ) -> None:
        super().test_a_link_that_is_gone_is_a_driver_error_and_the_outputs_survive_it(bench, part)

    @pytest.mark.parametrize("mode", ["garbage", "wrong", "slow"])
    def test_every_failure_is_a_driver_error_and_never_a_false_reading(
        self, bench: Bench, mode: FailureMode
    ) -> None:
        super().test_every_failure_is_a_driver_error_and_never_a_false_reading(bench, mode)

    @pytest.mark.parametrize(
        ("part", "mode"),
        [(part, mode) for part in ("headers", "body") for mode in ("stuck", "slow", "garbage")],
    )
    def test_an_answer_that_is_cut_or_garbled_is_a_driver_error(
        self, bench: Bench, part: str, mode: FailureMode
    ) -> None:
        bench.open()
        bench.until_it_fails(part, mode, lambda sample: False)


class TestOneAnswerAndTimers(HttpLiftContract):
    settings: ClassVar = settings_of()


class TestPartsThatArePostedAndCallsByPath(HttpLiftContract):
    settings: ClassVar = settings_of(
        {
            "floor": {"field": "place.body.floor"},
            "door": {
                "field": "place.body.door",
                "open": [True],
                "closed": [False],
                "moving": ["moving"],
            },
            "motion": {
                "field": "motion.body",
                "stopped": ["still"],
                "up": ["up"],
                "down": ["down"],
            },
            "service": {
                "field": "mode.is",
                "normal": [0],
                "agv_mode": [1],
                "fire_alarm": [2],
            },
        },
        {
            "agv_mode_request": timed("/agv", None),
            "door_open": timed("/door", None),
            "calls": {level: {"path": f"/call/{n}"} for n, level in enumerate(FLOORS)},
            "cancel": {"path": "/call/none"},
        },
        api={
            "state_path": None,
            "state_parts": {
                "place": {"path": "/ask", "body": '{"what": "place", "id": "{lift_id}"}'},
                "motion": {"path": "/ask", "body": '{"what": "motion", "id": "{lift_id}"}'},
                "mode": {"path": "/mode", "method": "GET"},
            },
        },
        lift_id='east "1"',
        accept_unsafe={"agv_mode_request": "ends after a minute", "door_open": "so does this"},
    )

    def test_a_car_on_its_way_is_moving_and_between_landings_with_its_door_closed(
        self, bench: Bench
    ) -> None:
        bench.open()
        bench.plant.fail("car", "slow")
        bench.write(AGV)
        bench.until(lambda sample: sample.agv is True, "AGV mode")
        bench.write(CALL)
        bench.until(lambda sample: sample.motion is Motion.UP, "it moves")


class TestAShortTimer(HttpLiftContract):
    settings: ClassVar = settings_of(
        commands={**COMMANDS, "agv_mode_request": timed("/agv", 1.0, shown={"field": "out.agv"})}
    )

    def test_agv_mode_ends_by_itself_when_nobody_renews_it(self, bench: Bench) -> None:
        bench.open()
        bench.write(AGV)
        bench.until(lambda sample: sample.agv is True, "AGV mode")
        bench.until(lambda sample: sample.agv is False, "AGV mode has ended by itself")
        assert bench.relays() == [("agv_mode_request", True), ("agv_mode_request", False)]


TEMPLATE = msgspec.convert(
    {
        "floors": {"L1": {"level": "l1"}, "L2": {"level": "l2"}},
        "profile": "rmf-lift-template",
        "lift_id": "lift_1",
        "accept_unsafe": {"door_open": "the door closes by itself after 20 s"},
    },
    HttpLiftSettings,
)


def test_the_template_lift_is_called_and_opens_by_the_requests_of_rmfs_template() -> None:
    world = RealTime({"lift": build("lift", TEMPLATE, QUICK)})
    station = FakeHttpLift(world.plants["lift"], TEMPLATE)
    with on_http(world, station, timeout_s=0.5) as (bus, clock):
        bench = Bench(create("lift", TEMPLATE, bus), station.plant, clock)
        bench.open()
        assert bench.read() == LiftSample("l1", DoorReading.CLOSED, motion=Motion.STOPPED)
        bench.write(LiftOutputs(True, call="l2"))
        bench.write(LiftOutputs(True, hold_door=Side.FRONT))
    assert [edge for edge in bench.relays() if edge[1]] == [("call_l2", True), ("door_open", True)]
    assert station.reads == [
        ("POST", f"/lift/status/{what}", '{"id": "lift_1"}')
        for what in ("current_location", "motion_mode", "door_status")
    ]


def test_check_says_what_a_lift_of_the_template_cannot_confirm() -> None:
    told = [text for _, text in warnings(TEMPLATE)]
    assert "no agv_mode: the lift cannot confirm that it serves the robot" in told
    assert "no fire_alarm: a fire recall would not be seen" in told
    assert any("if the gateway loses the lift and repeats its last state" in text for text in told)


GOOD: dict[str, Any] = {
    "car": {"floor": 0, "door": 0, "motion": "still"},
    "agv": False,
    "alarms": {"fire": "no"},
    "online": True,
    "age": 0.2,
    "out": {"agv": False},
}


class Gateway:
    """A stand-in for the HTTP bus. It answers every request with `answer`, and fails for the paths in
    `broken`."""

    def __init__(self, **changes: Any) -> None:
        self.answer: dict[str, Any] = {**GOOD, **changes}
        self.sent: list[str] = []
        self.broken: set[str] = set()
        self.insisted = 0

    def get_json(self, path: str, method: str = "GET", body: str | None = None) -> dict[str, Any]:
        return self.answer

    def send(
        self, path: str, method: str = "POST", body: str | None = None, safe: bool = False
    ) -> None:
        self.sent.append(path + (body or ""))
        if path in self.broken:
            raise HalError(f"{path} is refused")

    def insist(self) -> None:
        self.insisted += 1


def reading(**changes: Any) -> LiftSample:
    return create("lift", settings_of(), Gateway(**changes)).read()


CAR = GOOD["car"]


def test_values_that_are_not_listed_are_faults_and_never_a_floor_a_door_or_standing() -> None:
    for odd in (7, "0", True, 0.5, ""):
        sample = reading(car={"floor": odd, "door": odd, "motion": odd})
        assert (sample.level, sample.door) == (None, DoorReading.UNKNOWN)
        assert sample.motion is Motion.CONTRADICTORY
        assert "is no floor's value" in sample.code_fault


def test_what_is_null_is_not_known() -> None:
    sample = reading(car={"floor": None, "door": None, "motion": None})
    assert sample == LiftSample(None, DoorReading.UNKNOWN, motion=Motion.CONTRADICTORY, agv=False)
    with pytest.raises(DriverError, match=r"'alarms.fire' is null, and yes or no is expected"):
        reading(alarms={"fire": None})


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"online": False}, r"does not reach the lift \('online'\)"),
        ({"online": 1}, "'online' is 1, and true or false is expected"),
        ({"age": 1.5}, r"reading is 1.5 s old \('age'\): at most 1 s \(stale_after_s\)"),
        ({"age": -1}, "reading is -1 s old"),
        ({"age": None}, "does not give its age"),
        ({"age": "new"}, "'age' is 'new', and a number is expected"),
        ({"car": {"floor": 0, "door": 0}}, "has no 'car.motion'"),
        ({"car": {**CAR, "floor": [0]}}, "a text, a number, true or false is expected"),
        ({"car": {**CAR, "door": {"open": 1}}}, "'car.door' is"),
        ({"car": []}, "has no 'car.floor'"),
    ],
)
def test_an_answer_that_is_old_cut_or_of_another_type_is_no_reading(
    changes: dict[str, Any], text: str
) -> None:
    with pytest.raises(DriverError, match=text):
        reading(**changes)


def test_an_unknown_service_state_is_out_of_service() -> None:
    state = {**STATE, "service": {"field": "mode", "normal": [1], "manual_mode": [2]}}
    for said, hazards in ((1, set()), (2, {Hazard.MANUAL}), (3, {Hazard.OUT_OF_SERVICE})):
        driver = create("lift", settings_of(state), Gateway(mode=said))
        assert driver.read().hazards == hazards


def test_held_commands_with_a_timer_are_renewed_in_each_scan_and_a_call_is_sent_once() -> None:
    gateway = Gateway()
    lift = create("lift", settings_of(), gateway)
    lift.open()
    for outputs in (OFF, CALL, CALL, HOLD, HOLD, OFF, OFF):
        lift.read()
        lift.write(outputs)
        gateway.answer["out"] = {"agv": outputs.agv_request}
    assert gateway.sent == [
        *("/call/none", "/door/off"),  # the claim sends no /agv/off, because it is off already
        *("/agv/on", '/call{"to": 1}'),
        "/agv/on",
        *("/call/none", "/agv/on", "/door/on"),
        *("/agv/on", "/door/on"),
        *("/agv/off", "/door/off"),
    ]


def test_a_request_that_may_be_lost_is_sent_again_after_the_next_reading() -> None:
    gateway = Gateway()
    lift = create("lift", settings_of(), gateway)
    lift.open()
    gateway.sent.clear()
    gateway.broken = {"/call"}
    lift.read()
    with pytest.raises(DriverError):
        lift.write(CALL)
    gateway.broken = set()
    lift.read()
    lift.write(CALL)
    assert gateway.sent.count('/call{"to": 1}') == 2


def test_an_output_that_the_answer_shows_otherwise_is_switched_again() -> None:
    gateway = Gateway(out={"agv": True})
    lift = create("lift", settings_of(), gateway)
    lift.open()
    lift.read()
    lift.write(OFF)
    assert gateway.sent.count("/agv/off") == 2
    with pytest.raises(DriverError, match="agv_mode_request still on after being switched off"):
        lift.make_safe()


def test_an_off_that_fails_keeps_no_other_off_waiting() -> None:
    gateway = Gateway(out={})
    lift = create(
        "lift", settings_of(commands={**COMMANDS, "agv_mode_request": timed("/agv")}), gateway
    )
    lift.open()
    lift.read()
    lift.write(HOLD)
    gateway.sent.clear()
    gateway.broken = {"/agv/off"}
    for _ in range(2):
        with pytest.raises(DriverError, match="/agv/off is refused"):
            lift.write(OFF)
    assert gateway.sent == ["/agv/off", "/door/off", "/agv/off"]
    gateway.broken = set()
    lift.write(msgspec.structs.replace(HOLD, call="L2"))
    gateway.sent.clear()
    gateway.broken = {"/agv/off", "/door/off"}
    with pytest.raises(DriverError, match="/agv/off is refused"):
        lift.write(OFF)
    assert gateway.sent == ["/agv/off", "/door/off", "/call/none"]
    gateway.broken = {"/agv/off"}
    gateway.sent.clear()
    gateway.insisted = 0
    with pytest.raises(DriverError, match="/agv/off is refused"):
        lift.make_safe()
    assert (gateway.sent, gateway.insisted) == (["/call/none", "/agv/off", "/door/off"], 1)


def test_a_call_that_cannot_be_withdrawn_keeps_back_the_next_call_only() -> None:
    gateway = Gateway()
    lift = create("lift", settings_of(), gateway)
    lift.open()
    lift.read()
    lift.write(CALL)
    gateway.answer["out"] = {"agv": True}
    gateway.broken = {"/call/none"}
    gateway.sent.clear()
    for outputs in (HOLD, HOLD, msgspec.structs.replace(CALL, call="B1")):
        lift.read()
        with pytest.raises(DriverError, match="/call/none is refused"):
            lift.write(outputs)
    assert gateway.sent == [
        *("/call/none", "/agv/on", "/door/on") * 2,
        *("/door/off", "/call/none", "/agv/on"),
    ]


def test_an_off_that_hangs_does_not_come_first_again() -> None:
    """After a hanging call the bus refuses the others for a while."""

    class Hanging(Gateway):
        hangs = False

        def send(self, path: str, *how: Any, **more: Any) -> None:
            if self.hangs:
                raise HalError("waits before the next attempt")
            self.hangs = path in self.broken
            super().send(path, *how, **more)

    gateway = Hanging(out={})
    settings = settings_of(commands={**COMMANDS, "agv_mode_request": timed("/agv")})
    lift = create("lift", settings, gateway)
    lift.open()
    lift.write(msgspec.structs.replace(HOLD, call="L2"))
    gateway.broken = {"/agv/off"}
    gateway.sent.clear()
    for _ in range(2):
        gateway.hangs = False
        with pytest.raises(DriverError):
            lift.write(OFF)
    assert gateway.sent == ["/agv/off", "/door/off", "/call/none", "/agv/off"]


def test_a_start_switches_off_what_it_can_although_the_state_cannot_be_read() -> None:
    gateway = Gateway(out={})
    lift = create("lift", settings_of(), gateway)
    for _ in range(2):
        with pytest.raises(DriverError, match=r"out\.agv"):
            lift.open()
    assert gateway.sent == ["/call/none", "/agv/off", "/door/off"] * 2
    gateway.answer = GOOD
    lift.open()
    gateway.sent.clear()
    gateway.answer = {}
    with pytest.raises(DriverError):
        lift.open()
    assert gateway.sent == []


def test_off_is_sent_although_the_state_cannot_be_read() -> None:
    gateway = Gateway()
    lift = create("lift", settings_of(), gateway)
    lift.open()
    lift.read()
    lift.write(HOLD)
    gateway.sent.clear()
    gateway.answer = {}
    with pytest.raises(DriverError):
        lift.read()
    lift.write(OFF)
    assert gateway.sent == ["/agv/off", "/door/off"]


def test_a_restart_after_a_lost_answer_ends_no_ride() -> None:
    gateway = Gateway()
    lift = create("lift", settings_of(), gateway)
    lift.open()
    gateway.sent.clear()
    lift.open()
    assert gateway.sent == []


@pytest.mark.parametrize(
    ("old", "new", "wanted"),
    [
        (
            "          switches_off_after_s: 10                  # the same number as in `ask`\n",
            "",
            "unsafe: when the network dies nothing switches agv_mode_request off: let ask set the"
            " gateway's own timer, and write the timer's time as switches_off_after_s; or"
            " accept_unsafe: {agv_mode_request: <why it is safe here>}",
        ),
        ('{"floor": "{level}"}', "{}", '"{level}" into its body, or give calls'),
        ("open: [OPEN], ", "", "'door' needs 'open'"),
        ("closed: [CLOSED]", "closed: [OPEN]", "OPEN means open and closed"),
        ("L2: 1, ", "", "no value for L2"),
        ("L2: 1,", "L2: 1, L4: 4,", "'L4' is not a landing of this lift"),
        ("between_floors: [-1]", "between_floors: [2]", "2 means L3 and between floors"),
        ("stopped: [none], ", "", "'motion' needs 'stopped'"),
        ("      state_path: /lifts/1\n", "", "give either state_path or state_parts"),
        (
            "      state_path: /lifts/1\n",
            "      state_parts: {car: {path: /car}, gateway: {path: /g}, mode: {path: /m},"
            " outputs: {path: /o}}\n",
            "alarms.fire begins with none of state_parts",
        ),
        ('{"on": false}', '{"on": true, "seconds": 10}', "is the same request as ask"),
        ('{"hold": false}', "{hold: false}", "is not JSON"),
        ("    api:\n", "    lift_id: east\n    api:\n", "no request contains"),
        ("    api:\n", "    profile: rmf-lift-template\n    api:\n", "delete one of the two"),
        ("method: digest}", "method: plain}", "digest"),
        ("moving: [OPENING", "shut: [OPENING", "unknown key 'shut'"),
        ("up: [up], ", "", "needs values for moving, or else values for both up and down"),
        (
            "{field: outputs.door}",
            "{field: outputs.robot}",
            "shows agv_mode_request too, so it does not prove that door_open is off",
        ),
        ("{stale_after_s: 3}", "{stale_after_s: 3, call_pulse_s: 0.5}", "delete call_pulse_s"),
        ("path: /lifts/1/cancel", 'path: /lifts/1/call, body: \'{"floor": "{level}"}\'', "same"),
    ],
)
def test_a_wrong_api_is_refused_with_its_remedy(
    tmp_path: Path, old: str, new: str, wanted: str
) -> None:
    found = texts_of(tmp_path / "lift.yaml", changed(old, new, EXAMPLE.read_text()))
    assert any(wanted in text for text in found), found


def test_a_call_that_nothing_can_withdraw_may_have_a_pulse() -> None:
    without = {name: command for name, command in COMMANDS.items() if name != "cancel"}
    assert list(settings_of(commands=without, limits={"call_pulse_s": 0.5}).problems()) == []


def test_a_profile_without_the_lifts_id_is_refused(tmp_path: Path) -> None:
    text = """\
kind: lift
driver: http
rmf: {transport: auto}
buses:
  server: {type: http, api_base: 192.168.1.60, scan_s: 0.3}
lifts:
  Lift1: {floors: [l1, l2], profile: rmf-lift-template, accept_unsafe: {door_open: it closes}}
"""
    [found] = texts_of(tmp_path / "lift.yaml", text)
    assert found == """'Lift1' needs 'lift_id', because requests of the API contain "{lift_id}\""""
    [found] = texts_of(tmp_path / "lift.yaml", text.replace("rmf-lift-template", "rmf-lift"))
    assert "rmf-lift-template" in found


def test_check_shows_every_request_and_field() -> None:
    rows = dict(describe(SETTINGS, http.HttpSettings(api_base="gateway", scan_s=0.5)))
    assert rows["state"] == "GET http://gateway/lifts/1 every 0.5 s"
    assert rows["age"] == "gateway.age_ms x 0.001"
    assert rows["agv_mode_request ask"].endswith('/lifts/1/robot {"on": true, "seconds": 10}')
    assert rows["agv_mode_request ends"] == "by itself, 10 s after the last request for it"


def test_the_call_waits_for_nothing_and_the_gateway_is_the_plants() -> None:
    """The simulated lift uses the numbers and words of the example file in `config/`."""
    world = RealTime({"lift": build("lift", SETTINGS, QUICK)})
    station = FakeHttpLift(world.plants["lift"], SETTINGS)
    with on_http(world, station, timeout_s=0.5) as (bus, clock):
        bench = Bench(create("lift", SETTINGS, bus), station.plant, clock)
        bench.open()
        bench.write(AGV)
        wait_until(lambda: bench.read().agv is True, "AGV mode")
        bench.write(LiftOutputs(True, call="L3"))
        wait_until(lambda: bench.read().level == "L3", "it is there")
        bench.driver.close()
