"""The spelling of a point of a Modbus module in a YAML: unit, table and address.

A contact is a discrete input, a coil, or one bit of a register. A relay is a coil. Addresses begin at
0, as in the frames on the wire.

Manuals often print the numbers of the data model. These numbers begin at 1, and their first digit is
the table. For example, coil 0 is 00001, discrete input 0 is 10001, input register 0 is 30001, and
holding register 0 is 40001. Such a number is refused, and the error suggests the probable address.
"""

import re
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Final, Literal

from msgspec import Struct

from drivers.hal.points import Wire
from drivers.numbers import BITS

Table = Literal["coil", "discrete input", "holding register", "input register"]
"""The name of one of a unit's four tables. A `Point` of this file also has a unit. For places without a
unit see `registers.py`."""

GAP_MAX: Final[dict[Table, int]] = {
    "coil": 8,
    "discrete input": 8,
    "holding register": 0,
    "input register": 0,
}
"""The maximum number of unused addresses between two points of one read request, for each table.

For registers this number is 0, because a controller may lack an unused register. A controller may also
take the reading of a register as an acknowledgement.
"""
COUNT_MAX: Final[dict[Table, int]] = {
    "coil": 2000,
    "discrete input": 2000,
    "holding register": 125,
    "input register": 125,
}
"""The maximum number of bits or registers in one reply (Modbus Application Protocol V1.1b3, 6.1 to
6.4)."""

_MODEL_DIGIT: Final[dict[Table, int]] = {
    "coil": 0,
    "discrete input": 1,
    "input register": 3,
    "holding register": 4,
}
_TABLES: Final[dict[str, Table]] = {
    **{name: name for name in _MODEL_DIGIT},
    "holding": "holding register",
}
_SPELLING: Final = re.compile(
    r"unit\s*(?P<unit>[0-9]+)[\s,]+(?P<table>[a-z][a-z\s_-]*?)[\s_]*(?P<address>0x[0-9a-f]+|[0-9]+)"
    r"(?:[\s,]+bit\s*(?P<bit>[0-9]+))?"
)
_HOW: Final = (
    "write 'unit 1 coil 0', 'unit 1 discrete input 0' or 'unit 1 holding register 0 bit 0';"
    " addresses begin at 0"
)


class Point(Struct, frozen=True, order=True):
    """One coil, discrete input or register of one unit, or one bit of a register.

    `str` gives the point's canonical spelling.
    """

    unit: int
    table: Table
    address: int
    bit: int | None = None

    def __str__(self) -> str:
        plain = str(self.address)
        address = f"0x{self.address:x}" if _is_model_number(self.table, plain) else plain
        bit = "" if self.bit is None else f" bit {self.bit}"
        return f"unit {self.unit} {self.table} {address}{bit}"

    @property
    def cell(self) -> "Point":
        """Return the point to read. For one bit of a register, this is the whole register."""
        return self if self.bit is None else Point(self.unit, self.table, self.address)

    def of(self, value: int) -> int:
        """Return the point's value. `value` is the content of the coil, input or whole register
        (`cell`)."""
        return value if self.bit is None else value >> self.bit & 1


class Range(Struct, frozen=True):
    """Neighbouring addresses of one table, read with one request."""

    unit: int
    table: Table
    start: int
    count: int

    def __str__(self) -> str:
        if self.count == 1:
            return f"{self.table} {self.start}"
        return f"{self.table}s {self.start} to {self.start + self.count - 1}"

    @lru_cache(maxsize=1024)  # noqa: B019 - a range lives as long as its device
    def points(self) -> list[Point]:
        """Return every point in the range, in the order of the reply."""
        return [Point(self.unit, self.table, self.start + i) for i in range(self.count)]


def parse(text: str) -> Point:
    """Parse any spelling of a point. Raises ValueError with the right spelling."""
    words = _SPELLING.fullmatch(text.strip().lower())
    if not words:
        raise ValueError(f"{text!r} is not a Modbus point: {_how(text)}")
    unit, table = int(words["unit"]), _table(text, words["table"])
    if unit > 247 and unit != 255:
        raise ValueError(f"unit {unit} does not exist: units are 0 to 247, and 255 on Modbus TCP")
    address_on_wire = address(table, words["address"])
    return Point(unit, table, address_on_wire, _bit(text, table, words["bit"]))


def canonical(point: str) -> str:
    """Return `unit 1 coil 0` for `Unit 1 COIL 0`. Raises ValueError with the right spelling."""
    return str(parse(point))


def describe(point: str) -> str:
    """Return the point with its number in manuals: `unit 1 coil 0 (00001)`."""
    found = parse(point)
    digit, bit = _MODEL_DIGIT[found.table], "" if found.bit is None else f" bit {found.bit}"
    return f"{found} ({digit}{found.address + 1:04}{bit})"


def wire_problems(wire: Wire) -> Iterable[str]:
    """Yield the errors in this wire on a Modbus module."""
    try:
        point = parse(wire.point)
    except ValueError:
        return  # the spelling check reports an invalid point
    if wire.pull is not None:
        yield "pull is for GPIO pins; the module has resistors of its own: delete pull"
    if wire.direction == "in":
        return
    yield from _flash_problems(wire, point)
    if point.bit is not None:
        yield (
            "an output must be a coil: a write to a register would also write its other bits, which"
            " another device may use. The driver 'register' can write whole registers"
        )
    elif point.table != "coil":
        yield f"an output is a coil, and a {point.table} can only be read"
    if wire.active == "low":
        yield (
            "active: low would switch the relay on whenever the module restarts with its coils at 0:"
            " use the relay's normally open contact and write active: high"
        )


