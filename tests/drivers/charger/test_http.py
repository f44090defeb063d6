"""The driver of the HTTP charger. It reads JSON.

To clear an error, the driver sends its command only once.
"""

import json
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bridges.kinds.charger import core
from bridges.kinds.charger.memory import ChargerLimits, ChargerMemory
from bridges.kinds.charger.signals import Activity, ChargerOutputs, ChargerSample
from bridges.kinds.shared.decision import Sampled
from bridges.messages.definitions import ChargerStateValue as State
from bridges.settings.load import load
from drivers import DriverError
from drivers.charger.http import DRIVER, HttpChargerSettings, create, describe, warnings
from drivers.charger.http_fields import Fields
from drivers.charger.state_codes import Codes
from drivers.hal import HalError
from drivers.hal import http as bus_file
from drivers.http_call import Call
from tests.depth import examples

CODES = Codes(idle=[0], handshake=[1, 2], charging=[5], stopping=[11], released=[7], error=[238])
SETTINGS = HttpChargerSettings(codes=CODES)
SWITCHED = HttpChargerSettings(codes=CODES, start=Call(path="/start"), stop=Call(path="/stop"))
EXAMPLE = Path(__file__).parents[3] / "config" / "charger_http.yaml"


class Station:
    """A bus that gives `answer` to every request."""

    def __init__(self, answer: Any = None) -> None:
        self.answer = answer
        self.calls: list[str] = []
        self.fails = False

    def get_json(self, path: str) -> dict[str, Any]:
        self.calls.append(f"GET {path}")
        return self.answer  # type: ignore[no-any-return]

    def send(
        self, path: str, method: str = "POST", body: str | None = None, safe: bool = False
    ) -> None:
        self.calls.append(f"{method} {path}" + (f" {body}" if body else ""))
        if self.fails:
            raise HalError("the answer is lost")


def read(answer: Any) -> ChargerSample:
    return create("a", SETTINGS, Station(answer)).read()


def test_after_a_failed_reading_stop_is_sent_once_and_no_start() -> None:
    """The last reading showed `idle`, but the station may have begun to charge."""
    station = Station({"state": 0, "error_msg": ""})
    charger = create("a", SWITCHED, station)
    charger.read()
    charger.write(ChargerOutputs(power=True))
    station.answer = {}
    for power in (True, True, False, False):
        with pytest.raises(DriverError):
            charger.read()
        charger.write(ChargerOutputs(power=power))
    assert [call for call in station.calls if "GET" not in call] == ["POST /start", "POST /stop"]


def test_the_driver_stands_on_http_and_has_no_wires() -> None:
    assert DRIVER.buses == ("http",)
    assert list(DRIVER.wires(SETTINGS)) == []


@pytest.mark.parametrize(
    ("code", "activity"),
    [
        (0, Activity.IDLE),
        (1, Activity.HANDSHAKE),
        (2, Activity.HANDSHAKE),
        (5, Activity.CHARGING),
        (11, Activity.STOPPING),
        (7, Activity.RELEASED),
        (238, Activity.ERROR),
        (6, Activity.UNKNOWN),
        (65535, Activity.UNKNOWN),
    ],
)
def test_a_vendors_number_is_what_the_table_says(code: int, activity: Activity) -> None:
    assert read({"state": code, "error_msg": ""}) == ChargerSample(activity, code)


def test_every_code_of_a_byte_has_a_state_in_rmf_and_none_is_passed_on_raw() -> None:
    config = load(EXAMPLE)
    made = config.devices["charger_a"]
    states: dict[State, set[int]] = {state: set() for state in State}
    for code in range(256):
        sample = create("a", made, Station({"state": code, "error_msg": ""})).read()
        shown = core.decide(ChargerMemory(), Sampled(sample), 0.0, ChargerLimits.of(made)).report
        states[shown.state].add(code)
        assert ("unknown vendor state" in shown.error_message) == (
            sample.activity is Activity.UNKNOWN
        )
    assert states == {
        State.CHARGER_IDLE: {0, 1, 2, 3, 4, 9, 10},  # a handshake without a request counts as idle
        State.CHARGER_ASSIGNED: set(),
        State.CHARGER_CHARGING: {5, 6, 11},
        State.CHARGER_RELEASED: {7},
        State.CHARGER_ERROR: {8} | set(range(12, 256)),
    }


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        ({}, "the answer has no 'state'; it has nothing: is state_path right?"),
        ({"stat": 1, "b\n": 2}, "the answer has no 'state'; it has stat, b: is state_path right?"),
        ({"state": "5"}, "'state' is '5', and a whole number is expected"),
        ({"state": 5.0}, "'state' is 5.0, and a whole number is expected"),
        ({"state": True}, "'state' is true, and a whole number is expected"),
        ({"state": None}, "'state' is null, and a whole number is expected"),
        ({"state": [5]}, "'state' is [5], and a whole number is expected"),
        ({"state": -1}, "'state' is -1, and 0 to 65535 is expected"),
        ({"state": 65536}, "'state' is 65536, and 0 to 65535 is expected"),
        ({"state": 0, "error_msg": 7}, "'error_msg' is 7, and a text is expected"),
        ({"state": 0, "error_msg": ["x"]}, "'error_msg' is ['x'], and a text is expected"),
    ],
)
def test_an_answer_without_a_meaning_is_an_error_that_names_the_field(
    answer: Any, text: str
) -> None:
    with pytest.raises(DriverError) as caught:
        read(answer)
    assert str(caught.value) == text


