"""A request to a Modbus unit, and its answer. `tcp.py` and `rtu.py` carry requests and answers.

The daemon uses only functions 1 to 6. These functions read the four tables, and write one coil or one
register.
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
"""The meanings of exception codes (Modbus Application Protocol V1.1b3, section 7)."""
UNDEFINED: Final = "a code that Modbus does not define: the unit is at fault, so ask its maker"
ILLEGAL_ADDRESS: Final = 2


class UnitRequest(Struct, frozen=True):
    """One request. `value` is the number of bits or registers to read, or the value to write."""

    unit: int
    function: int
    address: int
    value: int


class UnitReply(NamedTuple):
    """A unit's reply. `values` has the bits or registers as numbers. If the unit has answered with an
    exception, `exception` is its code, which may be 0."""

    values: tuple[int, ...] = ()
    exception: int | None = None


class Unreachable(Exception):
    """The error of a connection that cannot be made. The error's text gives the cause."""


class NoReply(Exception):
    """The error of a request that gets no reply in time. The error's text describes any other bytes
    that came."""


class BadReply(Exception):
    """The error of a reply that is invalid, or that is not the reply to the request."""


class UnitException(HalError):
    """The error of a unit that answered with an exception. `code` is the exception's number."""

    def __init__(self, text: str, code: int) -> None:
        super().__init__(text)
        self.code = code


class UnitWire(Protocol):
    """The connection or line to some units. It opens again when needed."""

    def owes(self, unit: int) -> bool:
        """May this unit still reply to an older request? In this case a new request should wait."""

    def begin(self, unit: int) -> None:
        """Wait until no late reply can pass for the reply to a new request."""

    def connect(self) -> None:
        """Connect if necessary, and start the time limit of one try. Raises Unreachable."""

    def ask(self, question: UnitRequest) -> UnitReply:
        """Send this request, and return its answer. Raises NoReply."""

    def close(self) -> None:
        """Close the connection. The caller may call `close` twice."""
