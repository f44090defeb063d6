"""A door operator that the driver reads and commands through Modbus registers.

The operator's status is one number. The map lists the numbers for open, closed, moving and faults. A
number that the map does not list is a fault too, because the door's position is then unknown. If the
map has a position value, this value must agree with the status. The command holds the door open or
releases the door. No command drives the door shut.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated, Final

from bridges.kinds.door.settings import DoorSettings
from bridges.kinds.door.signals import DoorOutputs, DoorSample
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table
from drivers.door.closing import CLOSING
from drivers.door.register_map import DoorMap, OperatorFaults, Parts, Status
from drivers.driver_type import DriverType
from drivers.hal.modbus import ModbusBus
from drivers.hal.modbus.lines import ModbusLines
from drivers.hal.modbus.points import Point
from drivers.hal.modbus.registers import TABLES, WRITABLE, Unit, Word, at, misplaced, place
from drivers.numbers import bits_on
from drivers.profiles import Profile


class RegisterDoorSettings(DoorSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A door and its operator's registers."""

    unit: Annotated[Unit, tells("the operator's Modbus unit id.")]
    profile: Annotated[
        Name | None, tells("the name of a file in drivers/profiles/ that holds the map.")
    ] = None
    map: Annotated[DoorMap | None, tells("the map, written here instead of a profile.")] = None
    changes: Annotated[
        Parts | None, tells("the parts of the map in which this door differs from the profile.")
    ] = None
    base_address: Annotated[
        Word, tells("added to every address, for several operators behind one unit id.")
    ] = 0

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from super().problems()
        before = list(PROFILE.problems(self.profile, self.map))
        yield from before
        if self.map and self.changes:
            yield (
                ("changes",),
                "is for a profile, but this device has a map: write the changes into the map",
            )
        if not before and max(map(_address, door_map(self).places().values())) > (
            65535 - self.base_address
        ):
            yield ("base_address",), "with this offset an address is above 65535, the last address"
        if self.feedback == "estimated":
            yield ("feedback",), "the status gives the door's position: delete feedback"
        if self.on_fire:
            yield ("on_fire",), "an operator on registers has no fire input: delete on_fire"


PROFILE: Final = Profile("door_register", "map", DoorMap)


def door_map(settings: RegisterDoorSettings) -> DoorMap:
    """Return the YAML's map, or the profile's map if the YAML has no map."""
    return PROFILE.chosen(settings.profile, settings.map).changed(settings.changes)


def points(settings: RegisterDoorSettings) -> dict[str, Point]:
    """Return the point (unit, table and address) of each part of the map."""
    return {
        part: at(settings.unit, text, settings.base_address)
        for part, text in door_map(settings).places().items()
    }


