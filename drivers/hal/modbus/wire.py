"""One question to a Modbus unit and what it answers, whatever wire carries them (`tcp.py`, `rtu.py`).

Of the protocol, functions 1 to 6 are spoken: reads of the four tables, and writes of one coil or one
register.
"""

from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol

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
    9: "an exception that Modbus does not define",
    10: "gateway path unavailable: look at the gateway's settings",
    11: "gateway target device failed to respond: look at the unit's power, cable and id",
}
"""Modbus Application Protocol V1.1b3, section 7."""
ILLEGAL_ADDRESS: Final = 2


@dataclass(frozen=True, slots=True)
class Question:
    """One request. `value`: how many bits or registers are read, or what is sent to be written."""

    unit: int
    function: int
    address: int
    value: int


class Answer(NamedTuple):
    """What a unit says: bits and registers as numbers, or an exception (0 for none)."""

    values: tuple[int, ...] = ()
    exception: int = 0


class Unreachable(Exception):
    """There is no connection; the text says why."""


class NoReply(Exception):
    """Nothing has come in time, or nothing that answers."""


class BadReply(Exception):
    """What came does not answer what was asked."""


class Refused(HalError):
    """The unit answered with an exception; `code` is its number."""

    def __init__(self, text: str, code: int) -> None:
        super().__init__(text)
        self.code = code


class Wire(Protocol):
    """The way to some units, made anew when it is needed."""

    def owes(self, unit: int) -> bool:
        """May this unit still answer an older question, so that a new one had better wait?"""

    def begin(self, unit: int) -> None:
        """A new question to this unit comes: wait until no older answer can be taken for its own."""

    def connect(self) -> None:
        """Have a connection; a try begins here. Raises Unreachable."""

    def ask(self, question: Question) -> Answer:
        """What answers this question. Raises NoReply."""

    def close(self) -> None:
        """Close the connection. May be called twice."""
