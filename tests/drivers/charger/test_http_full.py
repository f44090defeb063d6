"""The JSON of another make: fields, words, commands, and bad answers. A map in YAML describes
everything."""

from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridges.kinds.charger.settings import robot
from bridges.kinds.charger.signals import Activity, ChargerOutputs, ChargerSample, Measured
from bridges.settings.load import load
from drivers import DriverError, json_fields
from drivers.charger.http import HttpChargerSettings, create, describe, warnings
from drivers.charger.http_fields import Fields
from drivers.charger.state_codes import Codes
from drivers.hal import HalError
from drivers.http_call import Call
from drivers.json_fields import JsonFlag
from tests.depth import examples
from tests.drivers.charger.test_http import Station
from tests.settings.reading import changed, problems_of

EXAMPLE = Path(__file__).parents[3] / "config" / "charger_http_full.yaml"
FULL: HttpChargerSettings = load(EXAMPLE).devices["charger_b"]
START, STOP = 'PUT /output {"enabled": true}', "POST /output/off"


def answer(state: Any = "READY", **pad: Any) -> dict[str, Any]:
    return {
        "charger": {"state": state, "fault": {"text": ""}},
        "pad": {"receiver": None, "aligned": False, **pad},
        "battery": {},
    }


def read(said: Any, made: HttpChargerSettings = FULL) -> ChargerSample:
    return create("a", made, Station(said)).read()


def test_everything_is_read_where_the_yaml_says_that_it_is() -> None:
    said = answer("CHARGING", receiver="A41F", aligned=True)
    said["battery"] = {"millivolts": 48250, "amps": 12.5, "percent": 64, "minutes_left": 20}
    assert read(said) == ChargerSample(
        Activity.CHARGING,
        2,
        measured=Measured("A41F", True, 48.25, 12.5, 64.0, 1200.0),
    )


def test_a_clear_pad_and_missing_measurements_are_not_errors() -> None:
    assert read(answer()) == ChargerSample(
        Activity.IDLE, 0, measured=Measured(receiver_id="", in_range=False)
    )
    said = answer(receiver="", aligned=None)
    said["battery"] = {"millivolts": None}
    assert read(said) == read(answer())


def test_a_receivers_number_is_its_id() -> None:
    assert read(answer(receiver=17)).measured.receiver_id == "17"


def test_a_robots_error_is_distinguished_from_the_stations_and_an_unknown_word_is_unknown() -> None:
    found = [read(answer(word)) for word in ("FAULT", "PAIRING_FAILED", "UPDATING\n firmware")]
    assert [(sample.activity, sample.code, sample.side) for sample in found] == [
        (Activity.ERROR, 5, "station"),
        (Activity.ERROR, 6, "robot"),
        (Activity.UNKNOWN, "UPDATING firmware", ""),
    ]


def test_a_range_may_be_a_number() -> None:
    fields = msgspec.structs.replace(
        FULL.fields, in_range=JsonFlag(field="pad.aligned", when=[1, 3])
    )
    made = msgspec.structs.replace(FULL, fields=fields)
    seen = [read(answer(aligned=value), made).measured.in_range for value in (1, 3, 0, True, "1")]
    assert seen == [True, True, False, False, False]


@pytest.mark.parametrize(
    ("said", "text"),
    [
        ({}, "the answer has no 'charger.state'; it has nothing: is state_path right?"),
        (answer(2), "'charger.state' is 2, and a text is expected"),
        (answer(None), "'charger.state' is null, and a text is expected"),
        (answer(receiver=True), "'pad.receiver' is true, and a text or a whole number is expected"),
        (answer(receiver=1.5), "'pad.receiver' is 1.5, and a text or a whole number is expected"),
        (answer(aligned=1), "'pad.aligned' is 1, and true or false is expected"),
        (
            {**answer(), "pad": {"aligned": True}},
            "the answer has no 'pad.receiver'; it has charger, pad, battery: is state_path right?",
        ),
        (
            {**answer(), "pad": {"receiver": "A41F"}},
            "the answer has no 'pad.aligned'; it has charger, pad, battery: is state_path right?",
        ),
        (
            {**answer(), "battery": {"millivolts": "48"}},
            "'battery.millivolts' is '48', and a number is expected",
        ),
        (
            {**answer(), "battery": {"amps": True}},
            "'battery.amps' is true, and a number is expected",
        ),
        (
            {**answer(), "battery": {"amps": float("inf")}},
            "'battery.amps' is inf, and a number of sensible size is expected",
        ),
        (
            {**answer(), "battery": {"minutes_left": 10**400}},
            "'battery.minutes_left' is 100000000000000000…0000000000000000000, and a number of"
            " sensible size is expected",
        ),
        (
            {**answer(), "battery": {"percent": 101}},
            "'battery.percent' is 101.0, and 0 to 100 is expected",
        ),
        (
            {**answer(), "battery": {"minutes_left": -1}},
            "'battery.minutes_left' is -60.0, and 0 s to a week is expected",
        ),
    ],
)
def test_an_answer_of_the_wrong_sort_is_an_error_that_names_the_field(said: Any, text: str) -> None:
    with pytest.raises(DriverError) as caught:
        read(said)
    assert str(caught.value).replace("...", "…") == text


