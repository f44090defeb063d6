"""A driver for a door whose controller takes questions and commands as lines of text."""

from typing import Protocol

from bridges.kinds.door.settings import DoorSettings
from bridges.kinds.door.signals import DoorOutputs, DoorSample
from bridges.kinds.shared.fields import Name
from drivers.driver_type import DriverType


class Asks(Protocol):
    """A bus that sends a question as text and returns the answer."""

    def ask(self, question: str) -> str:
        """Return the answer to a question. Raise HalError if no answer comes."""


class Settings(DoorSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The settings of a door. `called` is the door's name in the questions."""

    called: Name


class LineDoor:
    """A driver of one door (`drivers.Driver[DoorSample, DoorOutputs]`)."""

    def __init__(self, settings: Settings, bus: Asks) -> None:
        self._name = settings.called
        self._bus = bus

    def open(self) -> None:
        """Release the door."""
        self.make_safe()

    def read(self) -> DoorSample:
        """Read both limit switches."""
        where = self._bus.ask(f"{self._name} where")
        return DoorSample(opened=where == "open", closed=where == "closed")

    def write(self, outputs: DoorOutputs) -> None:
        """Hold or release the door."""
        self._bus.ask(f"{self._name} {'hold' if outputs.hold_open else 'release'}")

    def make_safe(self) -> None:
        """Release the door."""
        self._bus.ask(f"{self._name} release")

    def close(self) -> None:
        """Do nothing, because each question has its own connection."""


DRIVER = DriverType(
    settings=Settings,
    buses=("line",),
    create=lambda name, settings, bus: LineDoor(settings, bus),
    describe=lambda settings, bus: [("asks", f"{settings.called} at {bus.host}:{bus.port}")],
    fake="hal_fakes.line_door",
)
