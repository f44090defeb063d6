"""Xnergy's codes and commands.

Every code has a meaning, and every error has a side at fault. Every start orders a range check.
"""

from collections.abc import Iterable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridges.kinds.charger import core
from bridges.kinds.charger.memory import ChargerLimits, ChargerMemory
from bridges.kinds.charger.settings import ChargerSettings
from bridges.kinds.charger.signals import Activity, ChargerOutputs, ChargerSample, Measured
from bridges.kinds.shared.decision import Sampled
from bridges.messages.definitions import ChargerStateValue as State
from drivers import DriverError
from drivers.charger import xnergy
from drivers.charger.xnergy import Orders, Written, settled, steer
from tests.depth import examples

WELL = {"state": 0, "error_low": 0, "error_high": 0, "range": 0}


def words(**changed: int) -> dict[str, int]:
    return WELL | changed


def test_every_code_of_a_byte_has_a_state_in_rmf() -> None:
    states: dict[State, set[int]] = {state: set() for state in State}
    for code in range(256):
        made = xnergy.sample(words(state=code))
        shown = core.decide(ChargerMemory(), Sampled(made), 0.0, ChargerLimits()).report
        states[shown.state].add(code)
        unknown = "unknown vendor state" in shown.error_message
        assert unknown == (made.activity is Activity.UNKNOWN) == (code not in xnergy.CODES)
    assert states == {
        State.CHARGER_IDLE: {0, 1, 2, 3, 4, 9, 10},  # a handshake without a request counts as idle
        State.CHARGER_ASSIGNED: set(),
        State.CHARGER_CHARGING: {5, 6, 11},
        State.CHARGER_RELEASED: {7},
        State.CHARGER_ERROR: {8} | set(range(12, 256)),
    }


def test_a_reading_is_state_volts_amps_and_range() -> None:
    made = xnergy.sample(words(state=5, volts=3456, amps=1280, range=1))
    assert made == ChargerSample(
        Activity.CHARGING, 5, "", Measured(in_range=True, volts=27.0, amps=10.0)
    )


@pytest.mark.parametrize(
    ("low", "high", "side", "text"),
    [
        (0, 0, "", "error (receiver state 238)"),
        (0x0200, 0, "station", "the transmitter had an error while charging"),
        (0, 1, "station", "the transmitter reports an error"),
        (0, 2, "station", "foreign object on the pad"),
        (0x0040, 0, "robot", "the gap to the pad is too wide"),
        (0x0400, 0, "", "unknown error bit 10"),
        (0x0440, 0, "", "unknown error bit 10; robot: the gap to the pad is too wide"),
        (
            0x0410,
            2,
            "station",
            "foreign object on the pad; unknown side: unknown error bit 10; robot: handshake timeout",
        ),
        (
            0x8010,
            0x10,
            "robot",
            "handshake timeout; a fan of the receiver is stuck;"
            " a temperature sensor of the receiver has failed",
        ),
    ],
)
def test_error_words_name_the_side_at_fault_and_the_stations_first(
    low: int, high: int, side: str, text: str
) -> None:
    made = xnergy.sample(words(state=238, error_low=low, error_high=high))
    assert (made.side, made.error_text) == (side, text)


def test_an_error_that_has_gone_is_named_by_the_latched_words_while_the_state_is_error() -> None:
    latched = {"latched_low": 0x0100, "latched_high": 0}
    assert xnergy.sample(words(state=238) | latched).error_text == (
        "communication lost while charging"
    )
    assert xnergy.sample(words(state=0) | latched).error_text == ""


@pytest.mark.parametrize(
    ("low", "high", "side"), [(0x4000, 0, "robot"), (0, 1, "station"), (0x0400, 0, "")]
)
@pytest.mark.parametrize("state", sorted(xnergy.CODES))
def test_an_error_bit_of_the_receiver_is_an_error_whatever_its_state_says(
    state: int, low: int, high: int, side: str
) -> None:
    made = xnergy.sample(words(state=state, error_low=low, error_high=high))
    assert (made.activity, made.side, made.charges) == (Activity.ERROR, side, state == 5)


@pytest.mark.parametrize("result", [0, 2, 3, 240])
def test_only_the_answer_yes_is_in_range_and_only_when_it_is_the_last_checks(result: int) -> None:
    assert xnergy.sample(words(range=result)).measured.in_range is False
    assert xnergy.sample(words(range=1)).measured.in_range is True
    assert xnergy.sample(words(range=1), settled=False).measured.in_range is False


any_word = st.integers(0, 0xFFFF)


@settings(max_examples=examples(300))
@given(
    st.fixed_dictionaries(
        dict.fromkeys(("error_low", "error_high"), st.just(0) | any_word)
        | {"state": st.sampled_from(sorted(xnergy.CODES)) | any_word},
        optional=dict.fromkeys(
            {*xnergy.ALWAYS, *xnergy.IN_ERROR} - {"state", "error_low", "error_high"}, any_word
        ),
    )
)
def test_whatever_the_words_are_only_state_5_without_an_error_is_charging(
    found: dict[str, int],
) -> None:
    made = xnergy.sample(found)
    well = found["error_low"] == found["error_high"] == 0
    assert (made.activity is Activity.CHARGING) == (found["state"] == 5 and well)
    assert made.code == found["state"]


