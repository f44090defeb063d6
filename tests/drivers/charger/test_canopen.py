"""The driver of the CANopen charger: its writes and their times, and the output of `check`."""

from collections.abc import Iterator
from pathlib import Path

import can
import pytest

from bridges.kinds.charger.signals import Activity, ChargerOutputs, ChargerSample, Measured
from bridges.settings.load import SettingsError, load
from drivers.charger import xnergy
from drivers.charger.canopen import (
    DRIVER,
    CanOpenChargerSettings,
    create,
    describe,
    warnings,
)
from drivers.hal import can as hal
from tests.drivers.hal.can.far_end import Reactive, failure

EXAMPLE = Path(__file__).parents[3] / "config" / "charger_canopen.yaml"
OFF, ON, LEFT = (ChargerOutputs(power) for power in (False, True, None))
ENABLE, DISABLE, CHECK = "2f00200101000000", "2f00200100000000", "2f00200201000000"


class Receiver:
    """A CANopen receiver (RCU). `words` has the value of each object (index, subindex). Objects in
    `silent` give no answer."""

    def __init__(self) -> None:
        self.far = Reactive()
        self.far.react = self.answer
        self.words: dict[tuple[int, int], int] = {}
        self.silent: set[tuple[int, int]] = set()
        self.writes: list[str] = []
        self.reads: list[tuple[int, int]] = []
        self.bus = self.far.bus()
        self.driver = self.made()

    def made(self, on_death: str = "stop") -> xnergy.Receiver:
        """Return a new driver for this RCU."""
        return create("c", CanOpenChargerSettings(node=10, on_death=on_death), self.bus)  # type: ignore[arg-type]

    def answer(self, request: can.Message) -> list[can.Message]:
        asked = bytes(request.data)
        at = (asked[1] | asked[2] << 8, asked[3])
        if asked[0] == 0x40:
            self.reads.append(at)
            reply = b"\x4b" + asked[1:4] + self.words.get(at, 0).to_bytes(2, "little") + b"\0\0"
        else:
            self.writes.append(asked.hex())
            reply = b"\x60" + asked[1:4] + bytes(4)
        if at in self.silent:
            return []
        return [can.Message(arbitration_id=0x58A, is_extended_id=False, data=reply)]

    def beat(self, state: int = 5) -> None:
        """Send a heartbeat."""
        beat = can.Message(arbitration_id=0x70A, is_extended_id=False, data=bytes((state,)))
        self.far.coming.append(beat)

    def scan(self, outputs: ChargerOutputs) -> ChargerSample:
        """Send a heartbeat, read and write. Return the reading."""
        self.beat()
        sample = self.driver.read()
        self.driver.write(outputs)
        return sample


@pytest.fixture
def receiver() -> Iterator[Receiver]:
    made = Receiver()
    made.bus.take()
    made.driver.open()
    yield made
    made.bus.close()


def test_the_canopen_driver_stands_on_can_and_has_no_wires() -> None:
    assert DRIVER.buses == ("can",)
    assert list(DRIVER.wires(CanOpenChargerSettings(node=10))) == []


def test_a_reading_is_the_published_objects(receiver: Receiver) -> None:
    receiver.words = {(0x2002, 0x0A): 5, (0x2002, 6): 3456, (0x2002, 7): 1280, (0x2002, 0x0D): 1}
    assert receiver.scan(LEFT) == ChargerSample(
        Activity.CHARGING, 5, "", Measured(in_range=True, volts=27.0, amps=10.0)
    )
    objects = [0x0A, 3, 4, 6, 7, 0x0D]
    assert receiver.reads == [(0x2002, subindex) for subindex in objects]


def test_the_latched_error_is_read_in_an_error_only(receiver: Receiver) -> None:
    receiver.words = {(0x2002, 0x0A): 238, (0x2002, 2): 2}
    sample = receiver.scan(LEFT)
    assert (sample.side, sample.error_text) == ("station", "foreign object on the pad")
    assert receiver.reads[-2:] == [(0x2002, 1), (0x2002, 2)]


def test_a_start_a_stop_and_a_range_check_are_the_makers_frames(receiver: Receiver) -> None:
    receiver.scan(ChargerOutputs(False, range_checks=1))
    receiver.scan(ChargerOutputs(True, range_checks=1))
    receiver.scan(ChargerOutputs(True, range_checks=1))
    receiver.words[0x2002, 0x0A] = 5
    receiver.scan(ChargerOutputs(False, range_checks=1))
    assert receiver.writes == [DISABLE, CHECK, ENABLE, DISABLE]


def test_a_reading_that_fails_ends_at_the_first_silence(receiver: Receiver) -> None:
    receiver.silent = {(0x2002, 3)}
    receiver.beat()
    assert failure(receiver.driver.read).endswith("read 0x2002:03: no reply within 0.05 s")
    assert receiver.reads == [(0x2002, 0x0A), (0x2002, 3)]


