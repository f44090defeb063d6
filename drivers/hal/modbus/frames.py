"""Modbus frames and their contents, through pymodbus. A bus imports this file when it needs frames.

pymodbus's decoders accept wrong replies, so this file has stricter decoders.

This code does not use pymodbus's client, for four reasons:

- The client's timeout starts again at each byte, and follows the wall clock.
- The client's name lookup has no limit.
- The client repeats requests on a connection that may still hold late replies.
- The client accepts a reply whose function code differs from the request's.

No file imports pymodbus's server, because it costs 15 MB of memory.
"""

import logging
import struct
from functools import lru_cache
from typing import Final

from pymodbus.exceptions import ModbusException
from pymodbus.framer.rtu import FramerRTU
from pymodbus.framer.socket import FramerSocket
from pymodbus.pdu import DecodePDU, ModbusPDU
from pymodbus.pdu.bit_message import (
    ReadCoilsRequest,
    ReadCoilsResponse,
    ReadDiscreteInputsRequest,
    WriteSingleCoilRequest,
    WriteSingleCoilResponse,
)
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersRequest,
    ReadHoldingRegistersResponse,
    ReadInputRegistersRequest,
    WriteSingleRegisterRequest,
    WriteSingleRegisterResponse,
)

from drivers.hal.modbus.wire import READS, BadReply, UnitReply, UnitRequest

logging.getLogger("pymodbus.logging").setLevel(
    logging.CRITICAL
)  # HalErrors report the same failures

FAILURES: Final = (ModbusException, struct.error, IndexError, ValueError)
"""The errors that pymodbus raises for bytes that are not a reply."""


class AnyCoilRequest(WriteSingleCoilRequest):
    """Function 5 with any value. Some modules expect a time in place of on and off."""

    def encode(self) -> bytes:
        """Encode address and value."""
        return struct.pack(">HH", self.address, *self.registers)


REQUESTS: Final[dict[int, type[ModbusPDU]]] = {
    1: ReadCoilsRequest,
    2: ReadDiscreteInputsRequest,
    3: ReadHoldingRegistersRequest,
    4: ReadInputRegistersRequest,
    5: AnyCoilRequest,
    6: WriteSingleRegisterRequest,
}


class Coils(ReadCoilsResponse):
    """A reply with bits. A wrong number of bytes is refused."""

    def decode(self, data: bytes) -> None:
        """Decode the bits. Raises ValueError for a wrong number of bytes."""
        if len(data) < 2 or data[0] != len(data) - 1:
            raise ValueError("its byte count is wrong")
        super().decode(data)


class DiscreteInputs(Coils):
    """A reply with discrete inputs, decoded as `Coils`."""

    function_code = 2


class HoldingRegisters(ReadHoldingRegistersResponse):
    """A reply with holding registers. A wrong number of bytes is refused."""

    def decode(self, data: bytes) -> None:
        """Decode the registers. Raises ValueError for a wrong number of bytes."""
        if len(data) < 3 or data[0] != len(data) - 1 or data[0] % 2:
            raise ValueError("its byte count is wrong")
        super().decode(data)


class InputRegisters(HoldingRegisters):
    """A reply with input registers, decoded as `HoldingRegisters`."""

    function_code = 4


class CoilEcho(WriteSingleCoilResponse):
    """The echo of a coil's address and value. pymodbus's own decoder would read every value as 1."""

    def decode(self, data: bytes) -> None:
        """Decode address and value. Raises ValueError for a wrong number of bytes."""
        if len(data) != 4:
            raise ValueError("the echo of a coil must have four bytes")
        super().decode(data)
        self.registers = [int.from_bytes(data[2:], "big")]


class RegisterEcho(WriteSingleRegisterResponse):
    """The echo of a register's address and value."""

    def decode(self, data: bytes) -> None:
        """Decode address and value. Raises ValueError for a wrong number of bytes."""
        if len(data) != 4:
            raise ValueError("the echo of a register must have four bytes")
        super().decode(data)


DECODER: Final = DecodePDU(is_server=False)
for _reply in (Coils, DiscreteInputs, HoldingRegisters, InputRegisters, CoilEcho, RegisterEcho):
    DECODER.register(_reply)
TCP: Final = FramerSocket(DECODER)
RTU: Final = FramerRTU(DECODER)


