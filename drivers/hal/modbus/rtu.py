"""A serial line with Modbus RTU units: one request at a time, one deadline, silence between frames.

pyserial opens and configures the port. pymodbus makes and reads the frames (`frames.py`). This file
does all the waiting. A bus imports this file when it needs a serial line.

RTU has no transaction number, so a late reply looks like the reply to the present request. Hence these
rules:

- A request is sent only after 3.5 characters of silence. Earlier bytes are dropped.
- Frames of other units are dropped, and the wait goes on. Bytes that are not a frame may come from a
  collision of the wanted reply with a late reply. After such bytes the try ends when the line is
  silent.
- A unit that misses its timeout may answer late, until LATE x `timeout_s` after its request. Until then
  the unit gets only repeats of the same request, within the same call. Both the first try and the
  repeat may get a reply. The first reply that comes counts, because the unit measured its values after
  the call began. The second reply is dropped.

A unit that answers even later needs a longer `timeout_s`.
"""

import errno
import os
import select
import termios
import time
from contextlib import suppress
from typing import Final

import serial

from drivers.hal.deadline import Deadline
from drivers.hal.modbus import frames
from drivers.hal.modbus.tcp_or_serial import Serial
from drivers.hal.modbus.wire import BadReply, NoReply, UnitReply, UnitRequest, Unreachable

LATE: Final = 3.0
PARITY: Final = {"none": "N", "even": "E", "odd": "O"}
WRITES: Final = (5, 6, 15, 16)
"""The functions that write. Their replies may begin with the same bytes as the request, as an adapter's
echo does."""
UNITS: Final = range(1, 248)
PAUSE_S: Final = 0.05
"""The longest pause (s) between two bytes of one frame. Adapters delay characters by up to 16 ms."""
FRAME_MAX: Final = 256
"""The number of characters in the longest frame (Modbus over Serial Line V1.02, 2.5.1)."""


class Noise(BadReply):
    """The error of bytes that are not a frame. The wanted reply may still come."""