# ---- starting and stopping


def run(*scans: tuple[float, ChargerOutputs, int]) -> list[tuple[float, Orders]]:
    """Return each order that is not empty, with its time (s). Each scan is (time, outputs, state)."""
    given_, written = [], Written()
    for now, outputs, code in scans:
        written, orders = steer(written, outputs, code, now)
        if orders != Orders():
            given_.append((now, orders))
    return given_


ON, OFF, LEAVE = (ChargerOutputs(power=power) for power in (True, False, None))
ENABLE, DISABLE, CHECK = Orders(enable=True), Orders(enable=False), Orders(check_range=True)


def test_a_start_is_written_once_and_from_idle() -> None:
    assert run((0.0, ON, 0), (0.1, ON, 0), (0.2, ON, 2), (9.0, ON, 0)) == [(0.0, ENABLE)]


@pytest.mark.parametrize("code", [*range(1, 13), 238, 99])
def test_no_start_is_written_in_any_other_state(code: int) -> None:
    assert run(*((float(n), ON, code) for n in range(9))) == []


def test_a_stop_is_written_once_and_again_while_the_receiver_charges() -> None:
    assert run(
        (0.0, ON, 0), (1.0, OFF, 5), (1.1, OFF, 5), (1.2, OFF, 11), (1.3, OFF, 0), (9.0, OFF, 5)
    ) == [(0.0, ENABLE), (1.0, DISABLE), (1.1, DISABLE), (9.0, DISABLE)]


def test_a_station_to_be_left_alone_is_neither_started_nor_stopped() -> None:
    assert run((0.0, LEAVE, 5), (1.0, LEAVE, 0)) == []


def test_a_range_check_is_asked_for_once_for_each_rise_and_from_idle() -> None:
    first, second = (ChargerOutputs(power=False, range_checks=n) for n in (1, 2))
    orders = run((0.0, first, 2), (1.0, first, 0), (1.1, first, 0), (2.0, second, 0))
    assert [(at, one.check_range) for at, one in orders] == [(0.0, False), (1.0, True), (2.0, True)]


def test_a_start_waits_for_a_range_check_that_could_not_be_asked_for_yet() -> None:
    checked = ChargerOutputs(power=True, range_checks=1)
    assert run((0.0, checked, 4), (1.0, checked, 0), (1.1, checked, 0)) == [
        (1.0, CHECK),
        (1.1, ENABLE),
    ]


def test_a_result_is_the_last_checks_only_a_second_after_it_was_asked_for() -> None:
    written = Written()
    assert settled(written, 0.0)
    written, _ = steer(written, ChargerOutputs(range_checks=1), 2, 5.0)
    assert not settled(written, 99.0)
    written, _ = steer(written, ChargerOutputs(range_checks=1), 0, 100.0)
    assert [settled(written, now) for now in (100.5, 101.0)] == [False, True]


class Wire:
    """A receiver that shows the result "in range" all the time. `lost` is the name of a write that
    fails. `silent`: readings fail."""

    reads = xnergy.ALWAYS

    def __init__(self) -> None:
        self.time, self.code, self.lost, self.silent = 0.0, 0, "", False
        self.written: list[tuple[str, int]] = []

    def alive(self) -> bool:
        if self.silent:
            raise DriverError("timeout")
        return False

    def read(self, names: Iterable[str]) -> dict[str, int]:
        return dict.fromkeys(names, 0) | {"state": self.code, "range": xnergy.IN_RANGE}

    def write(self, name: str, value: int, safe: bool = False) -> None:
        self.written.append((name, value))
        if name == self.lost:
            raise DriverError("timeout")

    def insist(self) -> None:
        pass

    def now(self) -> float:
        return self.time


def test_a_check_that_was_not_written_gives_no_result_until_the_next_check() -> None:
    wire = Wire()
    receiver = xnergy.Receiver(ChargerSettings(), wire)
    wire.code = 1
    receiver.read()
    receiver.write(ChargerOutputs(range_checks=1))  # waits, because the receiver is not idle
    wire.code, wire.lost = 0, xnergy.CHECK_RANGE
    receiver.read()
    with pytest.raises(DriverError):
        receiver.write(ChargerOutputs(range_checks=1))
    wire.time, wire.lost = 60.0, ""
    assert receiver.read().measured.in_range is False
    receiver.write(ChargerOutputs(range_checks=1))
    assert wire.written == [(xnergy.CHECK_RANGE, 1)]
    receiver.write(ChargerOutputs(range_checks=2))
    assert wire.written == [(xnergy.CHECK_RANGE, 1)] * 2
    wire.time = 61.0
    assert receiver.read().measured.in_range is True


def test_no_start_is_written_after_a_failed_reading_but_a_stop_is() -> None:
    wire = Wire()
    receiver = xnergy.Receiver(ChargerSettings(), wire)
    receiver.read()
    wire.silent = True
    with pytest.raises(DriverError):
        receiver.read()
    receiver.write(ChargerOutputs(power=True))
    assert wire.written == []
    receiver.write(ChargerOutputs(power=False))
    assert wire.written == [(xnergy.ENABLE, 0)]
