"""Finds the readings of a code on several lines with one broken wire, for checks and their tables."""

from collections.abc import Iterator, Mapping, Sequence

from drivers.hal.points import Wire

Lines = Mapping[str, bool]
"""Signal -> asserted, for each line of a code."""


def lines_on(shown: Lines) -> str:
    """Return the asserted signals: `floor_bit0, floor_bit2`."""
    return ", ".join(signal for signal, on in shown.items() if on) or "none"


def breaks(shown: Lines, wires: Mapping[str, Wire]) -> Iterator[tuple[str, str, dict[str, bool]]]:
    """Yield the reading of the code with each line broken: (signal, `cut` or `shorted`, the lines).

    A cut line's reading depends on its wiring (`Wire.broken_reads`); a shorted line, or a line with a
    stuck contact, reads the opposite. A cut line that floats (`pull: none`) may read either way.
    """
    for signal, on in shown.items():
        how = "shorted" if wires[signal].broken_reads() is on else "cut"
        yield signal, how, {**shown, signal: not on}


def one_cut(shown: Lines, wires: Mapping[str, Wire]) -> Iterator[tuple[str, dict[str, bool]]]:
    """Yield each signal whose wire, if cut, changes the reading, with the changed reading."""
    return ((signal, then) for signal, how, then in breaks(shown, wires) if how == "cut")


def told_of_cuts(readings: Sequence[tuple[str, str]]) -> str:
    """Join (signal, reading with it cut) to one text: `L1: floor_bit1; a fault: floor_bit0`."""
    by_reading: dict[str, list[str]] = {}
    for signal, reading in readings:
        by_reading.setdefault(reading, []).append(signal)
    texts = (f"{reading}: {', '.join(signals)}" for reading, signals in by_reading.items())
    return "; ".join(texts) or "nothing changes"
