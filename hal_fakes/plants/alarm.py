"""A simulated alarm panel. Its contacts change only through the order `press`, which stands for a
person or the building.

The signals to press are each source (`fire_panel on`) and `drill`. The wire of each contact can fail as
every wire can (`contact.py`): cut (`fail fire_panel off`), jammed (`stuck`) or chattering (`garbage`).
If the panel is at a Modbus module, the parts `unit` and `server` can fail too. In their mode `off` the
panel goes silent.
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
        """Is this contact asserted at the panel? The contact's wire may show another value."""
        return self.pressed[signal]

    def run(self) -> None:
        """Do nothing, because a panel changes only when somebody presses it."""

    def event_at(self) -> float:
        """Return inf, because nothing happens by itself."""
        return float("inf")


FAKE = Fake[PanelSettings](plant=lambda name, settings, wires: PanelPlant(name, wires))
