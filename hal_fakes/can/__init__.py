"""The far side of a `can` bus, in a separate process. Controllers are behind an slcan adapter on a
pseudo-terminal.

`side.py` lists the failures of the bus. `canopen_rcu.py` lists the failures of a CANopen receiver, and
`frame_charger.py` those of a charger with its maker's own frames.
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