@pytest.mark.parametrize(
    ("said", "text"),
    [
        ("over temperature", "over temperature"),
        (" foreign\r\n object\x1b[2J\u202e ", "foreign object [2J"),
        ("\ud800broken", "broken"),
        ("é" * 300, "é" * 199 + "…"),
        (None, ""),
    ],
)
def test_the_stations_words_are_printable_on_one_line_and_not_long(said: Any, text: str) -> None:
    assert read({"state": 238, "error_msg": said}).error_text == text


@pytest.mark.parametrize("code", [0, 1, 5, 11, 7, 238, 6])
def test_the_stations_words_are_an_error_whatever_its_state_says(code: int) -> None:
    assert read({"state": code, "error_msg": "foreign object"}) == ChargerSample(
        Activity.ERROR, code, "foreign object", charges=code == 5
    )


SIDED = HttpChargerSettings(
    codes=Codes(idle=[0], charging=[5], error=[238], station_error=[239], robot_error=[240]),
    fields=Fields(error_texts={"OK": "none", "coil hot": "station", "too far": "robot"}),
)


@pytest.mark.parametrize(
    ("code", "said", "activity", "side"),
    [
        (0, "OK", Activity.IDLE, ""),
        (5, "OK", Activity.CHARGING, ""),
        (0, "coil hot", Activity.ERROR, "station"),
        (5, "too far", Activity.ERROR, "robot"),
        (5, "tilted", Activity.ERROR, ""),
        (239, "OK", Activity.ERROR, "station"),
        (239, "too far", Activity.ERROR, "station"),
        (240, "", Activity.ERROR, "robot"),
        (240, "tilted", Activity.ERROR, "robot"),
        (240, "coil hot", Activity.ERROR, "station"),
        (238, "too far", Activity.ERROR, "robot"),
        (238, "", Activity.ERROR, ""),
    ],
)
def test_whose_an_error_is_comes_from_its_text_or_its_code_and_the_station_comes_first(
    code: int, said: str, activity: Activity, side: str
) -> None:
    made = create("a", SIDED, Station({"state": code, "error_msg": said})).read()
    assert (made.activity, made.side) == (activity, side)


def test_check_says_what_texts_and_codes_of_a_side_mean() -> None:
    rows = describe(SIDED, bus_file.HttpSettings(api_base="192.168.1.60/api"))
    assert [row for row in rows if "error" in row[1] or "'s error" in row[0]] == [
        ("clear error", "POST http://192.168.1.60/api/clear_error, when an operator resets"),
        ("field error_text", "error_msg"),
        ("text OK", "no error"),
        ("text coil hot", "station's error"),
        ("text too far", "robot's error"),
        ("station's error", "239"),
        ("robot's error", "240"),
        ("any other state", "error, with its number"),
    ]


def test_a_station_that_charges_on_with_an_error_is_told_to_stop_again_and_again() -> None:
    station = Station({"state": 5, "error_msg": "foreign object"})
    made = create("a", msgspec.structs.replace(SETTINGS, stop=Call(path="/stop")), station)
    for _ in range(3):
        made.read()
        made.write(ChargerOutputs(power=False))
    assert station.calls == ["GET /state", "POST /stop"] * 3


def test_a_station_that_disobeys_with_an_error_is_named_as_one_that_disobeys() -> None:
    limits = ChargerLimits.of(msgspec.structs.replace(SETTINGS, stop=Call(path="/stop")))
    memory = core.initial(limits, 0.0)
    said = read({"state": 5, "error_msg": "foreign object"})
    for now in (0.0, 1.0, 1000.0):
        decision = core.decide(memory, Sampled(said), now, limits)
        memory = decision.memory
    assert [fault.detail for fault in decision.report.faults] == [
        "foreign object",
        "out of service after: station: it goes on charging after an order to stop; cut its supply",
    ]


def test_the_error_text_may_be_missing() -> None:
    assert read({"state": 0}) == ChargerSample(Activity.IDLE, 0)


anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=5,
)


@settings(max_examples=examples(400))
@example({"state": 5.0})
@example({"state": "5"})
@example({"State": 5})
@given(
    st.fixed_dictionaries({}, optional={"state": anything, "error_msg": anything, "x": anything})
)
def test_whatever_json_comes_it_is_a_driver_error_or_what_its_number_says(answer: Any) -> None:
    try:
        sample = read(answer)
    except DriverError:
        return
    assert json.dumps(answer["state"]) == str(sample.code)
    assert (sample.activity is Activity.CHARGING) == (sample.code == 5)
    assert len(sample.error_text) <= 200


