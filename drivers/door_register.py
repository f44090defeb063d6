"""A door operator that is read and commanded through Modbus registers.

Its status is one number; the map says which numbers are open, closed, moving or a fault, and one that
is not listed is a fault too: then nobody knows where the door is. A position, where there is one, must
agree with the status. The command holds the door open or releases it: nothing drives it shut.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated, Final

import msgspec

from bridges.door.settings import DoorSettings
from bridges.door.signals import DoorOutputs, DoorSample
from bridges.fields import Name
from drivers.hal.modbus import ModbusBus
from drivers.hal.modbus_points import Point
from drivers.hal.modbus_registers import (
    REGISTERS,
    WRITABLE,
    Place,
    RegisterLines,
    Unit,
    Word,
    at,
    misplaced,
    place,
)
from drivers.profile import Profile, profile_problems

BUSES: Final = ("modbus",)

BITS: Final = 16
Bit = Annotated[int, msgspec.Meta(ge=0, le=15)]
Percent = Annotated[int, msgspec.Meta(ge=0, le=100)]
Problems = Iterator[tuple[tuple[str, ...], str]]


class Status(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where the door is, as one number; a number that is not listed is a fault.

    `at`: `input register N` or `holding register N`.
    `open`: the numbers of a fully open door.
    `closed`: the numbers of a closed door.
    `moving`: the numbers of a door between its limits, and well.
    `faults`: number -> what is wrong.
    """

    at: Place
    open: Annotated[list[Word], msgspec.Meta(min_length=1)]
    closed: Annotated[list[Word], msgspec.Meta(min_length=1)]
    moving: Annotated[list[Word], msgspec.Meta(min_length=1)]
    faults: dict[Word, Name] = msgspec.field(default_factory=dict)

    def problems(self) -> Problems:
        """A place that is no register; a number that means two things."""
        yield from _place_problems(self.at, REGISTERS)
        first: dict[int, str] = {}
        for key in ("open", "closed", "moving", "faults"):
            for i, value in enumerate(getattr(self, key)):
                if value in first:
                    path = (key, str(value if key == "faults" else i))
                    yield path, f"{value} is listed under {first[value]} already"
                first.setdefault(value, key)


