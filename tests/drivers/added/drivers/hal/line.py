"""A bus to a controller that answers lines of text on TCP. Each line has its own connection."""

import socket
from typing import Annotated

import msgspec

from bridges.kinds.shared.fields import Name, Period
from drivers.hal import Bus, BusType, HalError


class Settings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The controller's address."""

    host: Name
    port: Annotated[int, msgspec.Meta(ge=1, le=65535)] = 4000
    scan_s: Period = 0.05


class LineBus(Bus):
    """Connections to the controller."""

    def __init__(self, settings: Settings) -> None:
        self._address = (settings.host, settings.port)

    def ask(self, question: str) -> str:
        """Send a line, and return the line that the controller answers."""
        try:
            with socket.create_connection(self._address, 1.0) as wire:
                wire.sendall(f"{question}\n".encode())
                return wire.makefile("r", encoding="utf-8").readline().strip()
        except OSError as error:
            raise HalError(f"{self._address}: {error}") from error


BUS = BusType(settings=Settings, open_bus=LineBus, fake="hal_fakes.line")