def wire_warnings(wire: Wire) -> Iterable[str]:
    """Yield a warning for a relay if the driver cannot verify that the relay went off. Yield no warning
    for a lift call, because a call ends by itself."""
    if wire.direction == "out" and not (wire.read_back or wire.clearing):
        yield "the coil is not read back: switching it off is not verified"


def _flash_problems(wire: Wire, output: Point) -> Iterable[str]:
    if wire.flash is None:
        return
    flash = parse(wire.flash.point)
    if flash.table != "coil":
        yield f"flash is a write to a coil, not to a {flash.table}"
    if flash.unit != output.unit:
        yield f"flash is at unit {flash.unit}, but the relay is at unit {output.unit}: correct one"


def ranges(points: Iterable[Point], gap: int | None = None) -> list[Range]:
    """Return as few read requests as possible for all these points. A request also reads gaps of up to
    `gap` addresses between the points.

    Without `gap`, the widest gap is the table's GAP_MAX.
    """
    found: list[Range] = []
    for point in sorted(set(points)):
        last = found[-1] if found else None
        if last and _joins(last, point, gap):
            found[-1] = Range(last.unit, last.table, last.start, point.address - last.start + 1)
        else:
            found.append(Range(point.unit, point.table, point.address, 1))
    return found


def pieces(whole: Range, points: Iterable[Point]) -> Sequence[Range]:
    """Return the parts of a range that contain these points and no other address."""
    return ranges(set(points).intersection(whole.points()), gap=0)


class RefusedRanges:
    """The ranges that a unit has refused to read. A unit refuses a range if it lacks an unused address
    between the used points."""

    def __init__(self) -> None:
        self._found: set[Range] = set()

    def add(self, refused: Range) -> None:
        """Remember a range."""
        self._found.add(refused)

    def within(self, asked: Range) -> bool:
        """Return whether this range contains a refused range."""
        end = asked.start + asked.count
        return any(
            (one.unit, one.table) == (asked.unit, asked.table)
            and asked.start <= one.start
            and one.start + one.count <= end
            for one in self._found
        )


def _joins(last: Range, point: Point, gap: int | None) -> bool:
    same = (last.unit, last.table) == (point.unit, point.table)
    most = GAP_MAX[last.table] if gap is None else gap
    near = point.address - (last.start + last.count) <= most
    return same and near and point.address - last.start < COUNT_MAX[last.table]


def _table(text: str, words: str) -> Table:
    name = " ".join(re.split(r"[\s_-]+", words.strip()))
    if name in _TABLES:
        return _TABLES[name]
    if name == "input":
        raise ValueError(f"{text!r}: say which input: 'discrete input', or 'input register'")
    raise ValueError(f"{text!r}: there is no table {name!r}: {_HOW}")


def _bit(text: str, table: Table, bit: str | None) -> int | None:
    """Return the bit of a register. Return None for a coil or discrete input."""
    if table in ("coil", "discrete input"):
        if bit is not None:
            raise ValueError(f"{text!r}: a {table} is one bit already: leave 'bit {bit}' out")
        return None
    if bit is None:
        raise ValueError(
            f"{text!r}: a contact is one bit: add the bit of the register, such as 'bit 0'"
        )
    if int(bit) >= BITS:
        raise ValueError(
            f"{text!r}: a register has bits 0 to 15, and bit 0 is the least significant"
        )
    return int(bit)


def address(table: Table, text: str) -> int:
    """Parse an address of this table. Raises ValueError with the right spelling."""
    number = int(text, 16) if text.startswith("0x") else int(text)
    if number > 65535:
        raise ValueError(f"address {text} does not exist: addresses are 0 to 65535")
    if _is_model_number(table, text):
        raise ValueError(_model_number(table, text, number))
    return number


def _is_model_number(table: Table, text: str) -> bool:
    if table in ("coil", "discrete input") and text.startswith("0"):
        return len(text) > 1 and not text.startswith("0x")
    return len(text) == 5 and text.startswith(str(_MODEL_DIGIT[table]))


def _model_number(table: Table, text: str, number: int) -> str:
    meant = int(text[1:]) - 1
    hint = f"write {table} {meant}" if meant >= 0 else "the first is address 0"
    return (
        f"{text} looks like a manual's number, and these begin at 1: {hint}. Write 0x{number:x} if"
        f" {number} really is the address on the wire"
    )


def _how(text: str) -> str:
    number = re.fullmatch(r"\s*(?P<digit>[0134])(?P<address>[0-9]{4,5})\s*", text)
    if not number or int(number["address"]) == 0:
        return _HOW
    table = next(t for t, digit in _MODEL_DIGIT.items() if digit == int(number["digit"]))
    bit = " bit 0" if "register" in table else ""
    return f"write 'unit 1 {table} {int(number['address']) - 1}{bit}' with the right unit"