# ---- clearing


def test_an_error_is_cleared_once_for_each_rise_however_often_it_is_written() -> None:
    station = Station()
    driver = create("a", SETTINGS, station)
    for clear_errors in (0, 0, 1, 1, 1, 2, 2):
        driver.write(ChargerOutputs(power=False, clear_errors=clear_errors))
    assert station.calls == ["POST /clear_error"] * 2


def test_a_clearing_whose_answer_is_lost_is_not_sent_again() -> None:
    station = Station()
    station.fails = True
    driver = create("a", SETTINGS, station)
    with pytest.raises(HalError):
        driver.write(ChargerOutputs(clear_errors=1))
    driver.write(ChargerOutputs(clear_errors=1))
    assert station.calls == ["POST /clear_error"]


def test_power_and_the_end_of_the_daemon_send_nothing_to_a_station_that_cannot_be_switched() -> (
    None
):
    station = Station()
    driver = create("a", SETTINGS, station)
    driver.open()
    driver.write(ChargerOutputs(power=True))
    driver.write(ChargerOutputs(power=False))
    driver.make_safe()
    driver.close()
    assert station.calls == []


def test_the_paths_are_the_settings() -> None:
    made = HttpChargerSettings(codes=CODES, state_path="/v2/state", clear_error_path="/v2/clear")
    station = Station({"state": 0})
    driver = create("a", made, station)
    driver.read()
    driver.write(ChargerOutputs(clear_errors=1))
    assert station.calls == ["GET /v2/state", "POST /v2/clear"]


# ---- settings


def test_the_example_is_right_and_says_that_it_can_only_observe() -> None:
    [warning] = load(EXAMPLE).warnings
    assert "observe-only: without receiver_id and stop" in str(warning)


def test_a_code_with_two_meanings_or_twice_is_a_problem_at_its_place() -> None:
    codes = Codes(idle=[0, 1], charging=[5, 5], error=[238, 0])
    assert list(codes.problems()) == [
        (("charging", "1"), "5 is listed under charging already"),
        (("error", "1"), "0 is listed under idle already"),
    ]


@pytest.mark.parametrize(
    ("wrong", "place", "text"),
    [
        ("idle: [0]", "", "needs 'charging'"),
        ("idle: []\n      charging: [5]", "", "at least 1"),
        ("idle: [0]\n      charging: [65536]", "22:18", "65535"),
        ("idle: [0]\n      charging: [-1]", "22:18", "0"),
        ("idle: [0]\n      charging: [5, 0]", "22:21", "0 is listed under idle already"),
        ("idle: [0]\n      charging: [5]\n      manual: [12]", "23:7", "unknown key 'manual'"),
    ],
)
def test_a_code_table_that_cannot_be_right_is_refused(
    tmp_path: Path, wrong: str, place: str, text: str
) -> None:
    head, _, _ = EXAMPLE.read_text("utf-8").partition("      idle:")
    file = tmp_path / "charger.yaml"
    file.write_text(f"{head}      {wrong}\n", "utf-8")
    from bridges.settings.load import SettingsError

    with pytest.raises(SettingsError) as caught:
        load(file)
    [problem] = caught.value.problems
    assert text in str(problem)
    assert place in str(problem)


def test_a_table_without_errors_is_worth_a_warning() -> None:
    [_, (path, text)] = warnings(HttpChargerSettings(codes=Codes(idle=[0], charging=[5])))
    assert path == ("codes",)
    assert (
        text
        == "no code is listed under error, so an error of the station shows as an unknown state"
    )


def test_check_prints_addresses_and_meanings() -> None:
    bus = bus_file.HttpSettings(api_base="tpu:8080/api", scan_s=2.0)
    assert describe(SETTINGS, bus) == [
        ("state", "GET http://tpu:8080/api/state every 2 s"),
        ("clear error", "POST http://tpu:8080/api/clear_error, when an operator resets"),
        ("state idle", "0"),
        ("state handshake", "1, 2"),
        ("state charging", "5"),
        ("state stopping", "11"),
        ("state released", "7"),
        ("state error", "238"),
        ("any other state", "error, with its number"),
    ]


def test_check_says_how_often_errors_are_cleared_and_which_meaning_has_no_code() -> None:
    from bridges.kinds.charger.settings import ChargerDurations

    made = HttpChargerSettings(
        codes=Codes(idle=[0], charging=[5]), limits=ChargerDurations(clear_errors_per_h=2)
    )
    rows = dict(describe(made, bus_file.HttpSettings(api_base="tpu")))
    assert rows["clear error"] == (
        "POST http://tpu/clear_error, when an operator resets, and by itself at most 2 times an hour"
    )
    assert rows["state stopping"] == "no code"
