"""A request to a Modbus unit and its answer. `tcp.py` and `rtu.py` carry both.

Only functions 1 to 6 are used: they read the four tables, and write one coil or one register.
"""

from typing import Final, NamedTuple, Protocol

from msgspec import Struct

from drivers.hal import HalError
from drivers.hal.modbus.points import Table

READS: Final[dict[Table, int]] = {
    "coil": 1,
    "discrete input": 2,
    "holding register": 3,
    "input register": 4,
}
WRITES: Final[dict[Table, int]] = {"coil": 5, "holding register": 6}
COIL_ON: Final = 0xFF00

EXCEPTIONS: Final = {
    1: "illegal function: the unit has no such table",
    2: "illegal data address: the unit has no such address; addresses begin at 0",
    3: "illegal data value",
    4: "server device failure: look at the unit",
    5: "acknowledge: the unit is still busy with the request",
    6: "server device busy",
    7: "negative acknowledge",
    8: "memory parity error: look at the unit",
    10: "gateway path unavailable: look at the gateway's settings",
    11: "gateway target device failed to respond: look at the unit's power, cable and id",
}
"""Modbus Application Protocol V1.1b3, section 7."""
UNDEFINED: Final = (
    "which Modbus does not define: the unit is at fault; ask its maker for the meaning"
)
ILLEGAL_ADDRESS: Final = 2


class UnitRequest(Struct, frozen=True):
    """One request. `value`: the number of bits or registers to read, or the value to write."""

    unit: int
    function: int
    address: int
    value: int


class UnitReply(NamedTuple):
    """A unit's reply: bits or registers as numbers, or the number of an exception, which may be 0."""

    values: tuple[int, ...] = ()
    exception: int | None = None


class Unreachable(Exception):
    """There is no connection. The text gives the cause."""


class NoReply(Exception):
    """No reply to the request came in time. The text describes what came instead."""


class BadReply(Exception):
    """The reply does not belong to the request."""


class UnitException(HalError):
    """The unit answered with an exception; `code` is its number."""

    def __init__(self, text: str, code: int) -> None:
        super().__init__(text)
        self.code = code


class UnitWire(Protocol):
    """The connection or line to some units, reopened when needed."""

    def owes(self, unit: int) -> bool:
        """May this unit still reply to an older request? Then a new request should wait."""

    def begin(self, unit: int) -> None:
        """Wait, before a new request, until no late reply can pass for its reply."""

    def connect(self) -> None:
        """Connect if necessary, and start the time of one try. Raises Unreachable."""

    def ask(self, question: UnitRequest) -> UnitReply:
        """Send this request, and return its answer. Raises NoReply."""

    def close(self) -> None:
        """Close the connection. May be called twice."""
