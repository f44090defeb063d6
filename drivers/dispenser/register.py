"""A dispenser or ingestor behind a PLC's Modbus registers. A number shows the workcell's status, and a
command starts a cycle.

Before the start the driver writes the numbers that stand for the item, its quantity and its
compartment. A status that the map does not list counts as a fault.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated, Final

import msgspec

from bridges.kinds.dispenser.settings import WorkcellSettings
from bridges.kinds.dispenser.signals import Item, WorkcellOutputs, WorkcellSample
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table
from drivers.dispenser.dry_contact import blind, items_table
from drivers.driver_type import DriverType
from drivers.hal.modbus import ModbusBus
from drivers.hal.modbus.lines import ModbusLines
from drivers.hal.modbus.map_parts import InRegister, WrittenLevels, WrittenPlace
from drivers.hal.modbus.points import Point
from drivers.hal.modbus.registers import REGISTERS, WRITABLE, Unit, Word, at, misplaced
from drivers.numbers import listed_twice

PARTS: Final = ("status", "command", "item", "quantity", "compartment")
Words = Annotated[list[Word], msgspec.Meta(min_length=1)]


class WorkcellStatusWords(InRegister, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The workcell's state as one number. A number that the map does not list counts as a fault."""

    ready: Annotated[
        Words, tells("numbers shown while no cycle runs and the workcell can start a cycle.")
    ]
    busy: Annotated[Words, tells("numbers shown while a cycle runs.")]
    done: Annotated[
        Words,
        tells("numbers shown after a successful cycle, until the daemon writes `rest`."),
    ]
    waits: Annotated[list[Word], tells("numbers shown while the workcell can start no cycle.")] = (
        msgspec.field(default_factory=list)
    )
    faults: Annotated[dict[Word, Name], tells("number -> fault.")] = msgspec.field(
        default_factory=dict
    )

    def problems(self) -> Remarks:
        """Yield a problem for a place that is not a register, and for a number with two meanings."""
        yield from super().problems()
        keys = ("ready", "busy", "done", "waits", "faults")
        yield from listed_twice({key: getattr(self, key) for key in keys})


