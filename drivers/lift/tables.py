"""Tabulates a lift's codes and outputs. A row of a code shows a number and the lines that are on. The
row also shows how the code reads when one wire is cut."""

from collections.abc import Iterator, Mapping, Sequence

from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.lift.signals import Side
from bridges.kinds.shared.table import Table
from drivers.hal.points import Wire
from drivers.lift import codes
from drivers.lift.table import wires
from drivers.lift.wiring import FloorCode, LiftWiring
from drivers.tables import lines_on, one_cut, told_of_cuts

CUT = "reads with one wire cut"
FAULT = "a fault"
BETWEEN = "between floors"


def tables(wiring: LiftWiring) -> Iterator[Table]:
    """Yield a table of the floors (lowest first), and a table for each other code. Yield a table that
    shows how long each output is on."""
    table = {wire.signal: wire for wire in wires(wiring)}
    yield floors(wiring)
    yield _floor_code(wiring, table)
    for name, section in (("service", wiring.inputs.service), ("motion", wiring.inputs.motion)):
        if section is not None:
            yield _code(name, len(section.bits), section.codes, table)
    yield _outputs(wiring)


def floors(wiring: LiftSettings) -> Table:
    """Tabulate RMF's floors with the lowest first. So a reader notices if the YAML lists the floors in
    a wrong order."""
    stops = list(wiring.stops().items())
    rows = [
        (_place(i, len(stops)), name, stop.level, "rear door" if stop.side is Side.REAR else "door")
        for i, (name, stop) in enumerate(stops)
    ]
    return Table("floors", ("from below", "floor on RMF's map", "landing", "opens"), tuple(rows))


def _place(i: int, many: int) -> str:
    if i == 0:
        return "lowest"
    return "highest" if i == many - 1 else str(i + 1)


def _floor_code(wiring: LiftWiring, table: Mapping[str, Wire]) -> Table:
    code, levels = wiring.floor_code, wiring.levels()
    rows = []
    for number, level, shown in sorted(code.shows(), key=lambda at: _height(at[1], levels)):
        cuts = [(signal, _landing(code, cut)) for signal, cut in one_cut(shown, table)]
        told = told_of_cuts([(s, r) for s, r in cuts if r != (level or BETWEEN)])
        numbered = "-" if number is None else str(number)
        rows.append((level or BETWEEN, numbered, lines_on(shown), told))
    return Table(f"floor code ({code.encoding})", ("car at", "code", "lines on", CUT), tuple(rows))


def _height(level: str | None, levels: Sequence[str]) -> int:
    """Return a sort key. The key puts "between floors" first, then the landings from the lowest to the
    highest."""
    return -1 if level is None else levels.index(level)


def _landing(code: FloorCode, shown: Mapping[str, bool]) -> str:
    level, why = code.read(shown)
    return FAULT if why else level or BETWEEN


def _code(name: str, width: int, meanings: Mapping[int, str], table: Mapping[str, Wire]) -> Table:
    """Tabulate every number that the code's binary lines can show."""

    def read(shown: Mapping[str, bool]) -> str:
        return meanings.get(codes.shown_number(name, shown, width), FAULT)

    rows = []
    for number in range(2**width):
        shown = codes.lines(name, number, width)
        means = meanings.get(number, FAULT)
        cuts = [(s, read(cut)) for s, cut in one_cut(shown, table)]
        told = told_of_cuts([(s, r) for s, r in cuts if r != means])
        rows.append((means, str(number), lines_on(shown), told))
    return Table(f"{name} code", ("means", "code", "lines on", CUT), tuple(rows))


def _outputs(wiring: LiftWiring) -> Table:
    have = [name for name in _DRIVEN if getattr(wiring.outputs, name) is not None]
    rows = [(name, name) for name in have]
    rows += [(f"call {level}", _call(wiring, level)) for level in wiring.levels()]
    told = tuple((output, lines, how_long(wiring, output)) for output, lines in rows)
    return Table("outputs", ("output", "lines on", "how long"), told)


_DRIVEN = {
    "agv_mode_request": "on while a robot holds the lift, and {grace_s:g} s longer",
    "door_open": "on while the car waits for a robot",
    "rear_door_open": "on while the car waits for a robot, at a floor with side: rear",
}


def how_long(settings: LiftSettings, output: str) -> str:
    """Describe how long an output is on. An output that `_DRIVEN` does not list is a call."""
    limits = settings.limits
    if output in _DRIVEN:
        return _DRIVEN[output].format(grace_s=limits.release_grace_s)
    pulse_s = limits.call_pulse_s
    return "on until the car is there" if pulse_s is None else f"one pulse of {pulse_s:g} s"


def _call(wiring: LiftWiring, level: str) -> str:
    return lines_on(wiring.call_code.lines(level)) if wiring.call_code else f"call_{level}"
