"""Finds how a code on several lines reads when one of its wires is broken. The checks and their tables
use these readings."""

from collections.abc import Iterator, Mapping, Sequence

from drivers.hal.points import Wire

Lines = Mapping[str, bool]
"""For each line of a code, whether its signal is asserted."""


def lines_on(shown: Lines) -> str:
    """Return the names of the asserted signals: `floor_bit0, floor_bit2`."""
    return ", ".join(signal for signal, on in shown.items() if on) or "none"


def breaks(shown: Lines, wires: Mapping[str, Wire]) -> Iterator[tuple[str, str, dict[str, bool]]]:
    """Yield (signal, `cut` or `shorted`, lines) for each line of the code, as if only this line were
    broken. `lines` is the wrong reading of the whole code.

    The reading of a cut line depends on its wiring (`Wire.broken_reads`). A shorted line, or a line
    with a stuck contact, reads the opposite. A cut line that floats (`pull: none`) may read on or off.
    """
    for signal, on in shown.items():
        how = "shorted" if wires[signal].broken_reads() is on else "cut"
        yield signal, how, {**shown, signal: not on}


def one_cut(shown: Lines, wires: Mapping[str, Wire]) -> Iterator[tuple[str, dict[str, bool]]]:
    """Yield each wire whose cut changes the reading, with the changed reading."""
    return ((signal, then) for signal, how, then in breaks(shown, wires) if how == "cut")


def told_of_cuts(readings: Sequence[tuple[str, str]]) -> str:
    """Join pairs (signal, reading when this signal's wire is cut) to one text. The text lists the
    signals of each reading: `L1: floor_bit1; a fault: floor_bit0`."""
    by_reading: dict[str, list[str]] = {}
    for signal, reading in readings:
        by_reading.setdefault(reading, []).append(signal)
    texts = (f"{reading}: {', '.join(signals)}" for reading, signals in by_reading.items())
    return "; ".join(texts) or "nothing changes"
