"""The far side of a serial `modbus` bus: units on RS-485 behind a pseudo-terminal.

An absent unit is silent. A pseudo-terminal has no baud rate, so this file delays each byte by its time
on the wire. A request ends with 3.5 characters of silence. Then the reply begins. If the settings have
`ignore_echo`, the adapter echoes. `port` is a link that stays the same when the adapter is unplugged
and plugged in, as in /dev/serial/by-id. The order `fail DEVICE unit|server MODE` lets one unit fail
(`unit`), or the line with all units (`server`):

- `off`: the unit is silent; the line's adapter is unplugged
- `stuck`: the unit's inputs stay unchanged; the line is cut, and silent
- `slow`: the reply comes after the client has stopped waiting
- `garbage`: the reply has a wrong CRC, or is half a frame
- `wrong`: the reply has every bit set, names another unit or another function, or is exception 4; if
  the line fails, our own request may also come back before the reply, as from an adapter that echoes
  unannounced
"""

import asyncio
import heapq
import itertools
import os
import pty
import select
import tempfile
import threading
import time
import tty
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

import msgspec
from pymodbus.constants import ExcCodes
from pymodbus.exceptions import NoSuchIdException
from pymodbus.framer import FramerRTU
from pymodbus.pdu import DecodePDU

from drivers.hal.modbus.tcp_or_serial import Serial
from hal_fakes.modbus.flash import TimedCoilRequest
from hal_fakes.modbus.units import FakeUnits, FarSide
from hal_fakes.plants.plant import FailureMode

LOOK_S: Final = 0.02
"""The longest time (s) from the order `off` until the adapter is unplugged."""
READY_S: Final = 10.0


class SerialAdapter:
    """A pseudo-terminal as a serial adapter. `path` leads to the adapter while it is plugged in."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._ends: tuple[int, int] | None = None

    @property
    def wire(self) -> int | None:
        """Return the file descriptor of the line's side. Return None if the adapter is unplugged."""
        return self._ends[0] if self._ends else None

    def plug(self) -> None:
        """Plug the adapter in. It gets the same path, but is another device."""
        self._ends = pty.openpty()
        tty.setraw(self._ends[1])
        os.set_blocking(self._ends[0], False)
        self.path.symlink_to(os.ttyname(self._ends[1]))

    def pull(self) -> None:
        """Unplug the adapter, even if a program has it open. The caller may call `pull` twice."""
        ends, self._ends = self._ends, None
        for end in ends or ():
            os.close(end)
        self.path.unlink(missing_ok=True)