def tcp_request(question: UnitRequest, number: int) -> bytes:
    """Return the Modbus TCP frame of this request. `number` is the transaction number, which must not
    be 0. Raises BadReply."""
    return number.to_bytes(2, "big") + _after_number(question)


@lru_cache(maxsize=1024)
def _after_number(question: UnitRequest) -> bytes:
    return TCP.buildFrame(_request(question, 1))[2:]


def tcp_answer(question: UnitRequest, number: int, heard: bytes) -> tuple[int, UnitReply | None]:
    """Return how many bytes of `heard` were used, and the answer. The answer is None until it is
    complete. Raises BadReply.

    `number` is the request's transaction number. Replies with another number and replies of other units
    are dropped. pymodbus alone would accept a reply with number 0 for any request. pymodbus would also
    accept any unit's reply to a request to unit 0.
    """
    used = 0
    while True:
        size, unit, replied, content = TCP.decode(heard[used:])
        used += size
        if not content:
            return used, None
        if replied == 0:
            raise BadReply("the reply's transaction number is 0, not the request's number")
        if (unit, replied) == (question.unit, number):
            return used, _decoded(question, content)


def rtu_request(question: UnitRequest) -> bytes:
    """Return the request's frame on a serial line. Raises BadReply."""
    return RTU.buildFrame(_request(question))


def rtu_answer(question: UnitRequest, frame: bytes) -> UnitReply:
    """Return the answer in a frame with a valid CRC. Raises BadReply."""
    return _decoded(question, frame[1:-2])


def rtu_size(heard: bytes) -> int:
    """Return the size of the reply at the beginning of `heard`. Return 0 if there are too few bytes.
    Raises BadReply."""
    if len(heard) < 5:  # the shortest reply is an exception, with five bytes
        return 0
    try:
        sort = DECODER.lookupPduClass(heard)
        if sort is None:
            raise BadReply(f"function {heard[1]} is not known")
        return sort.calculateRtuFrameSize(heard)
    except FAILURES as error:
        raise BadReply(str(error)) from error


def crc_fits(frame: bytes) -> bool:
    """Are these bytes a frame with a valid CRC?"""
    crc = int.from_bytes(frame[-2:], "big")
    return len(frame) >= 4 and FramerRTU.check_CRC(frame[:-2], crc)


def _request(question: UnitRequest, number: int = 0) -> ModbusPDU:
    function, where = question.function, (question.unit, number, question.address)
    if function in (5, 6):
        return REQUESTS[function](*where, registers=[question.value])
    return REQUESTS[function](*where, count=question.value)


_last: Final[dict[UnitRequest, tuple[bytes, UnitReply]]] = {}
"""The bytes of the last reply to each read request, and the decoded answer. Most polls bring the same
bytes again, so the answer need not be decoded again."""


def _decoded(question: UnitRequest, content: bytes) -> UnitReply:
    """Decode the answer from a frame's function and data. Raises BadReply."""
    last = _last.get(question)
    if last is not None and last[0] == content:
        return last[1]
    answer = _answer(question, _pdu(content))
    if question.function in READS.values():
        _last[question] = content, answer
    return answer


def _pdu(content: bytes) -> ModbusPDU:
    try:
        reply = DECODER.decode(content)
    except FAILURES as error:
        raise BadReply(str(error)) from error
    if reply is None:
        raise BadReply(f"{content.hex(' ')} does not decode")
    return reply


def _answer(question: UnitRequest, reply: ModbusPDU) -> UnitReply:
    """Return the answer in the reply. Raises BadReply if the reply does not belong to the request."""
    function, asked = question.function, question.value
    if reply.function_code & 0x7F != function:
        raise BadReply(f"function {reply.function_code} instead of {function}")
    if reply.isError():
        return UnitReply(exception=reply.exception_code)
    if function in (5, 6):
        if (reply.address, reply.registers) != (question.address, [asked]):
            raise BadReply("the echo of another write")
        return UnitReply((asked,))
    found = reply.bits if function in (1, 2) else reply.registers
    if len(found) != (-(-asked // 8) * 8 if function in (1, 2) else asked):
        sort = "bits" if function in (1, 2) else "registers"
        raise BadReply(f"{len(found)} {sort} for {asked}")
    return UnitReply(tuple(int(value) for value in found[:asked]))
