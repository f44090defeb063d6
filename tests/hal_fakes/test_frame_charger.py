"""The fake charger on CAN charges only while it receives frames."""

import can
import msgspec

from bridges.kinds.charger.signals import ChargerOutputs
from drivers.charger.can_frames import FrameChargerSettings, create
from hal_fakes.can.frame_charger import PERIODS, STATUS_S, FrameCharger
from hal_fakes.plants.charger import ChargerPlant
from tests.drivers.hal.can.far_end import Reactive

SETTINGS = msgspec.convert(
    {"profile": "wiferion", "setpoints": {"max_volts": 29.4, "volts": 29.2, "amps": 30}},
    FrameChargerSettings,
)
FED_EVERY_S = 0.5


class Bench:
    """A simulated charger on CAN, and the driver that sends frames to it, in virtual time."""

    def __init__(self) -> None:
        self.far = Reactive()
        self.plant = ChargerPlant("a", commanded=True)
        self.station = FrameCharger(self.plant, SETTINGS)
        self.far.react = self._hear
        bus = self.far.bus()
        bus.take()
        self.driver = create("a", SETTINGS, bus)
        self.driver.open()

    def passes(self, seconds: float, fed: bool) -> None:
        """Let time pass, while the charger checks its bus regularly. If `fed` is true, the driver sends
        frames."""
        until = self.far.now + seconds
        while self.far.now < until:
            self.far.now += STATUS_S / 2
            self.station.tick(self.far.now, self._send)
            if fed:
                self.driver.read()
                self.driver.write(ChargerOutputs(True))

    def _hear(self, message: can.Message) -> list[can.Message]:
        self.station.hear(message, self.far.now, self._send)
        return []

    def _send(self, message: can.Message, late: bool = False) -> None:
        self.far.coming.append(message)

    def enabled(self) -> list[object]:
        return [edge.value for edge in self.plant.edges if edge.signal == "power"]


def test_a_charger_charges_while_frames_arrive_and_stops_three_periods_after_the_last_frame() -> (
    None
):
    bench = Bench()
    bench.passes(5.0, fed=True)
    bench.passes((PERIODS - 1) * FED_EVERY_S - STATUS_S, fed=False)
    assert bench.enabled() == [True]
    bench.passes(FED_EVERY_S + STATUS_S, fed=False)
    assert bench.enabled() == [True, False]


def test_a_short_delay_on_a_busy_machine_does_not_end_the_charge() -> None:
    bench = Bench()
    bench.passes(5.0, fed=True)
    bench.far.now += 10.0
    bench.passes(STATUS_S / 2, fed=False)
    assert bench.enabled() == [True]
