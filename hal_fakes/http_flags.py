"""A controller on HTTP whose answer is flags: the YAML names the field of each contact of the plant.

`hal_fakes/http.py` describes the failures of server, headers and body.
"""

import json
import time
from collections.abc import Mapping, Sequence
from typing import Any, Final

from drivers.hal.points import Wire
from drivers.json_fields import JsonFlag
from hal_fakes.http import Asked
from hal_fakes.json_answers import put, value_of
from hal_fakes.plants.plant import Plant

PARTS: Final = ("server", "headers", "body")


def flags(inputs: Any) -> dict[str, JsonFlag]:
    """Return contact -> its field, for each field that this section of the YAML gives."""
    found = {name: getattr(inputs, name) for name in inputs.__struct_fields__}
    return {name: place for name, place in found.items() if place}


def contacts(fields: Mapping[str, JsonFlag], *relays: str) -> list[Wire]:
    """Return the controller's own contacts and relays as wires. The plant needs these wires, because
    they can fail in the same way as the daemon's wires."""
    inputs = [Wire(name, "in", name, "high") for name in fields]
    return [*inputs, *(Wire(name, "out", name, "high") for name in relays)]


class FlagStation:
    """A controller (`hal_fakes.http.HttpStation`) that obeys no command. A derived class adds
    `commands`."""

    def __init__(self, plant: Plant, state_path: str, fields: Mapping[str, JsonFlag]) -> None:
        self.plant = plant
        self.reads: Sequence[Asked] = [("GET", state_path, "")]
        self.commands: Mapping[Asked, tuple[str, bool]] = {}
        self._fields = fields
        self._last: bytes | None = None

    def obey(self, signal: str, asserted: bool) -> None:
        """Drive a relay of the plant."""
        self.plant.drive(signal, asserted, time.monotonic())

    def tick(self) -> None:
        """Advance the plant to the present time."""
        self.plant.advance(time.monotonic())

    def add(self, said: dict[str, object]) -> None:
        """Add the controller's own fields to the answer `said`."""

    def answer(self, asked: Asked) -> bytes:
        """Return the present answer to `GET state_path`. If the server or the body fails, return the
        spoilt answer of the failure mode."""
        self.tick()
        server, body = self.plant.failures.get("server"), self.plant.failures.get("body")
        if server == "stuck" and self._last is not None:
            return self._last
        said: dict[str, object] = {}
        for name in sorted(
            self._fields, key=self.plant.sense
        ):  # asserted contacts come last, so they decide about a shared field
            place, on = self._fields[name], self.plant.sense(name)
            if on or place.field not in said:
                put(said, place.field, value_of(place, on))
            if "wrong" in (server, body):
                put(said, place.field, ["?"])
        self.add(said)
        self._last = json.dumps(said).encode()
        return {"off": b"", "garbage": self._last[:-9]}.get(body or "", self._last)