class StartCommand(WrittenLevels, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The command that starts one cycle."""

    ON = "start"
    OFF = "rest"

    start: Annotated[Word, tells("the value that starts a cycle.")]
    rest: Annotated[Word, tells("the value between cycles.")]


class ItemCode(WrittenPlace, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The number that stands for a name in RMF's request."""

    codes: Annotated[dict[Name, Word], tells("the name in RMF's request -> the number.")]


class WorkcellMap(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The PLC's registers. Addresses begin at 0."""

    status: Annotated[WorkcellStatusWords, tells("the state as one number.")]
    command: Annotated[StartCommand, tells("the command that starts a cycle.")]
    item: Annotated[ItemCode | None, tells("the number of the type_guid.")] = None
    quantity: Annotated[WrittenPlace | None, tells("the register of the quantity.")] = None
    compartment: Annotated[ItemCode | None, tells("the number of the compartment.")] = None

    def places(self) -> dict[str, str]:
        """Return the place (Modbus table and address) of each part that the map gives."""
        parts = {name: getattr(self, name) for name in PARTS}
        return {name: part.at for name, part in parts.items() if part is not None}


class RegisterWorkcellSettings(
    WorkcellSettings, frozen=True, kw_only=True, forbid_unknown_fields=True
):
    """A dispenser or ingestor and its PLC's registers."""

    unit: Annotated[Unit, tells("the PLC's Modbus unit id.")]
    map: Annotated[WorkcellMap, tells("the PLC's registers.")]

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from super().problems()
        found = self.map
        for name, asked in self.items.items():
            path = ("items", name)
            if found.item is None and len(self.items) > 1:
                yield (
                    ("map",),
                    "needs 'item', the number of the type_guid, because there are several items",
                )
            if found.item and name not in found.item.codes:
                yield ("map", "item", "codes"), f"has no number for {name}"
            if found.quantity is None and asked.most > 1:
                yield (*path, "most"), "needs quantity in the map: the register of the quantity"
            if found.compartment is None and len(asked.compartments) > 1:
                yield (
                    (*path, "compartments"),
                    "needs compartment in the map: the register of its number",
                )
            for each in asked.compartments if found.compartment else ():
                if found.compartment and each not in found.compartment.codes:
                    yield ("map", "compartment", "codes"), f"has no number for {each}"
        if found.quantity and misplaced(found.quantity.at, REGISTERS):
            yield ("map", "quantity", "at"), "a quantity needs a holding register"


def points(settings: RegisterWorkcellSettings) -> dict[str, Point]:
    """Return the point (unit, table and address) of each part of the map."""
    return {part: at(settings.unit, text) for part, text in settings.map.places().items()}


def claims(settings: RegisterWorkcellSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield every register or coil that the driver writes, with its path in the YAML. No other device
    may use these registers and coils."""
    for part, text in settings.map.places().items():
        if part != "status" and misplaced(text, WRITABLE) is None:
            yield str(at(settings.unit, text)), ("map", part, "at")


def reads(settings: RegisterWorkcellSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the register of the status, with its path in the YAML."""
    if misplaced(settings.map.status.at, REGISTERS) is None:
        yield str(points(settings)["status"]), ("map", "status", "at")


def describe(settings: RegisterWorkcellSettings, bus: object) -> Iterator[tuple[str, str]]:
    """Yield rows for `check` with the Modbus point of each part of the map."""
    command = settings.map.command
    for part, point in points(settings).items():
        how = f": {command.start} starts, {command.rest} rests" if part == "command" else ""
        yield part, f"{point}{how}"


def tables(settings: RegisterWorkcellSettings) -> Iterator[Table]:
    """Yield tables of the status numbers, and of the numbers that the driver writes."""
    yield from items_table(settings)
    status, found = settings.map.status, settings.map
    keys = ("ready", "busy", "done", "waits")
    rows = [(key, str(number)) for key in keys for number in getattr(status, key)]
    rows += [(text, str(number)) for number, text in status.faults.items()]
    yield Table("status numbers", ("means", "number"), (*rows, ("a fault", "any other")))
    for title, part in (("item numbers", found.item), ("compartment numbers", found.compartment)):
        if part is not None:
            written = tuple((name, str(number)) for name, number in part.codes.items())
            yield Table(title, ("name in RMF", "number"), written)


def create(name: str, settings: RegisterWorkcellSettings, bus: ModbusBus) -> "RegisterWorkcell":
    """Make the workcell's driver on its bus. The driver sends nothing before `open`."""
    outputs = points(settings)
    inputs = {"status": outputs.pop("status")}
    safe = dict.fromkeys(outputs, 0) | {"command": settings.map.command.rest}
    return RegisterWorkcell(settings.map, ModbusLines(bus, inputs, outputs, safe))


class RegisterWorkcell:
    """The driver of one dispenser or ingestor (`drivers.Driver`)."""

    def __init__(self, found: WorkcellMap, lines: ModbusLines) -> None:
        self._map = found
        self._lines = lines

    def open(self) -> None:
        """Check that the PLC answers. At the first call, also write `rest` (no start) to the command,
        and 0 to the item's registers."""
        self._lines.claim()

    def read(self) -> WorkcellSample:
        """Read the status now."""
        return decode(self._map, self._lines.read()["status"])

    def write(self, outputs: WorkcellOutputs) -> None:
        """Write the item's numbers, and then the command.

        If the command is not a start, write `rest` first, so that no start is on while the item's
        numbers change.
        """
        command = {"command": self._map.command.value(outputs.start)}
        if not outputs.start:
            self._lines.bring(command)
        self._lines.bring(encode(self._map, outputs.item))
        self._lines.bring(command)

    def make_safe(self) -> None:
        """Write `rest` to the command and 0 to the item's registers, and read them back."""
        self._lines.make_safe()

    def close(self) -> None:
        """Write `rest` to the command and 0 to the item's registers, if the driver ever wrote. Does not
        raise."""
        self._lines.close()


def decode(found: WorkcellMap, word: int) -> WorkcellSample:
    """Decode the status. Never raises."""
    status = found.status
    known = (*status.ready, *status.busy, *status.done, *status.waits)
    errors = () if word in known else (status.faults.get(word, f"status {word} is not in the map"),)
    return WorkcellSample(
        done=word in status.done,
        busy=word in status.busy,
        ready=word in status.ready,
        errors=errors,
    )


def encode(found: WorkcellMap, item: Item) -> Mapping[str, int]:
    """Return the numbers to write for the item, its quantity and its compartment. The number of
    anything that the request does not give is 0."""
    words = {}
    if found.item:
        words["item"] = found.item.codes.get(item.type_guid, 0)
    if found.quantity:
        words["quantity"] = item.quantity
    if found.compartment:
        words["compartment"] = found.compartment.codes.get(item.compartment, 0)
    return words


DRIVER = DriverType(
    settings=RegisterWorkcellSettings,
    buses=("modbus",),
    create=create,
    describe=describe,
    tables=tables,
    claims=claims,
    reads=reads,
    warnings=lambda settings: blind(settings, busy=True),
    fake="hal_fakes.modbus.register_dispenser",
)
