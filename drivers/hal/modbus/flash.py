"""Pulses that a module times itself: "flash on" of Waveshare's Modbus RTU Relay boards.

Function 5 at an address of its own for each relay (0x0200 and the relay's number, from 0), with tenths
of a second in place of a coil's two values; the reply is its echo. The maker's manual, protocol V2:
`01 05 02 00 00 07 8D B0` has relay 0 of unit 1 on for 0.7 s. Asked again, the time begins again: so it
is sent once, whatever the bus's `retries`.
"""

import functools
import struct
from typing import TYPE_CHECKING, Any, Final

from drivers.hal.modbus.points import Point
from drivers.hal.modbus.wire import BadReply

if TYPE_CHECKING:
    from pymodbus.client.mixin import ModbusClientMixin
    from pymodbus.pdu import ModbusPDU

    from drivers.hal.modbus import ModbusBus

WRITE_COIL: Final = 5


def ask_for(bus: "ModbusBus", place: Point, on_s: float) -> None:
    """Have the module pulse the relay that this place is for. Raises HalError; then it may pulse."""
    tenths = round(on_s * 10)

    def call(client: "ModbusClientMixin[ModbusPDU]") -> "ModbusPDU":
        request = _request()(address=place.address, registers=[tenths], dev_id=place.unit)
        reply = client.execute(False, request)
        if not reply.isError() and (reply.address, reply.registers) != (place.address, [tenths]):
            raise BadReply("the echo of another write")
        return reply

    bus.ask(place.unit, WRITE_COIL, f"flash at coil {place.address:#x}", call, once=True)


@functools.cache
def _request() -> Any:
    from pymodbus.pdu.bit_message import WriteSingleCoilRequest

    class FlashRequest(WriteSingleCoilRequest):
        def encode(self) -> bytes:
            return struct.pack(">HH", self.address, *self.registers)

    return FlashRequest
