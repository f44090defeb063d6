"""pymodbus's replies about registers, refusing what theirs let through."""

import functools
from typing import Any


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