class SerialLine:
    """One serial port, opened exclusively. The line opens the port again when needed."""

    def __init__(self, settings: Serial, timeout_s: float) -> None:
        self._settings = settings
        self._timeout_s = timeout_s
        self._deadline = Deadline()
        self._port: serial.Serial | None = None
        self._busy_until = 0.0
        self._sent_at = 0.0
        self._late: dict[int, float] = {}
        self._stray = b""

    def owes(self, unit: int) -> bool:
        """May this unit still reply to an older request? Then a new request to this unit should
        wait."""
        return time.monotonic() < self._late.get(unit, 0.0)

    def begin(self, unit: int) -> None:
        """Before a new request to this unit, wait until no reply to an older request can come."""
        time.sleep(max(0.0, self._late.pop(unit, 0.0) - time.monotonic()))

    def connect(self) -> None:
        """Open the port if necessary, and start the time limit of one try. Raises Unreachable."""
        if self._port is None:
            try:
                self._port = self._opened()
            except (OSError, ValueError, termios.error) as error:
                raise Unreachable(self._unreachable(error)) from error
        self._deadline.start(self._timeout_s)

    def ask(self, question: UnitRequest) -> UnitReply:
        """Send this request, and return its answer. Raises NoReply."""
        try:
            frame = self.exchange(frames.rtu_request(question))
            return frames.rtu_answer(question, frame)
        except TimeoutError as error:
            raise NoReply(self._silence()) from error
        except (OSError, termios.error) as error:
            self.close()
            raise NoReply(f"the port broke ({_why(error)})") from error
        except BadReply as error:
            raise NoReply(f"no Modbus reply to the request ({error})") from error

    def exchange(self, request: bytes) -> bytes:
        """Send this frame, and return the reply's frame, which has a valid CRC.

        Raises TimeoutError, OSError if the port fails, or BadReply.
        """
        if request[0] not in UNITS:
            raise BadReply("units on a serial line are 1 to 247")
        self._settle()
        self._send(request)
        try:
            heard = self._without_echo(request) if self._settings.ignore_echo else b""
            return self._answer(request, heard)
        except (TimeoutError, Noise):
            self._late[request[0]] = self._sent_at + LATE * self._timeout_s
            raise

    def close(self) -> None:
        """Close the port. The caller may call `close` twice."""
        port, self._port = self._port, None
        if port is not None:
            with suppress(OSError, termios.error):
                port.reset_output_buffer()  # unsent bytes on a dead line would delay closing
            with suppress(OSError, termios.error):
                port.close()

    def _opened(self) -> serial.Serial:
        port = serial.Serial(
            self._settings.port,
            self._settings.baudrate,
            parity=PARITY[self._settings.parity],
            stopbits=self._settings.stopbits,
            timeout=0,
            exclusive=True,
        )
        with suppress(OSError, ValueError):  # some adapters refuse, and delay bytes by up to 16 ms
            port.set_low_latency_mode(True)
        return port

    def _settle(self) -> None:
        """Wait until the line has been silent for `gap_s`, the gap between frames. Drop all bytes until
        then."""
        while heard := self._heard(self._busy_until + self._settings.gap_s - time.monotonic()):
            self._stray = heard
        self._stray = b""

    def _send(self, request: bytes) -> None:
        self._sent_at = time.monotonic()
        self._busy_until = self._sent_at + len(request) * self._settings.character_s
        if request[0] in self._late:  # the unit may also answer this repeat late
            self._late[request[0]] = self._sent_at + LATE * self._timeout_s
        assert self._port  # `connect` has opened it
        if os.write(self._port.fileno(), request) != len(request):
            raise OSError(errno.EIO, "the port does not accept the whole request")

    def _heard(self, within_s: float) -> bytes:
        """Return the next bytes. Return b"" if none come within `within_s`. Raises TimeoutError or
        OSError."""
        left_s = min(max(0.0, within_s), self._deadline.left())
        assert self._port
        descriptor = self._port.fileno()
        if not select.select([descriptor], [], [], left_s)[0]:
            return b""
        received = os.read(descriptor, 4096)
        if not received:
            raise OSError(errno.ENODEV, "the port is gone")
        self._busy_until = max(self._busy_until, time.monotonic())
        return received

    def _without_echo(self, request: bytes) -> bytes:
        """Return the bytes after the echo of the sent request."""
        heard = b""
        while len(heard) < len(request) and request.startswith(heard):
            heard += self._heard(self._timeout_s)
        if not heard.startswith(request):
            raise Noise("the first bytes are not the echo; does the adapter echo? see ignore_echo")
        return heard[len(request) :]

    def _answer(self, request: bytes, heard: bytes) -> bytes:
        """Return the reply's frame. No byte may come before the frame. One byte of noise may follow."""
        while True:
            if not request[:1].startswith(heard[:1]) or not _answers(request, heard[1:2]):
                self._drop(heard)
                heard = b""
            elif size := _complete(heard):
                return self._checked(heard[:size], request)
            more = self._heard(max(PAUSE_S, self._settings.gap_s) if heard else self._timeout_s)
            if heard and not more:
                raise Noise(f"{_start(heard)} is half a frame")
            heard += more

    def _checked(self, frame: bytes, request: bytes) -> bytes:
        """Return this frame if its CRC is valid. Raises Noise for a late echo of an earlier try. Raises
        BadReply for any other invalid frame."""
        if frames.crc_fits(frame):
            return frame
        is_echo = request[1] not in WRITES and frame == request[: len(frame)]
        if is_echo and self._settings.ignore_echo:
            raise Noise("the adapter's echo came late")
        if is_echo:
            text = "the request itself came back; if the adapter echoes, write ignore_echo: true"
            raise BadReply(text)
        raise BadReply(f"CRC of {frame.hex(' ')} is wrong")

    def _drop(self, heard: bytes) -> None:
        """Drop another unit's frame, with all bytes until the line is silent. Raises Noise if the bytes
        are no frame."""
        while more := self._heard(self._settings.gap_s):
            heard = (heard + more)[: 2 * FRAME_MAX]
        self._stray = heard
        if not frames.crc_fits(heard):
            raise Noise(
                f"{_start(heard)} is not a frame: a collision, noise, or wrong line settings?"
            )

    def _silence(self) -> str:
        text = f"no reply within {self._timeout_s:g} s"
        if self._stray:
            text += f", but bytes of another unit: {_start(self._stray)}"
        return text

    def _unreachable(self, error: Exception) -> str:
        text = f"no serial port {self._settings.port}: "
        code = getattr(error, "errno", None)
        if code == errno.ENOENT:
            return text + "the port is not there; is the adapter plugged in? ls /dev/serial/by-id"
        if code == errno.EACCES:
            return text + "no permission: the daemon's user must be in the group dialout"
        if code in (errno.EAGAIN, errno.EBUSY):
            return text + "another program has it open"
        return text + _why(error)


def _answers(request: bytes, function: bytes) -> bool:
    """Return whether `function`, the second byte of a reply, may answer this request. Return True if
    this byte has not come yet."""
    return not function or function[0] & 0x7F == request[1]


def _complete(heard: bytes) -> int:
    """Return the size of the frame at the beginning of `heard`. Return 0 until the frame is
    complete."""
    size = frames.rtu_size(heard)
    return size if size <= len(heard) else 0


def _start(heard: bytes) -> str:
    return heard[:16].hex(" ") + (" …" if len(heard) > 16 else "")


def _why(error: Exception) -> str:
    """Return the text of an error's cause. pyserial puts this text into a longer text, and
    termios.error (which is no OSError) has it in its arguments."""
    text = getattr(error, "strerror", None) or (error.args[-1] if error.args else error)
    return str(text)
