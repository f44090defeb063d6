"""A dispenser or ingestor behind HTTP. The YAML names the fields that show the plant's contacts.

The command `start` switches the plant's relay `start` on, and the command `stop` switches it off. The
relay must stay on during a cycle.
"""

from drivers.dispenser.http import HttpWorkcellSettings
from hal_fakes.fake import Fake
from hal_fakes.http import ANY_BODY
from hal_fakes.http_flags import PARTS, FlagStation, contacts, flags
from hal_fakes.plants.dispenser import WorkcellPlant
from hal_fakes.plants.plant import Plant


class FakeHttpWorkcell(FlagStation):
    """A controller that starts and ends cycles."""

    def __init__(self, plant: Plant, settings: HttpWorkcellSettings) -> None:
        super().__init__(plant, settings.state_path, flags(settings.inputs))
        self.commands = {
            (call.method, call.path, ANY_BODY): ("start", on)
            for call, on in ((settings.start, True), (settings.stop, False))
            if call is not None
        }


FAKE = Fake[HttpWorkcellSettings](
    plant=lambda name, settings, wires: WorkcellPlant(
        name, contacts(flags(settings.inputs), "start"), steady=True, parts=PARTS
    ),
    station=lambda plant, settings: FakeHttpWorkcell(plant, settings),
)
