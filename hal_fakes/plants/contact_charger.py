"""A charging station on contacts: an enable relay, and contacts that say what it does.

It is `charger.py`'s station with a terminal block: `charging` while current flows, `ready` while
it could charge, `fault` in an error, which ends when its cause has gone, `at_height` and `range_ok`
of the pad.
"""

from collections.abc import Sequence

from bridges.charger.signals import CURRENT_FLOWS, Activity
from drivers.charger.dry_contact import Settings
from drivers.hal.points import Wire
from hal_fakes.fake import Fake
from hal_fakes.plants.charger import CAUSES, ChargerPlant
from hal_fakes.plants.machine import Machine

NOT_READY = frozenset({Activity.ERROR, Activity.RELEASED})


class ContactCharger(ChargerPlant):
    """The station behind these wires."""

    def __init__(self, name: str, wires: Sequence[Wire], pace: float = 1.0) -> None:
        super().__init__(name, commanded=True, pace=pace, wires=wires)

    def drive(self, signal: str, asserted: bool, now: float) -> None:
        """The enable relay."""
        Machine.drive(self, signal, asserted, now)

    def sense(self, signal: str) -> bool:
        """A contact as its wire shows it."""
        return Machine.sense(self, signal)

    def actuate(self, signal: str, energised: bool) -> None:
        """The relay has reached the station."""
        self.power = energised

    def contact(self, signal: str) -> bool:
        """Is this contact asserted, in truth?"""
        if signal == "charging":
            return self.activity in CURRENT_FLOWS
        if signal == "fault":
            return self.activity is Activity.ERROR
        if signal == "at_height":
            return self.risen()
        if signal == "range_ok":
            return self.coupled()
        return self.activity not in NOT_READY if signal == "ready" else super().contact(signal)

    def run(self) -> None:
        """An error ends by itself when its cause has gone."""
        if self.activity is Activity.ERROR and not any(map(super().contact, CAUSES)):
            self.error_text = ""
            self._enter(Activity.IDLE)
        super().run()


def build(name: str, settings: Settings, wires: Sequence[Wire]) -> ContactCharger:
    """A station with these contacts."""
    return ContactCharger(name, wires)


FAKE = Fake(plant=build)