class Position(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How far the door is open, from 0 (closed) to 100 (open); any other number is a fault.

    `at`: `input register N` or `holding register N`.
    `unknown`: the number by which the operator says that it does not know; then only the status counts.
    `open_from`: at less than this the door is not open, whatever the status.
    `closed_to`: at more than this the door is not closed, whatever the status.
    """

    at: Place
    unknown: Word | None = None
    open_from: Percent = 95
    closed_to: Percent = 5

    def problems(self) -> Problems:
        """A place that is no register; limits the wrong way round."""
        yield from _place_problems(self.at, REGISTERS)
        if self.unknown is not None and self.unknown <= 100:
            yield ("unknown",), "0 to 100 are positions"
        if self.open_from <= self.closed_to:
            yield ("open_from",), "must be greater than closed_to"


class Errors(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the operator says is wrong with it: shown, and nothing is driven by it.

    `at`: `input register N` or `holding register N`.
    `bits`: bit (0 is the least) -> what is wrong; a bit that is not listed is shown by its number.
    """

    at: Place
    bits: dict[Bit, Name] = msgspec.field(default_factory=dict)

    def problems(self) -> Problems:
        """A place that is no register."""
        yield from _place_problems(self.at, REGISTERS)


class Flag(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One bit of a register.

    `at`: `input register N` or `holding register N`.
    `bit`: which; 0 is the least.
    """

    at: Place
    bit: Bit

    def problems(self) -> Problems:
        """A place that is no register."""
        yield from _place_problems(self.at, REGISTERS)


class Command(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the door is held open. There is no value that drives it shut.

    `at`: `coil N` or `holding register N`.
    `hold`: the value that holds it open.
    `release`: the value that lets it go, so that it closes by its own rules.
    `read_back`: false where it can only be written; then it is written in every scan, and nothing
    proves that it was taken.
    """

    at: Place
    hold: Word
    release: Word
    read_back: bool = True

    def problems(self) -> Problems:
        """A place that cannot be written; values that it cannot take."""
        yield from _place_problems(self.at, WRITABLE)
        if self.hold == self.release:
            yield ("release",), "is the value of hold"
        if misplaced(self.at, ("coil",)) is None:
            for key in ("hold", "release"):
                if getattr(self, key) > 1:
                    yield (key,), "a coil is 0 or 1"


class DoorMap(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where an operator has what. Addresses begin at 0.

    `status`: where the door is, as one number.
    `position`: how far it is open.
    `errors`: what the operator says is wrong with it.
    `obstruction`: somebody is in the doorway: after CLOSE, the hold is kept until they are not.
    `command`: how the door is held open.
    """

    status: Status
    position: Position | None = None
    errors: Errors | None = None
    obstruction: Flag | None = None
    command: Command


class Settings(DoorSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A door and where its operator is.

    `unit`: the operator's Modbus unit.
    `profile`: a file of drivers/profiles/ that has the map.
    `map`: the map, written here.
    `base_address`: added to every address of the map, for a gateway that has several operators in one
    unit.
    """

    unit: Unit
    profile: Name | None = None
    map: DoorMap | None = None
    base_address: Word = 0

    def problems(self) -> Problems:
        """What the fields cannot say one by one."""
        yield from super().problems()
        before = list(profile_problems(PROFILE, self.profile, self.map))
        yield from before
        if not before and max(map(_address, _places(door_map(self)).values())) > (
            65535 - self.base_address
        ):
            yield ("base_address",), "with it an address is beyond 65535, the last"
        if self.feedback == "estimated":
            yield ("feedback",), "the status says where the door is: leave feedback out"
        if self.on_fire:
            yield ("on_fire",), "an operator on registers has no fire input: leave this out"


PROFILE: Final = Profile("door_register", "map", DoorMap)


def door_map(settings: Settings) -> DoorMap:
    """The map, from wherever it is."""
    found: DoorMap = settings.map or PROFILE.load(settings.profile or "")
    return found


def points(settings: Settings) -> dict[str, Point]:
    """Where each part of the map is at this operator; `command` among them."""
    return {
        part: at(settings.unit, text, settings.base_address)
        for part, text in _places(door_map(settings)).items()
    }


def claims(settings: Settings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """What no other device may use, and where the YAML says so; nothing while that is not right."""
    if any(profile_problems(PROFILE, settings.profile, settings.map)):
        return
    place_of_command = door_map(settings).command.at
    if misplaced(place_of_command, WRITABLE) is None:
        point = at(settings.unit, place_of_command, settings.base_address)
        yield str(point), ("map", "command", "at") if settings.map else ("unit",)


def describe(settings: Settings, bus: object) -> Iterator[tuple[str, str]]:
    """For `check`: each part of the map, where it is, and what its numbers mean."""
    found = door_map(settings)
    meanings = {
        "status": _status_text(found.status),
        "position": "0 closed to 100 open",
        "command": f"{found.command.hold} holds open, {found.command.release} releases",
    }
    if found.position and found.position.unknown is not None:
        meanings["position"] += f", {found.position.unknown} unknown"
    if found.obstruction:
        meanings["obstruction"] = f"bit {found.obstruction.bit}"
    if found.errors:
        meanings["errors"] = ", ".join(f"bit {b} {t}" for b, t in found.errors.bits.items())
    for part, point in points(settings).items():
        yield part, f"{point}: {meanings[part]}".removesuffix(": ")


def warnings(settings: Settings) -> Problems:
    """What is legal, but should be read before the door is put into service: (path, text)."""
    if settings.profile and PROFILE.untried(settings.profile):
        text = f"nobody has tried the profile {settings.profile} on hardware: watch the door move"
        yield ("profile",), text
    if not door_map(settings).command.read_back:
        path = ("map", "command", "read_back") if settings.map else ("profile",)
        yield path, "the command cannot be read back: that the door was released is not verified"


def create(name: str, settings: Settings, bus: ModbusBus) -> "RegisterDoor":
    """The door on its bus; nothing is sent before `open`."""
    found = points(settings)
    command = door_map(settings).command
    reads = {part: point for part, point in found.items() if part != "command"}
    lines = RegisterLines(bus, reads, found["command"], command.release, command.read_back)
    return RegisterDoor(door_map(settings), lines)


class RegisterDoor:
    """`drivers.Driver` of one door."""

    def __init__(self, found: DoorMap, lines: RegisterLines) -> None:
        self._map = found
        self._lines = lines

    def open(self) -> None:
        """See that the operator answers, and let go of the door."""
        self._lines.claim()

    def read(self) -> DoorSample:
        """Every register, read now."""
        return decode(self._map, self._lines.read())

    def write(self, outputs: DoorOutputs) -> None:
        """Hold the door, or release it."""
        command = self._map.command
        self._lines.write(command.hold if outputs.hold_open else command.release)

    def make_safe(self) -> None:
        """Released, and read back where it can be."""
        self._lines.make_safe()

    def close(self) -> None:
        """Released, and let go."""
        self._lines.close()


def decode(found: DoorMap, words: Mapping[str, int]) -> DoorSample:
    """What these numbers, by part of the map, say of the door. Never raises."""
    lost = _lost(found, words)
    status = words["status"]
    return DoorSample(
        opened=not lost and status in found.status.open,
        closed=not lost and status in found.status.closed,
        obstruction=_flag(found.obstruction, words),
        lost=lost,
        errors=_errors(found.errors, words),
    )


def _lost(found: DoorMap, words: Mapping[str, int]) -> str:
    """Why these numbers do not say where the door is; "" when they do."""
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
        return "the status is open and the position is not"
    if value in status.closed and words["position"] > position.closed_to:
        return "the status is closed and the position is not"
    return ""


def _flag(flag: Flag | None, words: Mapping[str, int]) -> bool | None:
    return None if flag is None else bool(words["obstruction"] >> flag.bit & 1)


def _errors(errors: Errors | None, words: Mapping[str, int]) -> tuple[str, ...]:
    if errors is None:
        return ()
    on = (bit for bit in range(BITS) if words["errors"] >> bit & 1)
    return tuple(errors.bits.get(bit, f"error bit {bit}") for bit in on)


def _places(found: DoorMap) -> dict[str, str]:
    parts = ("status", "position", "errors", "obstruction", "command")
    return {part: getattr(found, part).at for part in parts if getattr(found, part) is not None}


def _address(text: str) -> int:
    try:
        return place(text)[1]
    except ValueError:
        return 0  # reported where the place is spelled


def _place_problems(text: str, tables: tuple[str, ...]) -> Problems:
    if reason := misplaced(text, tables):
        yield ("at",), reason


def _status_text(status: Status) -> str:
    words = [(v, word) for word in ("closed", "moving", "open") for v in getattr(status, word)]
    return ", ".join(f"{v} {word}" for v, word in sorted([*words, *status.faults.items()]))
