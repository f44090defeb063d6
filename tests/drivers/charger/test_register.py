"""A charger on registers with a map: the meaning of its words, and wrong maps."""

from pathlib import Path
from typing import Any

import msgspec
import pytest
from msgspec.structs import replace

from bridges.kinds.charger.signals import Activity, ChargerOutputs, ChargerSample, Measured
from bridges.settings.load import load
from drivers import DriverError
from drivers.charger.register import RegisterChargerSettings, create, decode, tables
from drivers.charger.register_map import ChargerMap, RegisterNumber
from tests.settings.reading import changed, texts_of

EXAMPLE = Path(__file__).parents[3] / "config" / "charger_register.yaml"
SETTINGS: RegisterChargerSettings = load(EXAMPLE).devices["charger_f"]
WELL = {
    "state": 0.0,
    "fault": 0.0,
    "flags": 0.0,
    "volts": 48.5,
    "amps": 0.0,
    "in_range": 1.0,
    "coil": 31.0,
}


@pytest.mark.parametrize(
    ("number", "words", "value"),
    [
        (RegisterNumber(at="input register 1"), [65535], 65535),
        (RegisterNumber(at="input register 1", signed=True, scale=0.01), [65286], -2.5),
        (RegisterNumber(at="input register 1", words=2, scale=0.001), [1, 34464], 100.0),
        (RegisterNumber(at="input register 1", words=2, signed=True), [65535, 65534], -2),
        (RegisterNumber(at="input register 1", bit=3), [8], 1),
        (RegisterNumber(at="coil 1"), [1], 1),
    ],
)
def test_words_are_read_and_written_alike(
    number: RegisterNumber, words: list[int], value: float
) -> None:
    assert number.value(words) == value
    assert number.encoded(value) == words


def test_the_low_word_may_be_the_first_of_two() -> None:
    number = RegisterNumber(at="holding register 8", words=2, low_first=True)
    found = [str(point) for point in number.points(3)]
    assert found == ["unit 3 holding register 9", "unit 3 holding register 8"]


@pytest.mark.parametrize("at", ["input register 0x7531", "holding register 0x9C40"])
def test_an_address_that_looks_like_a_number_of_the_data_model_is_written_in_hex(at: str) -> None:
    number = RegisterNumber(at=at, words=2)
    assert list(number.problems()) == []
    assert [point.address for point in number.points(1)] == [int(at[-4:], 16), int(at[-4:], 16) + 1]


def test_no_number_reaches_beyond_the_last_register() -> None:
    problem = (("words",), "there is no register after 65535")
    assert list(RegisterNumber(at="input register 0xFFFF", words=2).problems()) == [problem]
    assert list(RegisterNumber(at="input register 0xFFFF").problems()) == []


def read(**values: float) -> tuple[Activity, int | str, str, str]:
    assert SETTINGS.map
    sample = decode(SETTINGS.map, {**WELL, **values})
    return sample.activity, sample.code, sample.error_text, sample.side


@pytest.mark.parametrize(
    ("values", "wanted"),
    [
        ({}, (Activity.IDLE, 0, "", "")),
        ({"state": 2}, (Activity.HANDSHAKE, 2, "", "")),
        ({"state": 3}, (Activity.HANDSHAKE, "rule 2", "", "")),
        ({"state": 3, "amps": 0.6}, (Activity.CHARGING, "rule 1", "", "")),
        ({"state": 0, "amps": 0.6}, (Activity.STOPPING, "rule 3", "", "")),
        ({"state": 77}, (Activity.UNKNOWN, 77, "", "")),
        ({"flags": 1}, (Activity.IDLE, 0, "", "")),
        ({"flags": 5}, (Activity.ERROR, 0, "fan stuck", "station")),
        ({"fault": 33}, (Activity.ERROR, 0, "no receiver answers", "robot")),
        ({"fault": 99, "state": 4}, (Activity.ERROR, 4, "error 99", "")),
    ],
)
def test_rules_codes_and_errors_say_what_the_station_does(
    values: dict[str, float], wanted: object
) -> None:
    assert read(**values) == wanted


def test_receiver_range_voltage_and_current_are_read_by_the_map() -> None:
    assert SETTINGS.map
    values = {**WELL, "receiver": 4711.0}
    assert decode(SETTINGS.map, values) == ChargerSample(
        Activity.IDLE, 0, measured=Measured("4711", True, 48.5, 0.0, temperatures=(("coil", 31.0),))
    )
    assert decode(SETTINGS.map, {**WELL, "receiver": 0}).measured.receiver_id == ""


def test_two_receivers_with_long_ids_are_two() -> None:
    assert SETTINGS.map
    read = [decode(SETTINGS.map, {**WELL, "receiver": id}) for id in (12_345_678, 12_345_679)]
    assert [sample.measured.receiver_id for sample in read] == ["12345678", "12345679"]


