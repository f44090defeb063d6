"""Finds misreadings of a lift's codes when one of the code's lines is cut or shorted.

A misread service or motion code is unsafe if it shows a safer state than the lift's real state. A
misread floor code gives a warning if it shows another floor.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

from drivers.hal.points import Wire
from drivers.lift import codes
from drivers.lift.wiring import FloorCode, LiftWiring, MotionCode, ServiceCode
from drivers.tables import Lines, breaks
from drivers.unsafe import Unsafe

SERVES = {"agv_mode": 0, "normal": 1, "overload": 1}
"""State -> how far the state restricts robots. Every unlisted state takes the lift away from RMF."""
TAKEN_AWAY = 2


class Misread(NamedTuple):
    """One misreading. With `line` broken (`how` is cut or shorted), the code for `shown` reads as
    `reads`."""

    line: str
    how: str
    shown: str
    reads: str


def misread(
    shown: Mapping[str, Sequence[Lines]],
    read: Callable[[Lines], str | None],
    table: Mapping[str, Wire],
) -> Iterator[Misread]:
    """Yield each misreading that one broken line causes. `shown` is meaning -> its codes; `read`
    decodes lines."""
    for meaning, numbers in shown.items():
        for lines in numbers:
            for line, how, then in breaks(lines, table):
                reads = read(then)
                if reads not in (None, meaning):
                    yield Misread(line, how, meaning, str(reads))


def unsafe_codes(wiring: LiftWiring, table: Mapping[str, Wire]) -> Iterator[Unsafe]:
    """Yield each line of the service and motion codes whose break is unsafe. `accept_unsafe` must name
    these lines."""
    for name, code in (("service", wiring.inputs.service), ("motion", wiring.inputs.motion)):
        if code is None or any(number >> len(code.bits) for number in code.codes):
            continue
        found = misread(_shown(name, code), _reader(name, code), table)
        worse = [m for m in found if _danger(m.reads) < _danger(m.shown)]
        for line in sorted({m.line for m in worse}):
            number = line.removeprefix(f"{name}_bit")
            text = sentence(m for m in worse if m.line == line)
            yield line, ("inputs", name, "bits", number), text


def floor_warnings(code: FloorCode, table: Mapping[str, Wire]) -> str:
    """Describe the floors that read as another floor when one line is broken. Return "" if there are
    none."""
    shown: dict[str, list[Lines]] = {}
    for _, level, lines in code.shows():
        if level is not None:
            shown.setdefault(level, []).append(lines)
    return sentence(misread(shown, lambda lines: code.read(lines)[0], table))


def sentence(found: Iterator[Misread]) -> str:
    """Return the misreadings as one sentence, grouped by broken line."""
    broken: dict[str, list[str]] = {}
    for line, how, shown, reads in sorted(found):
        broken.setdefault(f"with {line} {how}", []).append(f"{shown} reads as {reads}")
    return "; ".join(f"{how}, {' and '.join(what)}" for how, what in broken.items())


def _danger(state: str) -> int:
    """Rank a state by how far it restricts robots. A greater rank is stricter, and a moving car is
    strictest."""
    return 0 if state == "stopped" else SERVES.get(state, TAKEN_AWAY)


def _shown(name: str, code: ServiceCode | MotionCode) -> dict[str, list[Lines]]:
    """Return state -> its codes as lines. Codes of a fault are missing, because the controller never
    shows them."""
    shown: dict[str, list[Lines]] = {}
    for number, state in code.codes.items():
        if state != "fault":
            shown.setdefault(state, []).append(codes.lines(name, number, len(code.bits)))
    return shown


def _reader(name: str, code: ServiceCode | MotionCode) -> Callable[[Lines], str | None]:
    def read(lines: Lines) -> str | None:
        state = code.codes.get(codes.shown_number(name, lines, len(code.bits)))
        return None if state == "fault" else state

    return read
