"""One CANopen node: its heartbeat, and its objects by SDO (CiA 301), through the `canopen` library.

The library knows the protocol; asking, waiting and pausing is done here, in the loop's thread. It would
take whatever comes on the reply's id for the answer, within its time limit or not. Here

- a reply counts when it has eight bytes and names the object that was asked for; any other is dropped,
  and named when the answer does not come;
- after a question that stays without an answer the node is left alone until its answer cannot come any
  more, LATE times the time that it had: a late reply is never the answer to the next question;
- no question is sent twice.

A node that has gone pauses as every device does; its heartbeat or its start ends the pause.
"""

import functools
import logging
import struct
from typing import Any, Final

from drivers.hal import HalError
from drivers.hal.can import CanBus, Frame, Wanted

LATE: Final = 3.0
SDO_TO_NODE: Final = 0x600
SDO_FROM_NODE: Final = 0x580
HEARTBEAT: Final = 0x700
ABORTED: Final = 0x80
STATES: Final = {0: "starting", 4: "stopped", 5: "operational", 127: "pre-operational"}
OPERATIONAL: Final = 5


class CanOpenNode:
    """One node of a bus. `heartbeat_timeout_s`: None for a node that has no heartbeat.

    `starts`: how often the node has said that it starts anew.
    """

    def __init__(self, bus: CanBus, node: int, heartbeat_timeout_s: float | None) -> None:
        self.starts = 0
        self._bus = bus
        self._node = node
        self._beat_limit_s = heartbeat_timeout_s
        self._timeout_s = bus.settings.timeout_s
        self._beat_pause = bus.backoff()
        self._sdo_pause = bus.backoff()
        self._state = OPERATIONAL
        self._beat_at = float("-inf")
        self._asked: bytes | None = None
        self._answer: bytes | None = None
        self._stray = ""
        self._odd_beat = ""
        self._late_until = float("-inf")
        self._client: Any = None
        bus.listen([Wanted(HEARTBEAT + node)], self._hear_beat)
        bus.listen([Wanted(SDO_FROM_NODE + node)], self._hear_reply)

    def alive(self) -> None:
        """Take what has come. Raises HalError when there is no heartbeat, or it is not operational."""
        self._bus.take()
        if self._beat_limit_s is None:
            return
        if not self._beats():
            self._beat_pause.check()
            if not self._bus.wait(self._beats, self._timeout_s):
                raise self._beat_pause.failed(self._silent())
        self._beat_pause.mended()
        if self._state != OPERATIONAL:
            state = STATES.get(self._state, f"in state {self._state}")
            raise HalError(f"{self._name()} is {state}, not operational: look at the node")

    def read(self, index: int, subindex: int, octets: int) -> int:
        """An unsigned number of so many octets. Raises HalError."""
        found = self._exchanged(f"read 0x{index:04X}:{subindex:02X}", "upload", index, subindex)
        number = bytes(found)[:octets]
        if len(number) < octets or any(found[octets:]):
            size = f"{len(found)} bytes ({found.hex(' ')})"
            raise HalError(
                f"{self._name()}, read 0x{index:04X}:{subindex:02X}: {size} for a number of {octets}"
            )
        return int.from_bytes(number, "little")

    def write(self, index: int, subindex: int, octets: int, number: int) -> None:
        """Set an unsigned number. Raises HalError; then it may be set or not."""
        what = f"write 0x{index:04X}:{subindex:02X}"
        payload = number.to_bytes(octets, "little")
        self._exchanged(what, "download", index, subindex, payload)

    def _exchanged(self, what: str, call: str, *arguments: Any) -> Any:
        """One SDO transfer by the library. Raises HalError."""
        owes = self._bus.now() < self._late_until and not self._sdo_pause.insisting
        self._sdo_pause.check(not_yet=owes)
        text = f"{self._name()}, {what}: "
        if self._client is None:
            self._client = _client(self)
        try:
            found = getattr(self._client, call)(*arguments)
        except TimeoutError:
            raise self._sdo_pause.failed(text + self._no_reply()) from None
        except _aborts() as error:
            raise HalError(f"{text}refused: {error}") from error
        except _failures() as error:
            raise self._sdo_pause.failed(f"{text}no SDO reply to it ({error})") from error
        self._sdo_pause.mended()
        return found

    def exchange(self, request: bytes) -> bytes:
        """Send these eight bytes; the reply about the same object. Raises TimeoutError, HalError."""
        self._bus.take()  # what comes too late for the last question goes here
        self._answer, self._stray, self._asked = None, "", request[1:4]
        try:
            self.post(request)
            self._bus.wait(lambda: self._answer is not None, self._timeout_s)
        finally:
            self._asked = None
        if self._answer is None:
            self._late_until = self._bus.now() + LATE * self._timeout_s
            raise TimeoutError
        return self._answer

    def post(self, request: bytes) -> None:
        """Send these eight bytes, to which no reply comes. Raises HalError."""
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
            return f"{text}, but of node {', '.join(map(str, nodes))}: is 'node' right?"
        return f"{text}: {self._bus.silence()}"

    def _no_reply(self) -> str:
        text = f"no reply within {self._timeout_s:g} s"
        return f"{text}, but {self._stray}" if self._stray else text

    def _name(self) -> str:
        return f"CANopen node {self._node} at {self._bus.where}"


@functools.cache
def _aborts() -> type[Exception]:
    from canopen import SdoAbortedError

    return SdoAbortedError


@functools.cache
def _failures() -> tuple[type[Exception], ...]:
    from canopen import SdoCommunicationError

    return (SdoCommunicationError, struct.error)


def _client(node: CanOpenNode) -> Any:
    """The library's SDO client, on an exchange of ours."""
    from canopen import ObjectDictionary, SdoAbortedError
    from canopen.sdo.client import SdoClient

    logging.getLogger("canopen").setLevel(logging.CRITICAL)  # our HalErrors say it all

    class Client(SdoClient):
        def request_response(self, sdo_request: Any) -> bytes:
            reply = node.exchange(bytes(sdo_request))
            if reply[0] == ABORTED:
                raise SdoAbortedError(int.from_bytes(reply[4:8], "little"))
            return reply

        def send_request(self, request: Any) -> None:
            node.post(bytes(request))

    return Client(0, 0, ObjectDictionary())  # type: ignore[no-untyped-call]
