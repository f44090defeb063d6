"""A door on an HTTP relay. The YAML names the fields that show the plant's contacts.

The relay switches itself off when its timer is not renewed. `hal_fakes/http.py` describes the failures
of server, headers and body.
"""

import json
import time
from collections.abc import Mapping, Sequence
from typing import Final

from drivers.door.http import HOLD, HttpDoorSettings
from drivers.hal.points import Wire
from hal_fakes.fake import Fake
from hal_fakes.http import Asked
from hal_fakes.json_answers import asked, put, value_of
from hal_fakes.plants import door
from hal_fakes.plants.plant import Plant

PARTS: Final = ("server", "headers", "body")


def contacts(settings: HttpDoorSettings) -> list[Wire]:
    """Return the controller's own contacts and relay. The plant needs them, because they can fail in
    the same way as the daemon's wires."""
    fields = settings.inputs.__struct_fields__
    inputs = [Wire(s, "in", s, "high") for s in fields if getattr(settings.inputs, s)]
    return [*inputs, Wire(HOLD, "out", HOLD, "high")]


class FakeHttpDoor:
    """A controller (`hal_fakes.http.HttpStation`)."""

    def __init__(self, plant: Plant, settings: HttpDoorSettings) -> None:
        self.plant = plant
        self.reads: Sequence[Asked] = [("GET", settings.state_path, "")]
        self.commands: Mapping[Asked, tuple[str, bool]] = {
            asked(settings.hold): (HOLD, True),
            asked(settings.release): (HOLD, False),
        }
        self._settings = settings
        self._on = False
        self._off_at = float("inf")
        self._last: bytes | None = None

    def obey(self, signal: str, asserted: bool) -> None:
        """Switch the relay, and restart its timer."""
        now, after_s = time.monotonic(), self._settings.switches_off_after_s
        self._on = asserted
        self._off_at = now + after_s if asserted and after_s else float("inf")
        self.plant.drive(signal, asserted, now)

    def tick(self) -> None:
        """Switch the relay off when its timer has run out."""
        if time.monotonic() >= self._off_at:
            self.obey(HOLD, False)

    def answer(self, asked: Asked) -> bytes:
        """Return the present answer to `GET state_path`. In the failure mode `wrong`, return a wrong
        answer."""
        self.tick()
        self.plant.advance(time.monotonic())
        server, body = self.plant.failures.get("server"), self.plant.failures.get("body")
        if server == "stuck" and self._last is not None:
            return self._last
        said: dict[str, object] = {}
        for signal in self._settings.inputs.__struct_fields__:
            if place := getattr(self._settings.inputs, signal):
                put(said, place.field, value_of(place, self.plant.sense(signal)))
                if "wrong" in (server, body):
                    put(said, place.field, ["?"])
        if held := self._settings.held:
            put(said, held.field, value_of(held, self._on))
        self._last = json.dumps(said).encode()
        return {"off": b"", "garbage": self._last[:-9]}.get(body or "", self._last)


FAKE = Fake[HttpDoorSettings](
    plant=lambda name, settings, wires: door.build(name, settings, contacts(settings), PARTS),
    station=lambda plant, settings: FakeHttpDoor(plant, settings),
)
