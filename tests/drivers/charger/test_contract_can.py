"""Chargers on CAN: the contract of every charger, and more rules for a robot on the pad."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

import can
import msgspec
import pytest

from bridges.kinds.charger.signals import CURRENT_FLOWS, Activity, ChargerOutputs, ChargerSample
from drivers import DriverError
from drivers.charger import can_frames as charger_can_frames
from drivers.charger import canopen as charger_canopen
from drivers.hal.can import CanBus, CanSettings, Slcan
from hal_fakes.can.side import CanFarSide, Medium, VirtualBus
from hal_fakes.can.slcan_port import SlcanPort
from tests.drivers.charger.contract import (
    OFF,
    ON,
    Bench,
    ChargerContract,
    behind,
    news,
)
from tests.drivers.hal.can.far_end import Clock, channel
from tests.waiting import wait_until

TIMEOUT_S = 0.15
WIFERION: dict[str, Any] = {
    "profile": "wiferion",
    "setpoints": {"max_volts": 29.4, "volts": 29.2, "amps": 30},
}


class PadBench(Bench):
    """A bench for range checks. The result of a check becomes valid 1 s after the check."""

    def sample(self, outputs: ChargerOutputs) -> ChargerSample | None:
        """Run one scan, and return the reading, or None if the station cannot be read."""
        try:
            sample = self.driver.read()
        except DriverError:
            return None
        self.driver.write(outputs)
        return sample

    def fault(self) -> ChargerSample:
        """Scan until the station shows an error, and return the reading with this error."""
        found: list[ChargerSample] = []

        def failed() -> bool:
            sample = self.sample(ON)
            found.extend([sample] if sample and sample.activity is Activity.ERROR else [])
            return bool(found)

        wait_until(failed, "the station shows an error")
        return found[0]

    def in_range(self) -> bool | None:
        """Return the result of a new range check."""
        asked = ChargerOutputs(False, range_checks=len(self.switched("range_check")) + 1)
        wait_until(lambda: self.sample(asked) is not None, "the range check is sent")
        self.clock.now += 2.0
        samples: list[ChargerSample] = []

        def read() -> bool:
            samples.extend(sample for sample in [self.sample(asked)] if sample)
            return len(samples) >= 5

        wait_until(read, "the result of the range check is read")
        return samples[-1].measured.in_range


@contextmanager
def on_a_bus(driver: Any, plain: dict[str, Any], medium: Medium, bus: CanBus) -> Iterator[PadBench]:
    """Yield a bench whose station is on this medium."""
    settings = msgspec.convert(plain, driver.DRIVER.settings)
    world, station = behind(driver, settings)
    side = CanFarSide(medium, [station], slow_s=2 * TIMEOUT_S)

    assert isinstance(bus.now, Clock)
    try:
        yield PadBench(news(driver, settings, bus), world.plants["a"], bus.now)
    finally:
        bus.close()
        side.close()
        world.close()


class CanContract(ChargerContract):
    """The contract on CAN. A subclass chooses the driver and its settings."""

    cut = "bus"
    parts: ClassVar[tuple[str, ...]] = ("node", "bus")
    driver: ClassVar[Any] = None
    settings: ClassVar[dict[str, Any]]

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        with self.pads() as bench:
            yield bench

    @pytest.fixture
    def pad(self) -> Iterator[PadBench]:
        with self.pads() as bench:
            bench.driver.open()
            yield bench
            bench.driver.close()

    @contextmanager
    def pads(self) -> Iterator[PadBench]:
        """Yield a bench on python-can's virtual bus."""
        name = channel()
        vendor: Callable[[], can.BusABC] = lambda: can.Bus(name, interface="virtual")  # noqa: E731
        settings = CanSettings(socketcan="can0", timeout_s=TIMEOUT_S, scan_s=0.1)
        bus = CanBus(settings, Clock(), lambda: 0.0, vendor)
        with on_a_bus(self.driver, self.settings, VirtualBus(name), bus) as bench:
            yield bench

    def test_a_robot_that_stands_well_is_in_range_and_one_that_does_not_is_not(
        self, pad: PadBench
    ) -> None:
        pad.press("robot")
        wait_until(lambda: pad.in_range() is True, "the pad has risen to the robot")
        pad.press("misparked")
        assert pad.in_range() is False

    def test_a_pad_that_does_not_rise_leaves_the_robot_out_of_range(self, pad: PadBench) -> None:
        pad.plant.fail("pad", "stuck")
        pad.press("robot")
        assert [pad.in_range() for _ in range(3)] == [False] * 3

    def test_a_fault_of_the_station_is_blamed_on_the_station(self, pad: PadBench) -> None:
        pad.press("robot")
        pad.until(Activity.CHARGING, ON)
        pad.press("transmitter_fault")
        sample = pad.fault()
        assert (sample.side, sample.error_text != "") == ("station", True)

    def test_a_fault_of_the_robot_is_blamed_on_the_robot_and_over_when_it_has_gone(
        self, pad: PadBench
    ) -> None:
        pad.press("robot")
        pad.until(Activity.CHARGING, ON)
        pad.plant.fail("thermometer", "off")
        sample = pad.fault()
        assert (sample.side, sample.error_text != "") == ("robot", True)
        pad.plant.fail("thermometer", None)
        wait_until(
            lambda: pad.scan(OFF) is Activity.IDLE, "the station is idle after the robot has gone"
        )

    def test_current_and_voltage_are_those_at_the_battery(self, pad: PadBench) -> None:
        pad.press("robot")
        pad.until(Activity.CHARGING, ON)
        measured = pad.driver.read().measured
        assert (measured.amps, 24.0 < (measured.volts or 0.0) < 29.3) == (30.0, True)

    def test_a_battery_that_is_full_ends_the_charge(self, pad: PadBench) -> None:
        pad.press("robot")
        pad.until(Activity.CHARGING, ON)
        pad.press("robot", False)
        pad.plant.fail("battery", "wrong")
        pad.press("robot")
        wait_until(lambda: pad.scan(ON) not in CURRENT_FLOWS, "the full battery ends the charge")

    def test_no_failure_on_the_way_to_a_free_station_reads_as_a_charge(self, pad: PadBench) -> None:
        pad.until(Activity.IDLE, OFF)
        for part in self.parts:
            for mode in ("off", "stuck", "slow", "garbage", "wrong"):
                pad.plant.fail(part, mode)
                assert not {pad.does() for _ in range(2)} & CURRENT_FLOWS
            pad.plant.fail(part, None)
        wait_until(lambda: pad.does() is Activity.IDLE, "the station is idle after the failure")

    def test_make_safe_and_close_each_end_a_charge(self) -> None:
        for end in ("make_safe", "close"):
            with self.pads() as pad:
                pad.driver.open()
                pad.press("robot")
                pad.until(Activity.CHARGING, ON)
                getattr(pad.driver, end)()
                wait_until(lambda p=pad: p.switched() == [True, False], end)  # type: ignore[misc]
                pad.driver.close()


