"""An slcan adapter (LAWICEL) behind a pseudo-terminal. The adapter carries frames as lines of text to
another process.

    t123 2 0102 CR     frame 0x123 with two bytes; T and eight digits for an id of 29 bits
    Sn CR, O CR, C CR  bitrate, open, close

The adapter acknowledges a frame with `z` or `Z`. It passes frames only when it is open.
"""

import os
import random
import select
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Final

import can
import msgspec

from drivers.hal.can import Slcan
from hal_fakes.can.side import any_frame
from hal_fakes.modbus.rtu import SerialAdapter
from hal_fakes.plants.plant import FailureMode

DIGITS: Final = {"t": 3, "T": 8}


class SlcanPort:
    """A medium (`hal_fakes.can.side.Medium`). `settings` is the bus's `slcan`, if the bus has one."""

    def __init__(self, settings: Slcan | None = None) -> None:
        self._directory = tempfile.TemporaryDirectory(prefix="rmf-slcan-")
        self.adapter = SerialAdapter(Path(self._directory.name) / "adapter")
        self.adapter.plug()
        found = settings or Slcan(port="", bitrate=250_000)
        place = msgspec.structs.replace(found, port=str(self.adapter.path))
        self.replace = {"socketcan": None, "slcan": msgspec.to_builtins(place)}
        self._noise = random.Random("slcan")
        self._others = False
        self._heard = b""
        self._open = False

    def receive(self, wait_s: float) -> can.Message | None:
        """Return the daemon's next frame. Obey the commands that come before this frame."""
        while b"\r" not in self._heard:
            wire = self.adapter.wire
            readable = select.select([wire] if wire is not None else [], [], [], wait_s)[0]
            read = b""
            with suppress(OSError):
                read = os.read(wire, 4096) if readable and wire is not None else b""
            if not read:
                return None
            self._heard += read
        line, _, self._heard = self._heard.partition(b"\r")
        return self._obey(line.decode("ascii", "replace"))

    def send(self, message: can.Message) -> None:
        """Send a frame to the daemon."""
        if self._open and not self._others:
            self._write(encoded(message))

    def fail(self, mode: FailureMode | None) -> None:
        """Fail in this way. `off` unplugs the adapter, `garbage` sends noise, and `wrong` passes only
        other stations' frames."""
        if (mode == "off") != (self.adapter.wire is None):
            self._heard, self._open = b"", False
            (self.adapter.pull if mode == "off" else self.adapter.plug)()
        if mode == "garbage":
            self._write(self._noise.randbytes(self._noise.randrange(1, 30)))
        self._others = mode == "wrong"
        if self._others and self._open:
            self._write(encoded(any_frame(self._noise)))

    def close(self) -> None:
        """Unplug the adapter permanently. The caller may call `close` twice."""
        self.adapter.pull()
        self._directory.cleanup()

    def _obey(self, line: str) -> can.Message | None:
        if line[:1] in ("O", "C"):
            self._open = line[0] == "O"
        if line[:1] not in DIGITS:
            self._write(b"\r")
            return None
        with suppress(ValueError, IndexError):
            message = decoded(line)
            self._write(b"Z\r" if message.is_extended_id else b"z\r")
            return message if self._open else None
        return None

    def _write(self, text: bytes) -> None:
        wire = self.adapter.wire
        with suppress(OSError):  # if nobody reads, the bytes are lost, as on a bus
            if wire is not None:
                os.write(wire, text)


def encoded(message: can.Message) -> bytes:
    """Return the line of text for a frame."""
    letter = "T" if message.is_extended_id else "t"
    digits = f"{message.arbitration_id:0{DIGITS[letter]}X}"
    return f"{letter}{digits}{message.dlc}{bytes(message.data).hex().upper()}\r".encode()


def decoded(line: str) -> can.Message:
    """Return the frame in a line of text. Raises ValueError or IndexError."""
    size = DIGITS[line[0]]
    count = int(line[1 + size])
    data = bytes.fromhex(line[2 + size : 2 + size + 2 * count])
    if len(data) != count:
        raise ValueError(line)
    return can.Message(
        arbitration_id=int(line[1 : 1 + size], 16), is_extended_id=line[0] == "T", data=data
    )
