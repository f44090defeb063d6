"""Registers of Modbus units: where they are, and reading and writing them over a ModbusBus.

Places are spelled like points but without a unit (`holding register 4`, `coil 0`): a register map
serves several units. Addresses are those on the wire, from 0; a number of the data model, which
begins at 1 (40001 is holding register 0, 30001 input register 0), is refused with what is meant.
"""

import re
from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING, Annotated, Final

import msgspec

from drivers.hal import HalError
from drivers.hal.modbus.points import Point, Range, Table, ranges
from drivers.hal.modbus.wire import BadReply

if TYPE_CHECKING:
    from pymodbus.client.mixin import ModbusClientMixin
    from pymodbus.pdu import ModbusPDU

    from drivers.hal.modbus import ModbusBus

Word = Annotated[int, msgspec.Meta(ge=0, le=65535)]
"""What a register holds."""
Unit = Annotated[int, msgspec.Meta(ge=0, le=255)]
Place = Annotated[str, msgspec.Meta(min_length=1, max_length=40)]
"""`holding register 4`, `input register 0x10`, `coil 0` or `discrete input 2`."""

TABLES: Final[dict[str, Table]] = {
    "coil": "coil",
    "discrete input": "discrete input",
    "holding register": "holding register",
    "input register": "input register",
}
REGISTERS: Final = ("holding register", "input register")
WRITABLE: Final = ("coil", "holding register")
READ_REGISTERS: Final[dict[Table, int]] = {"holding register": 3, "input register": 4}
WRITE_REGISTER: Final = 6

_MODEL: Final[dict[str, Table]] = {"4": "holding register", "3": "input register"}
_SPELLING: Final = re.compile(r"(?P<table>[a-z][a-z _-]*?)[\s_]+(?P<address>0x[0-9a-f]+|[0-9]+)")


def place(text: str, tables: Collection[str] = tuple(TABLES)) -> tuple[Table, int]:
    """Table and address of a place. Raises ValueError with what to write instead."""
    how = " or ".join(f"'{table} 0'" for table in tables)
    words = _SPELLING.fullmatch(text.strip().lower())
    table = TABLES.get(re.sub(r"[\s_-]+", " ", words["table"])) if words else None
    if words is None or table is None or table not in tables:
        raise ValueError(f"{text!r}: write {how}; addresses begin at 0")
    address = int(words["address"], 0 if words["address"].startswith("0x") else 10)
    if address > 65535:
        raise ValueError(f"address {words['address']} does not exist: addresses are 0 to 65535")
    if (model := words["address"])[0] in _MODEL and len(model) == 5 and table == _MODEL[model[0]]:
        raise ValueError(
            f"{model} looks like a number of the data model, which begins at 1: write"
            f" {table} {int(model[1:]) - 1}; or 0x{address:x} if {model} really is the address"
        )
    return table, address


def misplaced(text: str, tables: Collection[str]) -> str | None:
    """What is wrong with a place, for a struct's `problems`."""
    try:
        place(text, tables)
    except ValueError as error:
        return str(error)
    return None


def at(unit: int, text: str, base: int = 0) -> Point:
    """A place that is right, at this unit; `base` is added to its address."""
    table, address = place(text)
    return Point(unit, table, address + base)


def read(bus: "ModbusBus", points: Iterable[Point]) -> dict[Point, int]:
    """These registers and bits (0 or 1), read now. Raises HalError.

    Neighbours are asked for together, and nothing besides: an operator may lack what lies between.
    """
    image: dict[Point, int] = {}
    for asked in ranges(points, gap=0):
        if asked.table in READ_REGISTERS:
            image.update(_read_registers(bus, asked))
        else:
            image.update({point: int(bit) for point, bit in bus.read(asked).items()})
    return image


def write(bus: "ModbusBus", point: Point, value: int) -> None:
    """Set this register or coil. Raises HalError; then it may be set or not.

    A repeat must change nothing: the bus tries again when a reply is lost.
    """
    if point.table == "coil":
        bus.write(point, bool(value))
        return

    def call(client: "ModbusClientMixin[ModbusPDU]") -> "ModbusPDU":
        reply = client.write_register(point.address, value, device_id=point.unit)
        if not reply.isError() and (reply.address, reply.registers) != (point.address, [value]):
            raise BadReply("the echo of another write")
        return reply

    bus.ask(point.unit, WRITE_REGISTER, f"write register {point.address}", call)


def _read_registers(bus: "ModbusBus", asked: Range) -> dict[Point, int]:
    def call(client: "ModbusClientMixin[ModbusPDU]") -> "ModbusPDU":
        holding = asked.table == "holding register"
        ask = client.read_holding_registers if holding else client.read_input_registers
        reply = ask(asked.start, count=asked.count, device_id=asked.unit)
        if not reply.isError() and len(reply.registers) != asked.count:
            raise BadReply(f"{len(reply.registers)} registers for {asked.count}")
        return reply

    reply = bus.ask(asked.unit, READ_REGISTERS[asked.table], f"read {asked}", call)
    return dict(zip(asked.points(), reply.registers, strict=True))


class RegisterLines:
    """What one device reads, and the one place by which it is commanded.

    `safe`: the command's value that asks for nothing. `readable`: the command can be read back; one
    that cannot is written anew each time, so that a controller that has restarted hears it again.
    """

    def __init__(
        self,
        bus: "ModbusBus",
        reads: Mapping[str, Point],
        command: Point,
        safe: int,
        readable: bool = True,
    ) -> None:
        self._bus = bus
        self._reads = dict(reads)
        self._command = command
        self._safe = safe
        self._readable = readable
        self._asked = {*self._reads.values(), *({command} if readable else ())}
        self._written: int | None = None
        self._claimed = False
        self._touched = False
        self._guard = bus.guard({command.unit})

    def claim(self) -> None:
        """See that the unit answers, then command nothing; once only.

        Claimed again after a failure it only reads: a door that is held must not drop because one
        reply was lost.
        """
        self._written = None
        self._guard.check()
        read(self._bus, self._asked)
        if not self._claimed:
            self.write(self._safe)
            self._claimed = True

    def read(self) -> dict[str, int]:
        """Each value by its name. Raises HalError, also when the command is not as it was written."""
        written, self._written = self._written, None
        self._guard.check()
        image = read(self._bus, self._asked)
        self._verify(image, written)
        self._written = written
        return {name: image[point] for name, point in self._reads.items()}

    def write(self, value: int) -> None:
        """Command this, and read it back; nothing is sent when it is known to be so."""
        if self._readable and self._written == value:
            return
        self._written, self._touched = None, True
        write(self._bus, self._command, value)
        if self._readable:
            self._verify(read(self._bus, {self._command}), value)
        self._written = value

    def make_safe(self) -> None:
        """Command nothing, whatever was known."""
        self._written = None
        self.write(self._safe)

    def close(self) -> None:
        """Command nothing, one try whatever the pauses; not if nothing was ever commanded."""
        if not self._touched:
            return
        self._bus.insist()
        try:
            write(self._bus, self._command, self._safe)
        except HalError:
            return  # nobody is left to tell

    def _verify(self, image: Mapping[Point, int], written: int | None) -> None:
        seen = image.get(self._command)
        if written is not None and seen is not None and seen != written:
            raise HalError(
                f"{self._command} reads {seen} after {written} was written: the controller has"
                " restarted, its watchdog has tripped, or somebody else writes it"
            )
