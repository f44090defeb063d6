"""What a lift's codes read as when one of their lines is cut or shorted.

A cut line reads as its wiring makes it read (`Wire.broken_reads`); a shorted line, or one with a stuck
contact, reads the opposite. A service or motion code that then reads safer than the lift really is, is
unsafe. A floor code that then reads as another floor gives a warning.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

from drivers.hal.points import Wire
from drivers.lift.wiring import FloorCode, LiftWiring, MotionCode, ServiceCode
from drivers.unsafe import Unsafe

SERVES = {"agv_mode": 0, "normal": 1, "overload": 1}
"""How much a state restricts RMF; every state that is not listed takes the lift away from RMF."""
TAKEN_AWAY = 2

Lines = Mapping[str, bool]
"""Signal -> asserted, for each line of a code."""


class Misread(NamedTuple):
    """With `line` broken (`how`: cut or shorted), the code for `shown` reads as `reads`."""

    line: str
    how: str
    shown: str
    reads: str


def misread(
    shown: Mapping[str, Sequence[Lines]],
    read: Callable[[Lines], str | None],
    table: Mapping[str, Wire],
) -> Iterator[Misread]:
    """Each misreading by one broken line. `shown`: meaning -> its codes; `read` decodes a code."""
    for meaning, codes in shown.items():
        for lines in codes:
            for line, asserted in lines.items():
                reads = read({**lines, line: not asserted})
                cut = table[line].broken_reads()
                how = "shorted" if cut is asserted else "cut"
                if reads not in (None, meaning):
                    yield Misread(line, how, meaning, str(reads))


def unsafe_codes(wiring: LiftWiring, table: Mapping[str, Wire]) -> Iterator[Unsafe]:
    """The lines of the service and motion codes that `accept_unsafe` must name."""
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
    """The floors that read as another floor when one line is broken, as a text; "" for none."""
    levels = dict.fromkeys((*code.codes.values(), *code.lines))
    shown = {level: [code.show(level)] for level in levels}
    return told(misread(shown, lambda lines: code.read(lines)[0], table))


def told(found: Iterator[Misread]) -> str:
    """The misreadings as one sentence, grouped by broken line."""
    broken: dict[str, list[str]] = {}
    for line, how, shown, reads in sorted(found):
        broken.setdefault(f"with {line} {how}", []).append(f"{shown} reads as {reads}")
    return "; ".join(f"{how}, {' and '.join(what)}" for how, what in broken.items())


def _danger(state: str) -> int:
    """How strictly a state keeps robots away (greater is stricter); a moving car is the strictest."""
    return 0 if state == "stopped" else SERVES.get(state, TAKEN_AWAY)


def _shown(name: str, code: ServiceCode | MotionCode) -> dict[str, list[Lines]]:
    """Each state's codes as lines, without the codes that the controller never shows."""
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