def test_a_place_in_a_list_is_its_number() -> None:
    said = {"pads": [{"id": 4}, {"id": 5}]}
    assert json_fields.found(said, "pads.1.id") == 5
    assert [json_fields.found(said, f) for f in ("pads.2.id", "pads.x", "pads.1.id.x", "y")] == [
        json_fields.ABSENT
    ] * 4


anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=4,
)
states = st.sampled_from(["READY", "CHARGING", "FAULT", "RAMP_DOWN"]) | anything
near = st.fixed_dictionaries(
    {},
    optional={
        "charger": st.fixed_dictionaries({}, optional={"state": states, "fault": anything})
        | anything,
        "pad": st.fixed_dictionaries({}, optional={"receiver": anything, "aligned": anything})
        | anything,
        "battery": st.fixed_dictionaries(
            {}, optional={"millivolts": anything, "percent": anything, "minutes_left": anything}
        )
        | anything,
    },
)


@settings(max_examples=examples(600))
@given(near)
def test_whatever_json_comes_it_is_a_driver_error_or_a_sample_and_charging_only_by_its_word(
    said: Any,
) -> None:
    sample, error = None, ""
    try:
        sample = read(said)
    except DriverError as raised:
        error = str(raised)
    assert len(error) < 400
    assert error.isprintable()
    if sample is None:
        return
    assert (sample.activity is Activity.CHARGING) == (said["charger"]["state"] == "CHARGING")
    assert isinstance(sample.measured.receiver_id, str)
    assert len(sample.measured.receiver_id) <= 64
    assert isinstance(sample.measured.in_range, bool)
    percent = sample.measured.battery_percent
    assert percent is None or 0 <= percent <= 100


# ---- commands


def driver() -> tuple[Station, Any]:
    """Return a station, and the function `scan(outputs, state)`.

    `scan` reads the state, writes the outputs, and returns the driver's commands.
    """
    station = Station(answer())
    made = create("a", FULL, station)

    def scan(outputs: ChargerOutputs, state: str) -> list[str]:
        station.answer = answer(state)
        made.read()
        station.calls.clear()
        made.write(outputs)
        return station.calls[:]

    return station, scan


ON, OFF, AS_IT_IS = ChargerOutputs(True), ChargerOutputs(False), ChargerOutputs(None)


def test_a_start_is_repeated_while_the_station_stays_idle_and_a_stop_while_it_goes_on() -> None:
    _, scan = driver()
    history = [
        (ON, "READY"),
        (ON, "READY"),
        (ON, "PAIRING"),
        (ON, "CHARGING"),
        (OFF, "CHARGING"),
        (OFF, "CHARGING"),
        (OFF, "RAMP_DOWN"),
        (OFF, "COOL_DOWN"),
        (OFF, "READY"),
    ]
    assert [scan(*each) for each in history] == [
        [START],
        [START],
        [],
        [],
        [STOP],
        [STOP],
        [],
        [],
        [],
    ]


def test_without_a_wanted_level_nothing_is_sent_whatever_the_station_does() -> None:
    _, scan = driver()
    assert [scan(AS_IT_IS, state) for state in FULL.state_words] == [[]] * 7


def test_a_station_that_pairs_by_itself_is_started_once_for_the_robot_that_asked() -> None:
    _, scan = driver()
    assert [scan(ON, "PAIRING"), scan(ON, "PAIRING")] == [[START], []]


def test_an_error_takes_the_power_once_and_before_anything_else_is_sent() -> None:
    _, scan = driver()
    scan(ON, "READY")
    faulty = ChargerOutputs(False, clear_errors=1, range_checks=1)
    assert scan(faulty, "FAULT") == [STOP, "POST /fault/clear", "POST /pad/check"]
    assert scan(faulty, "FAULT") == []


def test_a_stop_whose_answer_is_lost_is_sent_again_and_a_check_is_not() -> None:
    station, scan = driver()
    scan(ON, "CHARGING")
    station.fails = True
    for outputs, state in ((OFF, "FAULT"), (ChargerOutputs(None, range_checks=1), "FAULT")):
        with pytest.raises(HalError):
            scan(outputs, state)
    station.fails = False
    assert scan(ChargerOutputs(False, range_checks=1), "FAULT") == [STOP]


def test_the_daemons_end_stops_or_keeps_as_the_yaml_says() -> None:
    calls = []
    for on_death in ("stop", "keep"):
        station = Station(answer())
        made = create("a", msgspec.structs.replace(FULL, on_death=on_death), station)
        made.open()
        made.make_safe()
        made.close()
        calls.append(station.calls)
    assert calls == [[STOP], []]


