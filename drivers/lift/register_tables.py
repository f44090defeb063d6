"""A gateway's numbers and commands as tables: what each register value means, and what is written."""

from collections.abc import Iterator

from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.shared.table import Table
from drivers.lift.register_map import DoorField, FloorField, LiftMap, MotionField, Number
from drivers.lift.tables import BETWEEN, FAULT, floors, how_long

NUMBERS = ("means", "number", "register reads")


def tables(settings: LiftSettings, found: LiftMap) -> Iterator[Table]:
    """The floors from the lowest up, each part's numbers, and what is written for each command."""
    yield floors(settings)
    for name, part in found.parts().items():
        if isinstance(part, Number):
            yield Table(f"{name} numbers", NUMBERS, tuple(_numbers(part)))
    yield _outputs(settings, found)


def _numbers(part: Number) -> Iterator[tuple[str, str, str]]:
    meanings = [(number, str(meaning)) for number, meaning in part.codes.items()]
    if isinstance(part, FloorField):
        meanings += [(number, BETWEEN) for number in part.between_floors]
    others = ", other bits 0" if part.bits else ""
    for number, meaning in sorted(meanings):
        yield meaning, str(number), f"0x{part.word(number):04X}{others}"
    yield _unlisted(part), "any other", "-"


def _unlisted(part: Number) -> str:
    if isinstance(part, FloorField):
        return FAULT
    if isinstance(part, DoorField):
        return "neither open nor closed"
    return "a car that moves" if isinstance(part, MotionField) else "out_of_service"


def _outputs(settings: LiftSettings, found: LiftMap) -> Table:
    """Commands that share a register are written as one value; here each is alone."""
    commands, off = found.commands, found.commands.words((), None)
    levels = settings.levels()
    rows = []
    for signal, _, command in commands.singles():
        if not signal.startswith("call_"):
            rows.append((signal, command.at, commands.words([signal], None)[command.at]))
    for level in levels:
        at = commands.call.at if commands.call else commands.calls[level].at
        rows.append((f"call {level}", at, commands.words([f"call_{level}"], level)[at]))
    told = tuple(
        (output, f"{at}: {value}", str(off[at]), how_long(settings, output))
        for output, at, value in rows
    )
    return Table("outputs", ("output", "writes", "off", "how long"), told)
