"""A serial line on a pseudo-terminal, in sixty lines of code from the Modbus specification.

The units answer as in `module.py`, in RTU frames. A frame takes no time on the wire.
"""

import os
import pty
import select
import tempfile
import threading
import tty
from collections.abc import Callable
from pathlib import Path

from tests.drivers.hal.modbus.module import Module, Reply


def crc(frame: bytes) -> bytes:
    """Return the CRC of a frame, with the low byte first (Modbus over Serial Line V1.02, 6.2.2)."""
    value = 0xFFFF
    for byte in frame:
        value ^= byte
        for _ in range(8):
            value = (value >> 1) ^ 0xA001 if value & 1 else value >> 1
    return value.to_bytes(2, "little")


def rtu(frame: str) -> bytes:
    """Return the frame with these hexadecimal digits, followed by its CRC."""
    return bytes.fromhex(frame) + crc(bytes.fromhex(frame))


class SerialModule(Module):
    """A module on a line.

    `reply` gets and returns frames with a TCP header, as in the base class. If a test sets `on_wire`,
    `on_wire` answers instead. `on_wire` gets the bytes of a request, and returns the bytes that follow
    on the wire. `frames` has each request as it was on the wire.
    """

    def __init__(self, reply: Reply | None = None) -> None:
        self._directory = tempfile.TemporaryDirectory(prefix="rmf-line-")
        self._link = Path(self._directory.name) / "adapter"
        self.on_wire: Callable[[bytes], bytes] | None = None
        self.frames: list[bytes] = []
        super().__init__(reply)

    def say(self, heard: bytes) -> None:
        """Send bytes on the line without a request."""
        os.write(self._pty[0], heard)

    def pull(self) -> None:
        """Unplug the adapter."""
        self._link.unlink()
        os.write(self._stop[1], b".")
        self._threads.pop().join()
        for descriptor in (*self._pty, *self._stop):
            os.close(descriptor)

    def plug(self) -> None:
        """Plug the adapter in again. The adapter becomes another device under the same path."""
        self._pty = pty.openpty()
        self._stop = os.pipe()
        tty.setraw(self._pty[1])
        self._link.symlink_to(os.ttyname(self._pty[1]))
        self._threads.append(threading.Thread(target=self._serve_line, args=(*self._pty,)))
        self._threads[-1].start()

    def hang_up(self) -> None:
        """Unplug the adapter, and plug it in again."""
        self.pull()
        self.plug()

    def close(self) -> None:
        """Stop answering, and free the port."""
        if self._link.is_symlink():
            self.pull()
        self._directory.cleanup()

    def _listen(self) -> None:
        self._threads = []
        self.port = self.where = str(self._link)
        self.plug()

    def _serve_line(self, line: int, _: int) -> None:
        while True:
            ready = select.select([line, self._stop[0]], [], [])[0]
            if line not in ready:
                return
            frame = os.read(line, 300)
            self.frames.append(frame)
            self.asked.append(b"\0\0\0\0\0\6" + frame[:-2])
            os.write(line, self._heard_after(frame))

    def _heard_after(self, frame: bytes) -> bytes:
        if self.on_wire is not None:
            return self.on_wire(frame)
        answer = (self.reply(self.asked[-1]) or b"")[6:]
        return answer and answer + crc(answer)