# ---- settings


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (
            "tiny/AMR01",
            "AMR01",
            "'AMR01' is not a robot: write FLEET/ROBOT, with the names that RMF uses",
        ),
        ("      receiver_id: pad.receiver", "      #", "receivers needs the field"),
        ("    stop: {path: /output/off}", "", "needs stop too"),
        ("      in_range:", "      #", "range_check needs the field"),
        ("""'{"enabled": true}'""", """'{"enabled": yes}'""", "is not JSON"),
        ("pad.receiver ", "pad..receiver ", "names with dots between them"),
        ("PUT", "DELETE", "PUT"),
    ],
)
def test_a_profile_that_cannot_be_right_is_refused(
    tmp_path: Path, old: str, new: str, text: str
) -> None:
    assert text in " ".join(
        problems_of(tmp_path / "a.yaml", changed(old, new, EXAMPLE.read_text()))
    )


def test_keep_needs_a_station_that_can_be_stopped_and_serve_known_needs_receivers(
    tmp_path: Path,
) -> None:
    seed = HttpChargerSettings(
        codes=Codes(idle=[0], charging=[5]), on_death="keep", unrequested="serve_known"
    )
    assert list(seed.problems()) == [
        (("unrequested",), "serve_known needs receivers: without them no robot is known"),
        (
            ("on_death",),
            "has no effect, because the driver cannot stop this station: delete on_death",
        ),
    ]


def test_a_whole_profile_has_no_warning_and_each_gap_has_its_own() -> None:
    assert list(warnings(FULL)) == []
    without = msgspec.structs.replace(FULL, receivers={}, state_words={"READY": 9})
    assert [text for _, text in warnings(without)] == [
        "receiver_id is read, but without receivers no robot is verified",
        "9 is not in codes, so this state is unknown",
    ]
    only_stop = HttpChargerSettings(codes=FULL.codes, stop=Call(path="/off"))
    assert [text for _, text in warnings(only_stop)] == [
        "without receiver_id, the robot on the pad is not verified, and a robot at the"
        " wrong station is not refused"
    ]


def test_check_prints_every_place_word_and_receiver() -> None:
    fields = msgspec.structs.replace(
        FULL.fields, in_range=JsonFlag(field="pad.aligned", when=[1, 3])
    )
    made = msgspec.structs.replace(FULL, fields=fields)
    assert describe(made, load(EXAMPLE).buses["tpu"])[:14] == [
        ("state", "GET http://192.168.1.61:8080/api/v2/status every 0.5 s"),
        ("start", 'PUT http://192.168.1.61:8080/api/v2/output {"enabled": true}'),
        ("stop", "POST http://192.168.1.61:8080/api/v2/output/off"),
        ("range check", "POST http://192.168.1.61:8080/api/v2/pad/check"),
        (
            "clear error",
            "POST http://192.168.1.61:8080/api/v2/fault/clear, when an operator resets",
        ),
        ("field state", "charger.state"),
        ("field error_text", "charger.fault.text"),
        ("field receiver_id", "pad.receiver"),
        ("field in_range", "pad.aligned is 1, 3"),
        ("field volts", "battery.millivolts x 0.001"),
        ("field amps", "battery.amps"),
        ("field battery_percent", "battery.percent"),
        ("field time_to_full_s", "battery.minutes_left x 60"),
        ("word READY", "0"),
    ]
    assert describe(made, load(EXAMPLE).buses["tpu"])[-5:] == [
        ("robot's error", "6"),
        ("any other state", "error, with its number"),
        ("receiver A41F", "tiny/AMR01"),
        ("receiver A420", "tiny/AMR02"),
        ("on death", "stop"),
    ]


def test_a_robot_is_a_fleet_and_a_name() -> None:
    assert robot("tiny/AMR/01") == ("tiny", "AMR/01")
    for text in ("AMR01", "/AMR01", "tiny/"):
        with pytest.raises(ValueError, match="write FLEET/ROBOT"):
            robot(text)


@pytest.mark.parametrize(
    ("codes", "said", "side"),
    [
        (Codes(idle=[0], charging=[1], error=[5], robot_error=[6]), "", "station"),
        (Codes(idle=[0], charging=[1], error=[5], robot_error=[6]), "too far", "robot"),
        (Codes(idle=[0], charging=[1], error=[5], robot_error=[6], station_error=[7]), "", ""),
        (Codes(idle=[0], charging=[1], error=[5]), "", ""),
    ],
)
def test_an_error_is_the_stations_where_the_robots_have_codes_of_their_own(
    codes: Codes, said: str, side: str
) -> None:
    fields = Fields(error_texts={"too far": "robot"})
    made = HttpChargerSettings(codes=codes, fields=fields)
    assert read({"state": 5, "error_msg": said}, made).side == side