def claims(settings: RegisterDoorSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the register or coil of the command, with its path in the YAML. No other device may use it.
    Yield nothing for an invalid map."""
    if any(PROFILE.problems(settings.profile, settings.map)):
        return
    place_of_command = door_map(settings).command.at
    if misplaced(place_of_command, WRITABLE) is None:
        point = at(settings.unit, place_of_command, settings.base_address)
        written = _part_in(settings, "command")
        yield str(point), (*written, "at") if written else ("unit",)


def reads(settings: RegisterDoorSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the register of each part that the driver reads, with its path in the YAML. Yield nothing
    for an invalid map."""
    if any(PROFILE.problems(settings.profile, settings.map)):
        return
    for part, text in door_map(settings).places().items():
        if part != "command" and misplaced(text, TABLES) is None:
            found = _part_in(settings, part)
            point = at(settings.unit, text, settings.base_address)
            yield str(point), (*found, "at") if found else ("unit",)


def describe(settings: RegisterDoorSettings, bus: object) -> Iterator[tuple[str, str]]:
    """Yield rows for `check` with the Modbus point of each part of the map, and the meanings of the
    part's numbers."""
    found = door_map(settings)
    meanings = {
        "position": "0 closed to 100 open",
        "command": f"{found.command.hold} holds open, {found.command.release} releases",
    }
    if found.position and found.position.unknown is not None:
        meanings["position"] += f", {found.position.unknown} unknown"
    if found.obstruction:
        meanings["obstruction"] = f"bit {found.obstruction.bit}"
    for part, point in points(settings).items():
        yield part, f"{point}: {meanings.get(part, '')}".removesuffix(": ")
    yield CLOSING


def tables(settings: RegisterDoorSettings) -> Iterator[Table]:
    """Yield the meanings of the status numbers, and of the error bits."""
    found = door_map(settings)
    rows = [(meaning, str(number)) for number, meaning in _meanings(found.status)]
    rows.append(("not known, with a fault", "any other"))
    yield Table("status numbers", ("means", "number"), tuple(rows))
    if found.errors:
        bits = tuple((text, str(bit)) for bit, text in sorted(found.errors.bits.items()))
        yield Table(
            "error bits", ("means", "bit"), (*bits, ("an error, by its number", "any other"))
        )


def warnings(settings: RegisterDoorSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting to review before the door goes
    into service."""
    yield from PROFILE.warnings(settings.profile, "watch the door move")
    if not door_map(settings).command.read_back:
        written = _part_in(settings, "command")
        path = (*written, "read_back") if written else ("profile",)
        yield (
            path,
            "the command cannot be read back, so the driver cannot verify a release of the door",
        )


def _part_in(settings: RegisterDoorSettings, part: str) -> tuple[str, ...]:
    """Return the path of a part of the map in the YAML. Return () if the profile defines the part."""
    if settings.map:
        return "map", part
    return ("changes", part) if getattr(settings.changes, part, None) else ()


def create(name: str, settings: RegisterDoorSettings, bus: ModbusBus) -> "RegisterDoor":
    """Make the door's driver on its bus. The driver sends nothing before `open`."""
    found = points(settings)
    command, outputs = door_map(settings).command, {"command": found.pop("command")}
    safe = {"command": command.release}
    lines = ModbusLines(bus, found, outputs, safe, () if command.read_back else outputs)
    return RegisterDoor(door_map(settings), lines)


class RegisterDoor:
    """The driver of one door (`drivers.Driver`)."""

    def __init__(self, found: DoorMap, lines: ModbusLines) -> None:
        self._map = found
        self._lines = lines

    def open(self) -> None:
        """Check that the operator answers. At the first call, release the door too."""
        self._lines.claim()

    def read(self) -> DoorSample:
        """Read every register now."""
        return decode(self._map, self._lines.read())

    def write(self, outputs: DoorOutputs) -> None:
        """Hold the door, or release it."""
        command = self._map.command
        self._lines.bring({"command": command.value(outputs.hold_open)})

    def make_safe(self) -> None:
        """Release the door, and read the command back where possible."""
        self._lines.make_safe()

    def close(self) -> None:
        """Release the door if the driver ever held it. Does not raise."""
        self._lines.close()


def decode(found: DoorMap, words: Mapping[str, int]) -> DoorSample:
    """Decode the register values. `words` gives a value for each part of the map. Never raises."""
    lost = _lost(found, words)
    status = words["status"]
    return DoorSample(
        opened=not lost and status in found.status.open,
        closed=not lost and status in found.status.closed,
        obstruction=found.obstruction.is_on(words["obstruction"]) if found.obstruction else None,
        lost=lost,
        errors=_errors(found.errors, words),
    )


def _lost(found: DoorMap, words: Mapping[str, int]) -> str:
    """Return the reason why the position is unknown. Return "" if the position is known."""
    value, status = words["status"], found.status
    if value in status.faults:
        return f"status {value}: {status.faults[value]}"
    if value not in (*status.open, *status.closed, *status.moving):
        return f"status {value} is not in the map"
    position = found.position
    if position is None or words["position"] == position.unknown:
        return ""
    if words["position"] > 100:
        return "the position is not between 0 and 100"
    if value in status.open and words["position"] < position.open_from:
        return "the status says open, but the position says not open"
    if value in status.closed and words["position"] > position.closed_to:
        return "the status says closed, but the position says not closed"
    return ""


def _errors(errors: OperatorFaults | None, words: Mapping[str, int]) -> tuple[str, ...]:
    if errors is None:
        return ()
    return tuple(errors.bits.get(bit, f"error bit {bit}") for bit in bits_on(words["errors"]))


def _address(text: str) -> int:
    try:
        return place(text)[1]
    except ValueError:
        return 0  # the map's own check reports the invalid place


def _meanings(status: Status) -> list[tuple[int, str]]:
    """Return (number, meaning) pairs, sorted by number."""
    words = [(v, word) for word in ("closed", "moving", "open") for v in getattr(status, word)]
    faults = [(v, f"not known, with the fault: {text}") for v, text in status.faults.items()]
    return sorted([*words, *faults])


DRIVER = DriverType(
    settings=RegisterDoorSettings,
    buses=("modbus",),
    create=create,
    describe=describe,
    tables=tables,
    claims=claims,
    reads=reads,
    warnings=warnings,
    fake="hal_fakes.modbus.register_door",
)
