"""The far side of a `can` bus: simulated controllers in a separate process. The daemon reaches them
through a simulated slcan adapter (CAN frames as text) on a pseudo-terminal.

`side.py` lists the failures of the bus. `canopen_rcu.py` lists the failures of a CANopen receiver.
`frame_charger.py` lists the failures of a charger that speaks its maker's own CAN frames.
"""

from collections.abc import Sequence

from drivers.hal.can import CanSettings
from hal_fakes.can.side import CanFarSide, CanStation, slow_s
from hal_fakes.can.slcan_port import SlcanPort
from hal_fakes.fake import Outside


def serve(settings: CanSettings, stations: Sequence[CanStation]) -> CanFarSide:
    """Serve the chargers of this bus on a pseudo-terminal."""
    return CanFarSide(SlcanPort(settings.slcan), stations, slow_s(settings))


FAKE = Outside(serve)
