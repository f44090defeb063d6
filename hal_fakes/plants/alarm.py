"""An alarm panel. Its contacts change only when people or the building press them; nothing moves.

To press: each source (`fire_panel on`), and `drill`. A loop that is cut (`fail fire_panel off`), that
jams (`stuck`) or chatters (`garbage`) fails as every wire does (`contact.py`). At a Modbus module
`unit` and `server` can fail too. With `off` the panel goes silent.
"""

from collections.abc import Iterable

from bridges.kinds.alarm.settings import PanelSettings
from drivers.hal.points import Wire
from hal_fakes.fake import Fake
from hal_fakes.plants.machine import WiredPlant


class PanelPlant(WiredPlant):
    """The panel. `parts` are the parts of its controller that can fail."""

    def __init__(self, name: str, wires: Iterable[Wire] = (), parts: Iterable[str] = ()) -> None:
        wired = list(wires)
        super().__init__(name, wired, parts, [wire.signal for wire in wired])

    def contact(self, signal: str) -> bool:
        """Is this contact really asserted?"""
        return self.pressed[signal]

    def run(self) -> None:
        """Do nothing, because a panel changes only when somebody presses it."""

    def event_at(self) -> float:
        """Return inf, because nothing happens by itself."""
        return float("inf")


FAKE = Fake[PanelSettings](plant=lambda name, settings, wires: PanelPlant(name, wires))
