"""A door on an HTTP relay. The YAML names the fields that show the plant's contacts.

The relay switches itself off when its timer is not renewed.
"""

import time

from drivers.door.http import HOLD, HttpDoorSettings
from hal_fakes.fake import Fake
from hal_fakes.http_flags import PARTS, FlagStation, contacts, flags
from hal_fakes.json_answers import asked, put, value_of
from hal_fakes.plants import door
from hal_fakes.plants.plant import Plant


class FakeHttpDoor(FlagStation):
    """A controller with a relay. Each command restarts the relay's timer."""

    def __init__(self, plant: Plant, settings: HttpDoorSettings) -> None:
        super().__init__(plant, settings.state_path, flags(settings.inputs))
        self.commands = {
            asked(settings.hold): (HOLD, True),
            asked(settings.release): (HOLD, False),
        }
        self._settings = settings
        self._on = False
        self._off_at = float("inf")

    def obey(self, signal: str, asserted: bool) -> None:
        """Switch the relay, and restart its timer."""
        now, after_s = time.monotonic(), self._settings.switches_off_after_s
        self._on = asserted
        self._off_at = now + after_s if asserted and after_s else float("inf")
        self.plant.drive(signal, asserted, now)

    def tick(self) -> None:
        """Switch the relay off when its timer has run out. Advance the plant to the present time."""
        if time.monotonic() >= self._off_at:
            self.obey(HOLD, False)
        super().tick()

    def add(self, said: dict[str, object]) -> None:
        """Add the relay's own state to the answer `said`."""
        if held := self._settings.held:
            put(said, held.field, value_of(held, self._on))


FAKE = Fake[HttpDoorSettings](
    plant=lambda name, settings, wires: door.build(
        name, settings, contacts(flags(settings.inputs), HOLD), PARTS
    ),
    station=lambda plant, settings: FakeHttpDoor(plant, settings),
)