class OnAnAdapter(CanContract):
    """The same contract behind an slcan adapter."""

    @contextmanager
    def pads(self) -> Iterator[PadBench]:
        port = SlcanPort()
        place = msgspec.convert(port.replace["slcan"], Slcan)
        settings = CanSettings(slcan=place, timeout_s=TIMEOUT_S, scan_s=0.1)
        bus = CanBus(settings, Clock(), lambda: 0.0)
        with on_a_bus(self.driver, self.settings, port, bus) as bench:
            yield bench


class CanOpen(CanContract):
    """The contract with Xnergy's receiver on CANopen."""

    link = "heartbeat"
    parts = ("node", "heartbeat", "bus")
    driver: ClassVar = charger_canopen
    settings: ClassVar = {"node": 10}

    def test_a_node_that_was_without_supply_has_forgotten_its_start_and_so_have_we(
        self, pad: PadBench
    ) -> None:
        pad.press("robot")
        pad.until(Activity.CHARGING, ON)
        pad.plant.fail("node", "off")
        wait_until(lambda: pad.does() is None, "the loss of the node is noticed")
        pad.plant.fail("node", None)
        wait_until(lambda: pad.does() is Activity.IDLE, "the node reads idle again")
        pad.until(Activity.CHARGING, ON)
        assert pad.switched() == [True, False, True]


class TestACanOpenReceiver(CanOpen):
    pass


class TestACanOpenReceiverBehindAnAdapter(CanOpen, OnAnAdapter):
    pass


class Frames(CanContract):
    """The contract with Wiferion's charger. This charger reports no foreign object, and checks the
    range without a command."""

    link = "node"
    foreign_object = "the station is too hot"
    driver: ClassVar = charger_can_frames
    settings: ClassVar = WIFERION

    def test_a_check_of_the_range_is_sent_once_for_a_rise(self, bench: Bench) -> None:
        bench.driver.open()
        wait_until(lambda: bench.does() is not None, "the charger is read")
        bench.driver.write(ChargerOutputs(False, range_checks=1))
        assert self.checks(bench) == []

    def test_the_daemons_end_stops_a_charge_or_keeps_it_as_the_yaml_says(
        self, bench: Bench
    ) -> None:
        bench.press("robot")
        bench.until(Activity.CHARGING, ON)
        bench.driver.make_safe()
        bench.until(Activity.IDLE, OFF)
        assert bench.switched() == [True, False]

    def test_the_receiver_id_is_read_and_is_empty_without_a_robot(self, pad: PadBench) -> None:
        def sees(receiver: str) -> bool:
            sample = pad.sample(OFF)
            return sample is not None and sample.measured.receiver_id == receiver

        wait_until(lambda: sees(""), "the receiver id is empty without a robot")
        pad.press("robot")
        wait_until(lambda: sees("4711"), "the robot's id is read")
        pad.press("robot", False)
        pad.press("stranger")
        wait_until(lambda: sees("815"), "the stranger's id is read")

    def test_a_daemon_that_falls_silent_stops_the_charge(self, pad: PadBench) -> None:
        pad.press("robot")
        pad.until(Activity.CHARGING, ON)
        wait_until(
            lambda: pad.switched() == [True, False], "the charger stops when no frames feed it"
        )

    def test_a_charger_that_is_not_seen_is_not_fed(self, pad: PadBench) -> None:
        pad.press("robot")
        pad.until(Activity.CHARGING, ON)
        pad.plant.fail("node", "garbage")

        def unfed() -> bool:
            if pad.does() is None:
                pad.driver.write(ON)
            return pad.switched() == [True, False]

        wait_until(unfed, "the charger that is not seen stops")


class TestWiferion(Frames):
    pass


class TestWiferionBehindAnAdapter(Frames, OnAnAdapter):
    pass
