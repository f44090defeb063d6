"""One CANopen node, through the `canopen` library (CiA 301). The node has a heartbeat, and objects that
are read and written by SDO.

The library encodes and decodes. This file sends, waits and backs off, in the loop's thread. The library
alone would accept any frame with the reply's id, even a late reply. This file has stricter rules:

- A reply counts only if it has eight bytes and names the requested object. Other frames are dropped. If
  no reply comes, the error names the dropped frames.
- After a request without a reply, the node gets no request for a time of LATE x timeout. Otherwise a
  late reply could pass for the reply to the next request.
- No request is sent twice.
- A write that switches power off is sent at once, even after a failed reading.

A lost node has a backoff, as every device has. The node's heartbeat or restart ends the backoff.
"""

import struct
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, TypeVar

from drivers.hal import HalError
from drivers.hal.backoff import Backoff
from drivers.hal.can.bus import CanBus
from drivers.hal.can.frames import Frame, FrameFilter

if TYPE_CHECKING:
    from drivers.hal.can.sdo import Client

Reply = TypeVar("Reply")
LATE: Final = 3.0
SDO_TO_NODE: Final = 0x600
SDO_FROM_NODE: Final = 0x580
HEARTBEAT: Final = 0x700
ABORTED: Final = 0x80
STATES: Final = {0: "starting", 4: "stopped", 5: "operational", 127: "pre-operational"}
OPERATIONAL: Final = 5


class Aborted(HalError):
    """The error of a transfer that the node refused. The node is present, but refuses this transfer."""


