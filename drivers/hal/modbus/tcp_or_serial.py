"""The two ways to reach Modbus units: a TCP address, or a serial line."""

import re
from typing import Annotated, Final, Literal

import msgspec

from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from drivers.hal.hosts import misspelt_host

BAUDRATES: Final = (
    *(300, 600, 1200, 2400, 4800, 9600, 14400, 19200, 28800, 38400, 56000, 57600, 76800, 115200),
    *(128000, 230400, 250000, 256000, 460800, 500000, 921600, 1000000),
)
"""The usual baud rates of UARTs."""


class Tcp(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The TCP address of a module or gateway."""

    host: Annotated[Name, tells("the host's address or name.")]
    port: Annotated[int, msgspec.Meta(ge=1, le=65535), tells("the TCP port.")] = 502

    def problems(self) -> Remarks:
        """Yield a problem for an invalid address."""
        if reason := misspelt_host(self.host):
            yield ("host",), reason


class Serial(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A serial line (RS-485). Every unit on the line must have the same settings. A character has 8
    data bits."""

    port: Annotated[Name, tells("the adapter's path. Paths like /dev/serial/by-id/… never change.")]
    baudrate: Annotated[int, msgspec.Meta(ge=300, le=1_000_000), tells("bits a second.")]
    parity: Annotated[Literal["none", "even", "odd"], tells("the parity bit of each character.")]
    stopbits: Annotated[Literal[1, 2], tells("stop bits of each character.")]
    ignore_echo: Annotated[bool, tells("true for an adapter that receives what it sends.")] = False

    def problems(self) -> Remarks:
        """Yield a problem for a relative path, and for an unusual baud rate."""
        if not self.port.startswith("/"):
            text = "write the whole path, as `ls /dev/serial/by-id/*` prints it"
            yield ("port",), f"{self.port!r} is not a serial port: {text}"
        if self.baudrate not in BAUDRATES:
            text = (
                f"{self.baudrate} is not a rate that units have: {', '.join(map(str, BAUDRATES))}"
            )
            yield ("baudrate",), text

    def warnings(self) -> Remarks:
        """Yield a warning for a path that may change after a reboot."""
        if re.match(r"/dev/tty(USB|ACM)", self.port):
            text = "may be another adapter after the next start: write its /dev/serial/by-id path"
            yield ("port",), f"{self.port} {text}"

    @property
    def character_s(self) -> float:
        """Return the time (s) that one character takes on the wire. A character has a start bit, 8 data
        bits, perhaps a parity bit, and the stop bits."""
        bits = 9 + (self.parity != "none") + self.stopbits
        return bits / self.baudrate

    @property
    def least_s(self) -> float:
        """Return the time (s) that the shortest reading of a unit takes on the line. Its request has 8
        characters, and its reply has 6."""
        return 14 * self.character_s + 2 * self.gap_s

    @property
    def gap_s(self) -> float:
        """Return the silence (s) between two frames. The silence is 3.5 characters, or 1.75 ms above
        19200 baud.

        Source: Modbus over Serial Line V1.02, 2.5.1.1.
        """
        return 0.00175 if self.baudrate > 19200 else 3.5 * self.character_s
