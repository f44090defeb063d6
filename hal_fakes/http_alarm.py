"""An alarm panel on HTTP. The YAML names the fields that show the plant's sources.

`hal_fakes/http.py` describes the failures of server, headers and body.
"""

import json
import time
from collections.abc import Mapping, Sequence
from typing import Final

from bridges.kinds.alarm.signals import DRILL
from drivers.alarm.http import HttpPanelSettings
from drivers.hal.points import Wire
from drivers.json_fields import JsonFlag
from hal_fakes.fake import Fake
from hal_fakes.http import Asked
from hal_fakes.json_answers import put, value_of
from hal_fakes.plants.alarm import PanelPlant
from hal_fakes.plants.plant import Plant

PARTS: Final = ("server", "headers", "body")


def fields(settings: HttpPanelSettings) -> dict[str, JsonFlag]:
    """Return the field of each source. The drill is among the sources."""
    drill = {DRILL: settings.drill} if settings.drill else {}
    return {**settings.sources, **drill}


class FakeHttpPanel:
    """A controller (`hal_fakes.http.HttpStation`) that obeys no command."""

    def __init__(self, plant: Plant, settings: HttpPanelSettings) -> None:
        self.plant = plant
        self.reads: Sequence[Asked] = [("GET", settings.state_path, "")]
        self.commands: Mapping[Asked, tuple[str, bool]] = {}
        self._settings = settings
        self._last: bytes | None = None

    def obey(self, signal: str, asserted: bool) -> None:
        """Do nothing, because there is no command."""

    def tick(self) -> None:
        """Do nothing, because the controller has no timer."""

    def answer(self, asked: Asked) -> bytes:
        """Return the present answer to `GET state_path`. In the failure mode `wrong`, return a wrong
        answer."""
        self.plant.advance(time.monotonic())
        server, body = self.plant.failures.get("server"), self.plant.failures.get("body")
        if server == "stuck" and self._last is not None:
            return self._last
        said: dict[str, object] = {}
        for signal, place in fields(self._settings).items():
            wrong = "wrong" in (server, body)
            put(said, place.field, ["?"] if wrong else value_of(place, self.plant.sense(signal)))
        self._last = json.dumps(said).encode()
        return {"off": b"", "garbage": self._last[:-9]}.get(body or "", self._last)


FAKE = Fake[HttpPanelSettings](
    plant=lambda name, settings, wires: PanelPlant(
        name, [Wire(s, "in", s, "high") for s in fields(settings)], PARTS
    ),
    station=lambda plant, settings: FakeHttpPanel(plant, settings),
)