def test_a_start_without_an_answer_may_have_been_heard_and_is_taken_back(
    receiver: Receiver,
) -> None:
    receiver.scan(OFF)
    receiver.silent = {(0x2000, 1)}
    assert failure(lambda: receiver.scan(ON)).endswith("write 0x2000:01: no reply within 0.05 s")
    receiver.silent = set()
    receiver.far.now += 0.6
    receiver.words[0x2002, 0x0A] = 2  # in state 2 the station begins its handshake
    receiver.scan(OFF)
    assert receiver.writes == [DISABLE, ENABLE, DISABLE]


def test_a_range_check_without_an_answer_is_not_asked_for_again(receiver: Receiver) -> None:
    receiver.silent = {(0x2000, 2)}
    asked = ChargerOutputs(None, range_checks=1)
    assert failure(lambda: receiver.scan(asked))
    receiver.silent = set()
    receiver.far.now += 0.6
    receiver.scan(asked)
    assert receiver.writes == [CHECK]


def test_the_result_of_a_range_check_is_believed_a_second_later(receiver: Receiver) -> None:
    receiver.words = {(0x2002, 0x0D): 1}
    asked = ChargerOutputs(False, range_checks=1)
    seen = [receiver.scan(asked).measured.in_range]
    seen.append(receiver.scan(asked).measured.in_range)
    receiver.far.now += 0.9
    seen.append(receiver.scan(asked).measured.in_range)
    receiver.far.now += 0.2
    seen.append(receiver.scan(asked).measured.in_range)
    assert seen == [True, False, False, True]


def test_a_receiver_that_restarts_is_told_again(receiver: Receiver) -> None:
    receiver.scan(ON)
    receiver.scan(ON)
    receiver.beat(0)
    receiver.scan(ON)
    assert receiver.writes == [ENABLE, ENABLE]


def test_the_daemons_end_keeps_or_stops_the_charge_as_the_yaml_says() -> None:
    receiver = Receiver()
    receiver.made("keep").make_safe()
    assert receiver.writes == []
    receiver.made("stop").make_safe()
    assert receiver.writes == [DISABLE]


def test_a_receiver_that_may_be_on_is_switched_off_when_it_is_let_go(receiver: Receiver) -> None:
    receiver.scan(ON)
    receiver.driver.close()
    receiver.driver.close()
    assert receiver.writes == [ENABLE, DISABLE]


def test_letting_go_of_a_receiver_that_does_not_answer_raises_nothing(receiver: Receiver) -> None:
    receiver.scan(ON)
    receiver.silent = {(0x2000, 1)}
    receiver.driver.close()
    assert receiver.writes == [ENABLE, DISABLE]


# ---- settings


def test_the_canopen_example_is_right_and_says_what_is_untried() -> None:
    [no_station, untried] = load(EXAMPLE).warnings
    assert "is not a station" in str(no_station)
    assert "nobody has tried" in str(untried)


def test_facts_that_the_yaml_cannot_supply_are_warned_of() -> None:
    made = CanOpenChargerSettings(node=10, heartbeat="none", receivers={"7": "tiny/r1"})
    paths = [path for path, _ in warnings(made)]
    assert paths == [(), (), ("heartbeat",), ("receivers",)]


def test_check_prints_objects_and_meanings() -> None:
    rows = dict(describe(CanOpenChargerSettings(node=10), hal.CanSettings(socketcan="can0")))
    assert rows["bus"] == "can0, at the bitrate that `ip link` gave it; node 10"
    assert rows["heartbeat"] == "each 0.1 s, lost after 0.5 s"
    assert rows["volts"] == "read SDO 0x2002:06"
    assert rows["power"] == "write SDO 0x2000:01: 1 starts from idle, 0 stops"
    assert rows["state charging"] == "5"
    assert rows["any other state"] == "error, with its number"


def test_one_node_is_one_charger(tmp_path: Path) -> None:
    text = EXAMPLE.read_text("utf-8")
    file = tmp_path / "two.yaml"
    file.write_text(text + "  charger_x: {node: 10}\n", "utf-8")
    with pytest.raises(SettingsError) as caught:
        load(file)
    [problem] = caught.value.problems
    assert "node 10 is used by charger_b node" in str(problem)


@pytest.mark.parametrize("node", [0, 128])
def test_a_node_number_that_canopen_does_not_have_is_refused(tmp_path: Path, node: int) -> None:
    file = tmp_path / "charger.yaml"
    file.write_text(EXAMPLE.read_text("utf-8").replace("node: 10", f"node: {node}"), "utf-8")
    with pytest.raises(SettingsError):
        load(file)
