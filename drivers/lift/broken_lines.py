"""Finds misreadings of a lift's codes. A code is a number that several lines show together. If one of
the lines is cut or shorted, the daemon reads another number.

A misreading of a service or motion code is unsafe if the state that the daemon reads is safer than the
lift's real state. A misreading of a floor code causes a warning if the daemon reads another floor.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

from drivers.hal.points import Wire
from drivers.lift import codes
from drivers.lift.wiring import FloorCode, LiftWiring, MotionCode, ServiceCode
from drivers.tables import Lines, breaks
from drivers.unsafe import Unsafe

SERVES = {"agv_mode": 0, "normal": 1, "overload": 1}
"""A rank for each state in which robots may use the lift. A higher rank restricts robots more. In every
state that is not listed, robots may not use the lift."""
TAKEN_AWAY = 2


class Misread(NamedTuple):
    """One misreading. `line` is the broken line, and `how` is "cut" or "shorted". The lift shows the
    state `shown`, but the daemon reads the state `reads`."""

    line: str
    how: str
    shown: str
    reads: str


def misread(
    shown: Mapping[str, Sequence[Lines]],
    read: Callable[[Lines], str | None],
    table: Mapping[str, Wire],
) -> Iterator[Misread]:
    """Yield each misreading that one broken line causes. `shown` gives the codes of each meaning, as
    lines. `read` returns the meaning of a code."""
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
    """Describe the floors that read as another floor when one line is broken. Return "" if there are no
    such floors."""
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
    """Return a rank for a state. A higher rank restricts robots more. A state in which the car moves
    has the highest rank."""
    return 0 if state == "stopped" else SERVES.get(state, TAKEN_AWAY)


def _shown(name: str, code: ServiceCode | MotionCode) -> dict[str, list[Lines]]:
    """Return the codes of each state, as lines. Leave out the codes that mean a fault, because a
    working controller never shows them."""
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
