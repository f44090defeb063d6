"""Tests of rules in a YAML, by which the daemon finds a charging station's state. The rules are the
same for every protocol. The YAML also lists the numbers and bits by which the station reports
errors."""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from bridges.kinds.charger.signals import Activity, ChargerOutputs, ChargerSample
from bridges.settings.load import load
from drivers import DriverError
from drivers.charger.http import HttpChargerSettings, create
from drivers.charger.rules import ErrorBits, ErrorNumber, StationErrors
from drivers.charger.rules import (
    Test as Condition,
)  # pytest would collect a class with the name Test
from hal_fakes.charger_values import values
from tests.drivers.charger.test_http import Station
from tests.settings.reading import changed, texts_of

EXAMPLE = Path(__file__).parents[3] / "config" / "charger_relay.yaml"
RELAY: HttpChargerSettings = load(EXAMPLE).devices["charger_d"]


def answer(watts: float = 0.0, on: bool = False, degrees: float = 40.5) -> dict[str, Any]:
    return {"apower": watts, "output": on, "temperature": {"tC": degrees}}


def read(said: Any, settings: HttpChargerSettings = RELAY) -> tuple[Activity, int | str, str, str]:
    sample: ChargerSample = create("a", settings, Station(said)).read()
    return sample.activity, sample.code, sample.error_text, sample.side


@pytest.mark.parametrize(
    ("said", "wanted"),
    [
        (answer(), (Activity.IDLE, "rule 4", "", "")),
        (answer(on=True), (Activity.HANDSHAKE, "rule 3", "", "")),
        (answer(20.0, on=True), (Activity.HANDSHAKE, "rule 3", "", "")),
        (answer(20.5, on=True), (Activity.CHARGING, "rule 2", "", "")),
        (answer(20.5, on=False), (Activity.CHARGING, "rule 2", "", "")),
        (answer(500, True, 90.5), (Activity.ERROR, "rule 1", "the relay is too hot", "")),
    ],
)
def test_the_first_rule_that_holds_says_what_the_station_does(said: Any, wanted: object) -> None:
    assert read(said) == wanted


def test_a_rule_about_a_missing_value_gives_no_reading() -> None:
    with pytest.raises(DriverError, match=r"no 'temperature\.tC'"):
        read({"apower": 0.0, "output": False})


def made(**also: Any) -> HttpChargerSettings:
    return msgspec.convert(also, HttpChargerSettings)


def test_what_no_rule_and_no_code_names_is_unknown() -> None:
    rules = [
        {"means": "idle", "when": {"a": {"one_of": [1]}}},
        {"means": "charging", "when": {"a": {"above": 4}}},
    ]
    assert read({"a": 1}, made(rules=rules)) == (Activity.IDLE, "rule 1", "", "")
    assert read({"a": True}, made(rules=rules)) == (Activity.UNKNOWN, "of no rule", "", "")


def test_rules_come_before_codes_and_errors_before_both() -> None:
    station = made(
        codes={"idle": [0], "charging": [1]},
        rules=[{"means": "stopping", "when": {"state": {"one_of": [1]}, "amps": {"below": 0.5}}}],
        errors={
            "station": {"hot": "too hot"},
            "codes": [{"at": "fault", "well": [0, 255], "robot": {17: "no receiver"}}],
            "bits": [{"at": "flags", "ignore": [7], "station": {0: "grid"}, "robot": {3: "coil"}}],
        },
    )
    well = {"state": 1, "amps": 12.5, "hot": False, "fault": 255, "flags": 0x80}
    assert read(well, station) == (Activity.CHARGING, 1, "", "")
    assert read({**well, "amps": 0.25}, station) == (Activity.STOPPING, "rule 1", "", "")
    assert read({**well, "hot": True}, station) == (Activity.ERROR, 1, "too hot", "station")
    assert read({**well, "fault": 17}, station) == (Activity.ERROR, 1, "no receiver", "robot")
    assert read({**well, "fault": 18}, station) == (Activity.ERROR, 1, "error 18", "")
    several = {**well, "fault": 17, "flags": 0b1011}
    text = "grid; error bit 1; no receiver; coil"
    assert read(several, station) == (Activity.ERROR, 1, text, "station")


def test_a_rules_test_holds_for_what_it_says_and_nothing_else() -> None:
    assert [Condition(one_of=[1, "on"]).holds(v) for v in (1, 1.0, "on", True, 0, None)] == [
        *[True] * 3,
        *[False] * 3,
    ]
    assert [Condition(above=0, below=2).holds(v) for v in (1, 0.5, True, 0, 2, "1", None)] == [
        *[True] * 3,
        *[False] * 4,
    ]


def test_an_error_value_that_is_not_a_number_is_an_error_that_shows_it() -> None:
    assert ErrorNumber(at="a").errors("E7") == [("", "error E7")]
    assert ErrorNumber(at="a").errors(0) == []
    assert ErrorBits(at="a").errors(None) == [("", "error flags None")]


def test_a_renewed_start_is_sent_in_each_scan_and_a_stop_once_it_is_off() -> None:
    station = Station(answer())
    charger = create("a", RELAY, station)
    for said, power in (
        (answer(), True),
        (answer(on=True), True),
        (answer(300.0, on=True), True),
        (answer(300.0, on=True), False),
        (answer(), False),
    ):
        station.answer = said
        charger.read()
        charger.write(ChargerOutputs(power))
    on, off = (
        "GET /rpc/Switch.Set?id=0&on=true&toggle_after=30",
        "GET /rpc/Switch.Set?id=0&on=false",
    )
    sent = [call for call in station.calls if "Set" in call]
    assert sent == [on, on, on, off]


WRONG = {
    "    switches_off_after_s: 30 ": (
        "    #",
        "'charger_d': unsafe: when the network dies nothing switches the power off: let"
        " start set the relay's own timer, and write the timer's time as switches_off_after_s;"
        " or accept_unsafe: {power: <why it is safe here>}",
    ),
    "switches_off_after_s: 30 ": (
        "switches_off_after_s: 2 ",
        "switches_off_after_s is 2, but it is renewed every 1 s (scan_s): write at least 4, so that one"
        " lost reply does not switch off the output",
    ),
    "{means: idle}": (
        "{means: idel}",
        "'means' is 'idel': write one of idle, handshake, charging, stopping, released, error,"
        " station_error, robot_error",
    ),
    "temperature.tC: {above": (
        "tempe rature: {above",
        "'tempe rature' is not a field: write names with dots between them (status.code)",
    ),
    "{above: 20}": ("{above: 20, below: 20}", "'below' must be greater than above"),
    "{means: charging, when: {apower: {above: 20}}} ": (
        "{means: idle} ",
        "rule 2 always holds: the rules after it are never tried",
    ),
}


@pytest.mark.parametrize("old", WRONG)
def test_rules_that_cannot_be_right_are_refused(tmp_path: Path, old: str) -> None:
    new, wanted = WRONG[old]
    found = texts_of(tmp_path / "charger.yaml", changed(old, new, EXAMPLE.read_text()))
    assert wanted in found


def test_the_fake_shows_what_the_rules_then_read() -> None:
    shown = {a: values(RELAY.rules, RELAY.errors, (a, ""), {"apower": 600.0}) for a in Activity}
    assert [a for a, said in shown.items() if said is None] == [Activity.UNKNOWN]
    charging = shown[Activity.CHARGING]
    assert charging is not None
    assert charging["apower"] == 600.0
    assert StationErrors().found(charging.__getitem__) == []
