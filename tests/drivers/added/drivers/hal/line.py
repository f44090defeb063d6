"""A controller that is asked in lines of text on TCP, a connection for each."""

import socket
from typing import Annotated

import msgspec

from bridges.kinds.shared.fields import Name, Period
from drivers.hal import Bus, BusType, HalError


class Settings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where it listens."""

    host: Name
    port: Annotated[int, msgspec.Meta(ge=1, le=65535)] = 4000
    scan_s: Period = 0.05


class LineBus(Bus):
    """The way to it."""

    def __init__(self, settings: Settings) -> None:
        self._address = (settings.host, settings.port)

    def ask(self, question: str) -> str:
        """One line for one line."""
        try:
            with socket.create_connection(self._address, 1.0) as wire:
                wire.sendall(f"{question}\n".encode())
                return wire.makefile("r", encoding="utf-8").readline().strip()
        except OSError as error:
            raise HalError(f"{self._address}: {error}") from error


BUS = BusType(settings=Settings, open_bus=LineBus, fake="hal_fakes.line")