class RtuLine:
    """A running line with a thread of its own. `replace` has the settings with which the real bus finds
    the line.

    `slow_s` is the delay (s) of a slow reply. `requests` holds every frame that the line has received.
    """

    def __init__(
        self,
        devices: Iterable[FarSide],
        settings: Serial,
        slow_s: float,
        directory: str | None = None,
    ) -> None:
        self._settings = settings
        self._slow_s = slow_s
        self.units = FakeUnits(devices, slow_s=0.0)
        self._directory = tempfile.TemporaryDirectory(prefix="rmf-rs485-", dir=directory)
        self.adapter = SerialAdapter(Path(self._directory.name) / "adapter")
        self.adapter.plug()
        place = msgspec.structs.replace(settings, port=str(self.adapter.path))
        self.replace: dict[str, object] = {"serial": msgspec.to_builtins(place)}
        self.requests: list[bytes] = []
        self._order = itertools.count()
        self._due: list[tuple[float, int, bytes]] = []
        self._frame = b""
        self._busy_until = 0.0
        self._kinds: Iterator[int] = itertools.cycle(range(4))
        self._decoder = DecodePDU(is_server=True)
        self._decoder.register(TimedCoilRequest)
        self._framer = FramerRTU(DecodePDU(is_server=False))
        self._loop = asyncio.new_event_loop()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="rs485", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Unplug the adapter, and end the line. The caller may call `close` twice."""
        if self._closed.is_set():
            return
        self._closed.set()
        self._thread.join(READY_S)
        self._loop.close()
        self.adapter.pull()
        self._directory.cleanup()

    # ---- the wire: bytes and their times

    def _run(self) -> None:
        while not self._closed.is_set():
            self._look()
            self._listen()
            self._say()
            if self._frame and time.monotonic() >= self._busy_until + self._settings.gap_s:
                frame, self._frame = self._frame, b""
                self._hear(frame)

    def _look(self) -> None:
        """Unplug the adapter when the server's failure `off` begins, and plug it in when the failure
        ends. Let watchdogs trip."""
        self.units.tick()
        pulled = self.units.failure("server") == "off"
        if pulled != (self.adapter.wire is None):
            self._due, self._frame = [], b""
            (self.adapter.pull if pulled else self.adapter.plug)()

    def _listen(self) -> None:
        """Read the bytes that arrive before the next event is due. Each character takes its time on the
        wire."""
        wire = self.adapter.wire
        readable = select.select([wire] if wire is not None else [], [], [], self._idle_s())[0]
        sent = b""
        with suppress(OSError):
            sent = os.read(wire, 4096) if readable and wire is not None else b""
        begun_at = max(time.monotonic(), self._busy_until)
        self._frame += sent
        if sent:
            self._busy_until = begun_at + len(sent) * self._settings.character_s
            if self._settings.ignore_echo:
                self._put(sent, begun_at)

    def _idle_s(self) -> float:
        frame_at = self._busy_until + self._settings.gap_s if self._frame else float("inf")
        next_at = min(frame_at, self._due[0][0] if self._due else float("inf"))
        return min(LOOK_S, max(0.0, next_at - time.monotonic()))

    def _put(self, frame: bytes, begun_at: float) -> None:
        """Let each byte arrive at the time of its last bit."""
        for i, byte in enumerate(frame):
            at = begun_at + (i + 1) * self._settings.character_s
            heapq.heappush(self._due, (at, next(self._order), bytes((byte,))))

    def _say(self) -> None:
        while self._due and self._due[0][0] <= time.monotonic():
            byte = heapq.heappop(self._due)[2]
            if self.adapter.wire is not None:
                with suppress(OSError):
                    os.write(self.adapter.wire, byte)

    # ---- the units: frames and their meaning

    def _hear(self, frame: bytes) -> None:
        """Handle a complete request. If the request has a reply, the reply begins now. If the unit is
        slow, the reply begins later."""
        self.requests.append(frame)
        unit = frame[0]
        modes = {self.units.failure("server"), self.units.failure("unit", unit)} - {None}
        reply = self._reply(frame) if self.units.has(unit) else b""
        if not reply:
            return
        for mode in modes:
            reply = self._spoiled(mode, reply)
        heard_at = self._busy_until + self._settings.gap_s
        self._put(reply, heard_at + (self._slow_s if "slow" in modes else 0.0))

    def _reply(self, frame: bytes) -> bytes:
        """Return the unit's reply. Return b"" for a broken frame, because it gets no reply."""
        crc = int.from_bytes(frame[-2:], "big")
        if len(frame) < 4 or not FramerRTU.check_CRC(frame[:-2], crc):
            return b""
        request = self._decoder.decode(frame[1:-2])
        if request is None:
            return b""
        try:
            answer = request.datastore_update(self.units, frame[0])  # type: ignore[arg-type]
            response = self._loop.run_until_complete(answer)
        except NoSuchIdException:
            return b""
        response.dev_id = frame[0]
        return self._framer.buildFrame(response)

    def _spoiled(self, mode: FailureMode | None, reply: bytes) -> bytes:
        """Spoil the reply as this failure mode does. A mode with several ways uses them in turn."""
        if mode == "garbage":
            broken = bytes((reply[-1] ^ 0x55,))
            return reply[:-1] + broken if next(self._kinds) % 2 else reply[: len(reply) // 2]
        return self._wrong(reply) if mode == "wrong" else reply

    def _wrong(self, reply: bytes) -> bytes:
        unit, function = reply[0], reply[1] & 0x7F
        bodies = (
            bytes((unit, function ^ 3, 1, 0xFF)),
            bytes((unit % 247 + 1, function, 1, 0xFF)),
            bytes((unit, function | 0x80, ExcCodes.DEVICE_FAILURE)),
        )
        kind = next(self._kinds)
        if kind == len(bodies) and self.units.failure("server") == "wrong":
            return self.requests[-1] + reply
        body = bodies[kind % len(bodies)]
        return body + FramerRTU.compute_CRC(body).to_bytes(2, "big")
