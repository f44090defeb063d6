"""A fake alarm panel on HTTP. The device's YAML names the JSON field that shows each alarm source, such
as a fire or a drill."""

from bridges.kinds.alarm.signals import DRILL
from drivers.alarm.http import HttpPanelSettings
from drivers.json_fields import JsonFlag
from hal_fakes.fake import Fake
from hal_fakes.http_flags import PARTS, FlagStation, contacts
from hal_fakes.plants.alarm import PanelPlant


def fields(settings: HttpPanelSettings) -> dict[str, JsonFlag]:
    """Return the field of each source. The drill is among the sources."""
    drill = {DRILL: settings.drill} if settings.drill else {}
    return {**settings.sources, **drill}


FAKE = Fake[HttpPanelSettings](
    plant=lambda name, settings, wires: PanelPlant(name, contacts(fields(settings)), PARTS),
    station=lambda plant, settings: FlagStation(plant, settings.state_path, fields(settings)),
)