class CanOpenNode:
    """One node of a bus. `heartbeat_timeout_s` is None for a node without a heartbeat.

    `starts` is the number of restarts that the node has reported.
    """

    def __init__(self, bus: CanBus, node: int, heartbeat_timeout_s: float | None) -> None:
        self.starts = 0
        self._bus = bus
        self._node = node
        self._beat_limit_s = heartbeat_timeout_s
        self._timeout_s = bus.settings.timeout_s
        self._beat_pause = bus.backoff()
        self._sdo_pause = bus.backoff()
        self._safe_pause = bus.backoff()
        self._state = OPERATIONAL
        self._beat_at = float("-inf")
        self._asked: bytes | None = None
        self._answer: bytes | None = None
        self._stray = ""
        self._odd_beat = ""
        self._late_until = float("-inf")
        self._client = _client(self)
        bus.listen([FrameFilter(HEARTBEAT + node)], self._hear_beat)
        bus.listen([FrameFilter(SDO_FROM_NODE + node)], self._hear_reply)

    def alive(self) -> None:
        """Take new frames. Raises HalError if the heartbeat is missing, or if the node is not
        operational."""
        self._bus.take()
        if self._beat_limit_s is None:
            return
        if not self._beats():
            self._beat_pause.check()
            if not self._bus.wait(self._beats, self._timeout_s):
                raise self._beat_pause.failed(self._silent())
        if self._beat_pause.failing:
            self.starts += 1  # the node may have restarted while its heartbeat was lost
        self._beat_pause.mended()
        if self._state != OPERATIONAL:
            state = STATES.get(self._state, f"in state {self._state}")
            raise HalError(f"{self._name()} is {state}, not operational: check the node")

    def read(self, index: int, subindex: int, octets: int) -> int:
        """Read an unsigned number of `octets` bytes. Raises HalError."""
        what = f"read 0x{index:04X}:{subindex:02X}"
        found = self._exchanged(what, self._sdo_pause, lambda: self._client.upload(index, subindex))
        number = bytes(found)[:octets]
        if len(number) < octets or any(found[octets:]):
            size = f"{len(found)} bytes ({found.hex(' ')})"
            raise HalError(
                f"{self._name()}, read 0x{index:04X}:{subindex:02X}: {size} for a number of {octets}"
            )
        return int.from_bytes(number, "little")

    def write(
        self, index: int, subindex: int, octets: int, number: int, safe: bool = False
    ) -> None:
        """Set an unsigned number. Raises HalError. After an error it is unknown whether the node has
        set the number.

        `safe` means that the write switches power off. Such a write does not wait for the backoff of
        failed readings.
        """
        what = f"write 0x{index:04X}:{subindex:02X}"
        payload = number.to_bytes(octets, "little")
        pause = self._safe_pause if safe else self._sdo_pause
        self._exchanged(what, pause, lambda: self._client.download(index, subindex, payload))

    def _exchanged(self, what: str, pause: Backoff, transfer: Callable[[], Reply]) -> Reply:
        """Make one SDO transfer through the library. Raises HalError."""
        waits = pause is self._sdo_pause and not pause.insisting
        pause.check(not_yet=waits and self._bus.now() < self._late_until)
        text = f"{self._name()}, {what}: "
        try:
            found = transfer()
        except TimeoutError:
            raise pause.failed(text + self._no_reply()) from None
        except self._client.ABORTED as error:
            raise Aborted(f"{text}refused: {error}") from error
        except self._client.FAILURES as error:
            raise pause.failed(f"{text}no SDO reply to the request ({error})") from error
        pause.mended()
        return found

    def exchange(self, request: bytes) -> bytes:
        """Send a request of eight bytes. Return the reply that names the same object. Raises
        TimeoutError or HalError."""
        self._bus.take()  # drops a late reply to the last request
        self._answer, self._stray, self._asked = None, "", request[1:4]
        began = self._bus.now()
        try:
            self.post(request)
            self._bus.wait(lambda: self._answer is not None, self._timeout_s)
        finally:
            self._asked = None
            took_s, failed = self._bus.now() - began, not self._answer or self._answer[0] == ABORTED
            self._bus.units.ended(f"node {self._node}", took_s, failed=failed)
        if self._answer is None:
            self._late_until = self._bus.now() + LATE * self._timeout_s
            raise TimeoutError
        return self._answer

    def post(self, request: bytes) -> None:
        """Send these eight bytes. The node does not reply to them. Raises HalError."""
        self._bus.send(Frame(SDO_TO_NODE + self._node, request))

    def _hear_beat(self, frame: Frame, at: float) -> None:
        if len(frame.payload) != 1:
            self._odd_beat = f"one of {len(frame.payload)} bytes"
            return
        self._odd_beat = ""
        self._state, self._beat_at = frame.payload[0] & 0x7F, at
        if self._state == 0:
            self.starts += 1
            self._sdo_pause.mended()
            self._safe_pause.mended()

    def _hear_reply(self, frame: Frame, at: float) -> None:
        reply = frame.payload
        if len(reply) != 8:
            self._stray = f"a reply of {len(reply)} bytes"
        elif reply[1:4] != self._asked:
            index, subindex = struct.unpack("<HB", reply[1:4])
            self._stray = f"a reply about 0x{index:04X}:{subindex:02X}"
        else:
            self._answer = reply

    def _beats(self) -> bool:
        return self._bus.now() - self._beat_at < (self._beat_limit_s or 0.0)

    def _silent(self) -> str:
        text = f"{self._name()}: no heartbeat within {self._beat_limit_s:g} s"
        nodes = [found - HEARTBEAT for found in self._bus.others() if 1 <= found - HEARTBEAT <= 127]
        if self._odd_beat:
            return f"{text}, but {self._odd_beat}: is it a CANopen node?"
        if nodes:
            return f"{text}, but heartbeats of node {', '.join(map(str, nodes))}: is 'node' right?"
        return f"{text}: {self._bus.silence()}"

    def _no_reply(self) -> str:
        text = f"no reply within {self._timeout_s:g} s"
        return f"{text}, but {self._stray}" if self._stray else text

    def _name(self) -> str:
        return f"CANopen node {self._node} at {self._bus.where}"


def _client(node: CanOpenNode) -> "Client":
    """Return the library's client. Only this function imports the library."""
    from drivers.hal.can.sdo import Client

    return Client(node.exchange, node.post)