WRONG: dict[str, tuple[str, str]] = {
    "state: {at: input register 0}": (
        "stat: {at: input register 0}",
        "'values' needs 'state', because the map has codes",
    ),
    "{at: flags, ignore": ("{at: flagz, ignore", "unknown value 'flagz': did you mean 'flags'?"),
    "{at: coil 0, start: 1, stop: 0}": (
        "{at: coil 0, start: 1, stop: 1}",
        "'stop' is the value of start too",
    ),
    "start: 1, stop: 0": ("start: 1, stop: 2", "'stop': a coil is 0 or 1"),
    "{at: input register 4, scale: 0.01, signed: true}": (
        "{at: input register 4, bit: 16}",
        "a register has bits 0 to 15",
    ),
    "amps: {at:": ("aps: {at:", "unknown value 'aps': did you mean 'amps'?"),
    "in_range: {at: discrete input 0}": (
        "in_range: {at: discrete input 0, words: 2}",
        "'at' is one bit: delete words, signed and bit",
    ),
    "    unit: 3\n": (
        "    unit: 3\n    receivers: {a: fleet/robot}\n",
        "'receivers': the map needs a value 'receiver'",
    ),
}


@pytest.mark.parametrize("old", WRONG)
def test_a_map_that_cannot_be_right_is_refused(tmp_path: Path, old: str) -> None:
    new, wanted = WRONG[old]
    found = texts_of(tmp_path / "charger.yaml", changed(old, new, EXAMPLE.read_text()))
    assert any(text.startswith(wanted) for text in found)


def test_without_power_it_is_only_observed() -> None:
    plain: dict[str, Any] = {
        "unit": 1,
        "map": {"values": {"state": {"at": "coil 0"}}, "codes": {"idle": [0], "charging": [1]}},
    }
    made = msgspec.convert(plain, RegisterChargerSettings)
    assert not made.can_stop()
    assert isinstance(made.map, ChargerMap)


def test_the_table_says_what_each_registers_number_means() -> None:
    wide = RegisterNumber(at="input register 9", words=2, low_first=True, scale=0.001)
    flag = RegisterNumber(at="input register 2", bit=3)
    assert SETTINGS.map
    found = msgspec.structs.replace(
        SETTINGS.map, values={**SETTINGS.map.values, "volts": wide, "flags": flag}
    )
    (table,) = tables(msgspec.structs.replace(SETTINGS, map=found))
    state, others = "unit 3 input register 0", ", other bits 0"
    volts = "unit 3 input register 10 and unit 3 input register 9"
    assert table.rows == (
        ("state", state, "0x0000", "0: idle"),
        ("state", state, "0x0001", "1: handshake"),
        ("state", state, "0x0002", "2: handshake"),
        ("state", state, "0x0004", "4: charging"),
        ("state", state, "0x0005", "5: released"),
        ("state", state, "0x0009", "9: error"),
        ("fault", "unit 3 input register 1", "0x0001", "1"),
        ("flags", "unit 3 input register 2", f"0x0000{others}", "0"),
        ("flags", "unit 3 input register 2", f"0x0008{others}", "1"),
        ("volts", volts, "0x0000 and 0x64C8", "25.8 V"),
        ("amps", "unit 3 input register 4", "0x050A", "12.9 A"),
        ("in_range", "unit 3 discrete input 0", "0", "0"),
        ("in_range", "unit 3 discrete input 0", "1", "1"),
        ("coil", "unit 3 input register 5", "0x0001", "1"),
    )


class Unit:
    """A Modbus unit on which every place reads 0. `silent`: readings fail."""

    def __init__(self) -> None:
        self.silent = False
        self.written: list[int] = []

    def cells(self, points: Any) -> dict[Any, int]:
        if self.silent:
            raise DriverError("timeout")
        return dict.fromkeys(points, 0)

    def write(self, point: Any, value: int, safe: bool = False) -> None:
        self.written.append(value)


@pytest.mark.parametrize("read_back", [True, False])
def test_the_power_is_not_switched_on_after_a_failed_reading_but_off(read_back: bool) -> None:
    found = SETTINGS.map
    assert found
    assert found.power
    power = replace(found.power, read_back=read_back)
    bus: Any = Unit()
    driver = create("f", replace(SETTINGS, map=replace(found, power=power)), bus)
    driver.read()
    driver.write(ChargerOutputs(True))
    bus.silent = True
    with pytest.raises(DriverError):
        driver.read()
    driver.write(ChargerOutputs(True))
    assert bus.written == [1]
    driver.write(ChargerOutputs(False))
    assert bus.written == [1, 0]
