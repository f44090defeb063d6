"""A simulated door that answers in words. It moves like every simulated door."""

import time
from typing import Any

from drivers.hal.points import Wire
from hal_fakes.fake import Fake
from hal_fakes.plants import door
from hal_fakes.plants.plant import Plant

CONTACTS = [
    Wire("opened", "in", "opened", "high"),
    Wire("closed", "in", "closed", "high"),
    Wire("hold_open", "out", "hold_open", "high"),
]


class LineDoor:
    """The station of one door."""

    def __init__(self, plant: Plant, called: str) -> None:
        self._plant = plant
        self._called = called

    def answer(self, question: str) -> str:
        """Return the door's position, or a confirmation of the command."""
        name, _, verb = question.rpartition(" ")
        if name != self._called:
            return ""
        now = time.monotonic()
        self._plant.advance(now)
        if verb != "where":
            self._plant.drive("hold_open", verb == "hold", now)
            return "done"
        opened, closed = self._plant.sense("opened"), self._plant.sense("closed")
        return "open" if opened else "closed" if closed else "between"


FAKE: Fake[Any] = Fake(
    plant=lambda name, settings, wires: door.build(name, settings, CONTACTS),
    station=lambda plant, settings: LineDoor(plant, settings.called),
)
