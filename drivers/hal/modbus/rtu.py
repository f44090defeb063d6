"""One serial line with Modbus RTU units: one question, one deadline, and silence between the frames.

pyserial opens and configures the port; frames are made and read by pymodbus (`frames.py`). The waiting
is ours. Imported with the first bus that needs it.

RTU has no transaction number, so a late reply looks like a prompt one. Hence:

- A request is sent only after 3.5 characters of silence; bytes that came before are dropped.
- Frames of other units are dropped, and the wait goes on. Bytes that are not a frame may be the reply
  in a collision with a late one: the try ends when the line is silent.
- A unit that misses its timeout may answer late, until LATE x `timeout_s` after its request. Until then
  it gets only repeats of the same request, within the same call. Whichever reply comes first, it was
  sampled after the call began; the other one is dropped.

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
from drivers.hal.modbus.places import Serial
from drivers.hal.modbus.wire import Answer, BadReply, NoReply, Question, Unreachable

LATE: Final = 3.0
PARITY: Final = {"none": "N", "even": "E", "odd": "O"}
WRITES: Final = (5, 6, 15, 16)
"""The functions whose reply may begin as the request does, or be the same."""
UNITS: Final = range(1, 248)
PAUSE_S: Final = 0.05
"""How long a frame may pause and go on: adapters keep characters back for up to 16 ms."""
FRAME_MAX: Final = 256
"""Characters of the longest frame (Modbus over Serial Line V1.02, 2.5.1)."""


class Noise(BadReply):
    """What came is nobody's frame, and the answer may still come."""


class Line:
    """The way to one serial port, opened anew when it is needed. Nobody else may open it meanwhile."""

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
        """May this unit still answer an older question, so that a new one had better wait?"""
        return time.monotonic() < self._late.get(unit, 0.0)

    def begin(self, unit: int) -> None:
        """A new question to this unit comes: wait until it cannot answer an older one any more."""
        time.sleep(max(0.0, self._late.pop(unit, 0.0) - time.monotonic()))

    def connect(self) -> None:
        """Have the port open; a try begins then. Raises Unreachable."""
        if self._port is None:
            try:
                self._port = self._opened()
            except (OSError, ValueError, termios.error) as error:
                raise Unreachable(self._unreachable(error)) from error
        self._deadline.start(self._timeout_s)

    def ask(self, question: Question) -> Answer:
        """What answers this question. Raises NoReply."""
        try:
            frame = self.exchange(frames.rtu_request(question))
            return frames.rtu_answer(question, frame)
        except TimeoutError as error:
            raise NoReply(self._silence()) from error
        except (OSError, termios.error) as error:
            self.close()
            raise NoReply(f"the port broke ({_why(error)})") from error
        except BadReply as error:
            raise NoReply(f"no Modbus reply to it ({error})") from error

    def exchange(self, request: bytes) -> bytes:
        """Send this frame; the frame that answers it, its CRC checked.

        Raises TimeoutError, OSError when the port breaks, or BadReply.
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
        """Close the port. May be called twice."""
        port, self._port = self._port, None
        if port is not None:
            with suppress(OSError, termios.error):
                port.reset_output_buffer()  # or closing waits for what nobody takes any more
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
        with suppress(OSError, ValueError):  # only some adapters keep characters back, for 16 ms
            port.set_low_latency_mode(True)
        return port

    def _settle(self) -> None:
        """Wait until the line has been silent for long enough; throw away what comes until then."""
        while heard := self._heard(self._busy_until + self._settings.gap_s - time.monotonic()):
            self._stray = heard
        self._stray = b""

    def _send(self, request: bytes) -> None:
        self._sent_at = time.monotonic()
        self._busy_until = self._sent_at + len(request) * self._settings.character_s
        if request[0] in self._late:  # asked again: this may be what is answered late
            self._late[request[0]] = self._sent_at + LATE * self._timeout_s
        assert self._port  # `connect` has opened it
        if os.write(self._port.fileno(), request) != len(request):
            raise OSError(errno.EIO, "it does not take what is sent")

    def _heard(self, within_s: float) -> bytes:
        """What comes next; nothing when nothing does within this. Raises TimeoutError, OSError."""
        left_s = min(max(0.0, within_s), self._deadline.left())
        assert self._port
        descriptor = self._port.fileno()
        if not select.select([descriptor], [], [], left_s)[0]:
            return b""
        received = os.read(descriptor, 4096)
        if not received:
            raise OSError(errno.ENODEV, "it is gone")
        self._busy_until = max(self._busy_until, time.monotonic())
        return received

    def _without_echo(self, request: bytes) -> bytes:
        """What follows our own request, which is heard first."""
        heard = b""
        while len(heard) < len(request) and request.startswith(heard):
            heard += self._heard(self._timeout_s)
        if not heard.startswith(request):
            raise Noise("what came first is no echo; does the adapter echo? see ignore_echo")
        return heard[len(request) :]

    def _answer(self, request: bytes, heard: bytes) -> bytes:
        """The frame that answers, and not a byte before it. After it a byte of noise may come."""
        while True:
            if not request[:1].startswith(heard[:1]) or not _answers(request, heard[1:2]):
                self._drop(heard)
                heard = b""
            elif size := _complete(heard):
                return _checked(heard[:size], request, heard)
            more = self._heard(max(PAUSE_S, self._settings.gap_s) if heard else self._timeout_s)
            if heard and not more:
                raise Noise(f"{_start(heard)} is half a frame")
            heard += more

    def _drop(self, heard: bytes) -> None:
        """Somebody else's frame until the line is silent. Raises Noise when it is none."""
        while more := self._heard(self._settings.gap_s):
            heard = (heard + more)[: 2 * FRAME_MAX]
        self._stray = heard
        if not frames.crc_fits(heard):
            raise Noise(f"{_start(heard)} is no frame: a collision, noise or other line settings")

    def _silence(self) -> str:
        text = f"no reply within {self._timeout_s:g} s"
        if self._stray:
            text += f", but {_start(self._stray)} of another unit"
        return text

    def _unreachable(self, error: Exception) -> str:
        text = f"no serial port {self._settings.port}: "
        code = getattr(error, "errno", None)
        if code == errno.ENOENT:
            return text + "it is not there; is the adapter plugged in? ls /dev/serial/by-id"
        if code == errno.EACCES:
            return text + "it may not be opened: add the daemon's user to the group dialout"
        if code in (errno.EAGAIN, errno.EBUSY):
            return text + "another program has it open"
        return text + _why(error)


def _answers(request: bytes, function: bytes) -> bool:
    """May a reply to this begin so? True for no byte yet."""
    return not function or function[0] & 0x7F == request[1]


def _complete(heard: bytes) -> int:
    """The size of the frame that these bytes begin with, once they are all there; else 0."""
    size = frames.rtu_size(heard)
    return size if size <= len(heard) else 0


def _start(heard: bytes) -> str:
    return heard[:16].hex(" ") + (" …" if len(heard) > 16 else "")


def _checked(frame: bytes, request: bytes, heard: bytes) -> bytes:
    if frames.crc_fits(frame):
        return frame
    if request[1] not in WRITES and heard[: len(frame)] == request[: len(frame)]:
        raise BadReply("our own request comes back; does the adapter echo? say ignore_echo: true")
    raise BadReply(f"CRC of {frame.hex(' ')} is wrong")


def _why(error: Exception) -> str:
    """termios.error is no OSError, and pyserial puts one text into another."""
    text = getattr(error, "strerror", None) or (error.args[-1] if error.args else error)
    return str(text)
