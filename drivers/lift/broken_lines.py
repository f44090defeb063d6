"""What a lift's codes read as when one of their lines is cut or shorted.

A cut line reads as its wire does when it breaks; a shorted one, or one whose contact is stuck, as the
opposite. A service or motion code that then reads less safe than the truth is unsafe; of a floor code
that reads as another floor it is warned.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

from drivers.hal.points import Wire
from drivers.lift.wiring import FloorCode, LiftWiring, MotionCode, ServiceCode
from drivers.unsafe import Unsafe

SERVES = {"agv_mode": 0, "normal": 1, "overload": 1}
"""How far a state is from having the lift taken away from RMF; every other state takes it away."""
TAKEN_AWAY = 2

Lines = Mapping[str, bool]
"""Signal -> asserted, for each line of a code."""


class Misread(NamedTuple):
    """With `how` this line is broken, what is in truth `shown` reads as `reads`."""

    line: str
    how: str
    shown: str
    reads: str


def misread(
    shown: Mapping[str, Sequence[Lines]],
    read: Callable[[Lines], str | None],
    table: Mapping[str, Wire],
) -> Iterator[Misread]:
    """What one broken line makes of a code. `shown`: the lines of each meaning; `read`: its reader."""
    for meaning, codes in shown.items():
        for lines in codes:
            for line, asserted in lines.items():
                reads = read({**lines, line: not asserted})
                cut = table[line].broken_reads()
                how = "shorted" if cut is asserted else "cut"
                if reads not in (None, meaning):
                    yield Misread(line, how, meaning, str(reads))


def unsafe_codes(wiring: LiftWiring, table: Mapping[str, Wire]) -> Iterator[Unsafe]:
    """The lines of the service and motion codes that must be accepted by name."""
    for name, code in (("service", wiring.inputs.service), ("motion", wiring.inputs.motion)):
        if code is None or any(number >> len(code.bits) for number in code.codes):
            continue
        found = misread(_shown(name, code), _reader(name, code), table)
        worse = [m for m in found if _danger(m.reads) < _danger(m.shown)]
        for line in sorted({m.line for m in worse}):
            number = line.removeprefix(f"{name}_bit")
            text = told(m for m in worse if m.line == line)
            yield line, ("inputs", name, "bits", number), text


def floor_warnings(code: FloorCode, table: Mapping[str, Wire]) -> str:
    """Which floors one broken line makes another floor of; "" for none."""
    levels = dict.fromkeys((*code.codes.values(), *code.lines))
    shown = {level: [code.show(level)] for level in levels}
    return told(misread(shown, lambda lines: code.read(lines)[0], table))


def told(found: Iterator[Misread]) -> str:
    """As one sentence, each line's break once."""
    broken: dict[str, list[str]] = {}
    for line, how, shown, reads in sorted(found):
        broken.setdefault(f"with {line} {how}", []).append(f"{shown} reads as {reads}")
    return "; ".join(f"{how}, {' and '.join(what)}" for how, what in broken.items())


def _danger(state: str) -> int:
    """The greater, the more it keeps us from driving; a moving car counts as taken away."""
    return 0 if state == "stopped" else SERVES.get(state, TAKEN_AWAY)


def _shown(name: str, code: ServiceCode | MotionCode) -> dict[str, list[Lines]]:
    """Each state's codes as lines; what the controller never shows has none."""
    shown: dict[str, list[Lines]] = {}
    for number, state in code.codes.items():
        if state != "fault":
            lines = {f"{name}_bit{i}": bool(number >> i & 1) for i in range(len(code.bits))}
            shown.setdefault(state, []).append(lines)
    return shown


def _reader(name: str, code: ServiceCode | MotionCode) -> Callable[[Lines], str | None]:
    def read(lines: Lines) -> str | None:
        number = sum(lines[f"{name}_bit{i}"] << i for i in range(len(code.bits)))
        state = code.codes.get(number)
        return None if state == "fault" else state

    return read
