"""A dispenser or ingestor behind HTTP. The YAML names the fields that show the plant's contacts.

The plant takes a start as a pulse. `hal_fakes/http.py` describes the failures of server, headers and
body.
"""

import json
import time
from collections.abc import Mapping, Sequence
from typing import Final

from drivers.dispenser.http import HttpWorkcellSettings
from drivers.hal.points import Wire
from hal_fakes.fake import Fake
from hal_fakes.http import ANY_BODY, Asked
from hal_fakes.json_answers import put, value_of
from hal_fakes.plants.dispenser import WorkcellPlant
from hal_fakes.plants.plant import Plant

PARTS: Final = ("server", "headers", "body")


def contacts(settings: HttpWorkcellSettings) -> list[Wire]:
    """Return the controller's own contacts and relay. The plant needs them, because they can fail in
    the same way as the daemon's wires."""
    fields = settings.inputs.__struct_fields__
    inputs = [Wire(s, "in", s, "high") for s in fields if getattr(settings.inputs, s)]
    return [*inputs, Wire("start", "out", "start", "high")]


class FakeHttpWorkcell:
    """A controller (`hal_fakes.http.HttpStation`)."""

    def __init__(self, plant: Plant, settings: HttpWorkcellSettings) -> None:
        self.plant = plant
        self.reads: Sequence[Asked] = [("GET", settings.state_path, "")]
        self.commands: Mapping[Asked, tuple[str, bool]] = {
            (call.method, call.path, ANY_BODY): ("start", on)
            for call, on in ((settings.start, True), (settings.stop, False))
            if call is not None
        }
        self._settings = settings
        self._last: bytes | None = None

    def obey(self, signal: str, asserted: bool) -> None:
        """Start or end a cycle."""
        self.plant.drive(signal, asserted, time.monotonic())

    def tick(self) -> None:
        """Let the plant run."""
        self.plant.advance(time.monotonic())

    def answer(self, asked: Asked) -> bytes:
        """Return the present answer to `GET state_path`. In the failure mode `wrong`, return a wrong
        answer."""
        self.tick()
        server, body = self.plant.failures.get("server"), self.plant.failures.get("body")
        if server == "stuck" and self._last is not None:
            return self._last
        said: dict[str, object] = {}
        found = self._settings.inputs
        signals = [one for one in found.__struct_fields__ if getattr(found, one)]
        for signal in sorted(signals, key=self.plant.sense):  # several signals may share a field
            place = getattr(found, signal)
            if self.plant.sense(signal) or place.field not in said:
                put(said, place.field, value_of(place, self.plant.sense(signal)))
            if "wrong" in (server, body):
                put(said, place.field, ["?"])
        self._last = json.dumps(said).encode()
        return {"off": b"", "garbage": self._last[:-9]}.get(body or "", self._last)


FAKE = Fake[HttpWorkcellSettings](
    plant=lambda name, settings, wires: WorkcellPlant(
        name, contacts(settings), steady=True, parts=PARTS
    ),
    station=lambda plant, settings: FakeHttpWorkcell(plant, settings),
)
