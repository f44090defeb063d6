"""What units say: the exceptions' texts, and pymodbus's replies about registers, refusing what theirs
let through.
"""

import functools
from typing import Any, Final

EXCEPTIONS: Final = {
    1: "illegal function: the unit has no such table",
    2: "illegal data address: the unit has no such address; addresses begin at 0",
    3: "illegal data value",
    4: "server device failure: look at the unit",
    5: "acknowledge: the unit is still busy with the request",
    6: "server device busy",
    7: "negative acknowledge",
    8: "memory parity error: look at the unit",
    9: "an exception that Modbus does not define",
    10: "gateway path unavailable: look at the gateway's settings",
    11: "gateway target device failed to respond: look at the unit's power, cable and id",
}
"""Modbus Application Protocol V1.1b3, section 7."""


@functools.cache
def register_replies() -> tuple[Any, ...]:
    """For `register` of a client or decoder: functions 3, 4 and 6."""
    from pymodbus.pdu.register_message import (
        ReadHoldingRegistersResponse,
        WriteSingleRegisterResponse,
    )

    class Holding(ReadHoldingRegistersResponse):
        def decode(self, data: bytes) -> None:
            if len(data) < 3 or data[0] != len(data) - 1 or data[0] % 2:
                raise ValueError("its byte count is wrong")
            super().decode(data)

    class Inputs(Holding):
        function_code = 4

    class Echo(WriteSingleRegisterResponse):
        def decode(self, data: bytes) -> None:
            if len(data) != 4:
                raise ValueError("it is no register's value")
            super().decode(data)

    return (Holding, Inputs, Echo)
