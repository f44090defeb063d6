"""A charger on CAN that stays silent until a frame wakes it, as CANopen nodes do after an NMT reset."""

import itertools
from typing import Any

import can
import msgspec
import pytest

from bridges.kinds.charger.signals import Activity, ChargerOutputs
from drivers.charger import can_frames
from drivers.charger.can_frames import FrameChargerSettings, claims, create, frame_tables
from drivers.charger.can_map import FrameMap
from drivers.hal.can import CanBus
from drivers.hal.can import CanSettings as BusSettings
from hal_fakes.can.side import VirtualBus
from tests.drivers.charger.contract import ON
from tests.drivers.charger.test_can_rules import MAP
from tests.drivers.charger.test_contract_can import TIMEOUT_S, on_a_bus
from tests.drivers.hal.can.far_end import Clock, Reactive, channel, failure
from tests.waiting import wait_until

WAKE = {"frame": "NmtStart", "every_s": 1, "says": {"Command": 1, "Node": 10}}
WOKEN: dict[str, Any] = {**MAP, "wake": [WAKE]}
START, STOP, CHARGE = (0x000, "010a"), (0x200, "00"), (0x200, "01")


class Sleeper:
    """A charger in virtual time. While the test sets `awake`, the charger broadcasts its status.

    `got` has (time in s, (id, payload)) for each frame from the driver.
    """

    def __init__(self) -> None:
        self.far = Reactive()
        self.far.react = self._hear
        self.got: list[tuple[float, tuple[int, str]]] = []
        self.awake = False
        self.bus = self.far.bus()
        self.driver = create("c", msgspec.convert({"map": WOKEN}, FrameChargerSettings), self.bus)
        self.bus.take()
        self.driver.open()

    def _hear(self, message: can.Message) -> list[can.Message]:
        sent = message.arbitration_id, bytes(message.data).hex()
        self.got.append((round(self.far.now, 1), sent))
        return []

    def scans(self, for_s: float, power: bool | None) -> list[tuple[float, tuple[int, str]]]:
        """Scan for `for_s` seconds. Return (time in s, (id, payload)) for each frame that the driver
        sent.

        The outputs are written only after the first good reading.
        """
        self.got.clear()
        until = self.far.now + for_s
        while self.far.now < until:
            if self.awake:
                self.far.say(0x100, "0000000000000000")
                self.far.say(0x101, "00001267")
            if not failure(self.driver.read) or self.driver._power is not None:
                self.driver.write(ChargerOutputs(power=power))
            self.far.now += 0.05
        return list(self.got)


def test_before_its_first_reading_a_charger_gets_what_wakes_it_and_nothing_else() -> None:
    sleeper = Sleeper()
    sent = sleeper.scans(3.0, power=None)
    assert {frame for _, frame in sent} == {START}
    times = [at for at, _ in sent]
    gaps_s = [after - before for before, after in itertools.pairwise(times)]
    assert all(0.9 <= gap_s <= 1.1 for gap_s in gaps_s)
    assert len(times) == 3


def test_a_charger_that_is_heard_is_not_woken() -> None:
    sleeper = Sleeper()
    sleeper.awake = True
    assert {frame for _, frame in sleeper.scans(3.0, power=True)} == {CHARGE}


def test_one_that_falls_asleep_in_a_charge_is_told_to_stop_and_woken_and_gets_no_power() -> None:
    sleeper = Sleeper()
    sleeper.awake = True
    sleeper.scans(2.0, power=True)
    sleeper.awake = False
    sleeper.scans(1.5, power=True)  # a status counts as fresh for 1 s
    assert {frame for _, frame in sleeper.scans(3.0, power=True)} == {START, STOP}


def test_the_station_itself_is_woken_charges_sleeps_when_it_was_off_and_is_woken_again() -> None:
    name = channel()
    settings = BusSettings(socketcan="can0", timeout_s=TIMEOUT_S, scan_s=0.1)
    bus = CanBus(settings, Clock(), lambda: 0.0, lambda: can.Bus(name, interface="virtual"))
    with on_a_bus(can_frames, {"map": WOKEN}, VirtualBus(name), bus) as bench:
        bench.driver.open()
        wait_until(lambda: bench.sample(ON) is not None, "the woken station is heard")
        bench.press("robot")
        bench.until(Activity.CHARGING, ON)
        bench.plant.fail("node", "off")
        wait_until(lambda: bench.sample(ON) is None, "the switched-off station is silent")
        bench.plant.fail("node", None)
        wait_until(lambda: bench.sample(ON) is not None, "the station is heard again")
        bench.driver.close()


@pytest.mark.parametrize(
    ("wake", "path", "text"),
    [
        (
            {"frame": "Command", "says": {"Enable": 1}},
            ("frame",),
            "Command is a frame of send too, so it could start a charge; name another",
        ),
        ({"frame": "Nmt"}, ("frame",), "unknown frame 'Nmt': known here"),
        ({"says": {"Comand": 1, "Node": 10}}, ("says", "Comand"), "unknown signal of NmtStart"),
        ({"says": {"Command": 1}}, ("says",), "NmtStart: "),
        ({"says": {"Command": 1, "Node": 300}}, ("says",), "NmtStart: "),
    ],
)
def test_what_wakes_it_is_a_frame_of_the_dbc_file_that_does_not_charge(
    wake: dict[str, Any], path: tuple[str, ...], text: str
) -> None:
    found = list(msgspec.convert({**MAP, "wake": [WAKE | wake]}, FrameMap).problems())
    assert [(at, said[: len(text)]) for at, said in found] == [(("wake", "0", *path), text)]


@pytest.mark.parametrize("every_s", [0, 0.19, 61])
def test_the_period_of_what_wakes_it_is_bounded(every_s: float) -> None:
    with pytest.raises(msgspec.ValidationError, match="every_s"):
        msgspec.convert({**MAP, "wake": [WAKE | {"every_s": every_s}]}, FrameMap)


def test_a_scan_too_slow_to_wake_it_in_time_is_refused() -> None:
    slow = {**MAP, "send": [MAP["send"][0] | {"every_s": 5}]}
    settings = msgspec.convert({"map": {**slow, "wake": [WAKE]}}, FrameChargerSettings)
    bus = CanBus(BusSettings(socketcan="can0", scan_s=2.0))
    assert failure(create("c", settings, bus).open).startswith("NmtStart must be sent every 1 s")


def test_another_device_may_send_nmt_frames_too_but_no_other_frame_that_wakes() -> None:
    poke = {"frame": "Poke", "every_s": 1, "says": {"Byte": 1}}
    settings = msgspec.convert({"map": {**MAP, "wake": [WAKE, poke]}}, FrameChargerSettings)
    places = [place for place, _ in claims(settings)]
    assert ("frame 0x301" in places, "frame 0x000" in places) == (True, False)


def test_check_prints_what_wakes_it() -> None:
    sent, _ = frame_tables(msgspec.convert({"map": WOKEN}, FrameChargerSettings))
    woken = ("NmtStart", "0x000", "charger silent", "1 s", "01 0A", "Command 1, Node 10")
    assert sent.rows[-1] == woken
