"""The simulated module's side of a pulse whose length the module measures itself. pymodbus's own server
cannot make such pulses, because it takes any coil value as 1."""

import struct
from typing import Final

from pymodbus.datastore import ModbusServerContext
from pymodbus.pdu import ExceptionResponse, ModbusPDU
from pymodbus.pdu.bit_message import WriteSingleCoilRequest

from hal_fakes.modbus.units import FakeUnits

COIL_VALUES: Final = (0xFF00, 0)


class TimedCoilRequest(WriteSingleCoilRequest):
    """A request of function 5 (write a coil) that keeps the sent value. A value other than on or off
    makes `FakeUnits` give a pulse."""

    def decode(self, data: bytes) -> None:
        """Decode the request, and keep its value."""
        super().decode(data)
        self.registers = [int.from_bytes(data[2:4], "big")]

    async def datastore_update(self, context: ModbusServerContext, device_id: int) -> ModbusPDU:
        """Write the coil. The reply to a pulse's request repeats the request."""
        if self.registers[0] in COIL_VALUES:
            return await super().datastore_update(context, device_id)
        assert isinstance(context, FakeUnits)
        refusal = await context.flash(device_id, self.address, self.registers[0])
        if refusal is not None:
            return ExceptionResponse(self.function_code, refusal)
        return FlashEcho(
            address=self.address,
            registers=self.registers,
            dev_id=self.dev_id,
            transaction_id=self.transaction_id,
        )


class FlashEcho(WriteSingleCoilRequest):
    """The reply to the request for a pulse."""

    def encode(self) -> bytes:
        """Return the request's own bytes."""
        return struct.pack(">HH", self.address, *self.registers)
