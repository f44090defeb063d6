"""What one broken wire makes of a code on several lines: for checks, and for the tables of `check`."""

from collections.abc import Iterator, Mapping, Sequence

from drivers.hal.points import Wire

Lines = Mapping[str, bool]
"""Signal -> asserted, for each line of a code."""


def lines_on(shown: Lines) -> str:
    """The signals that are asserted: `floor_bit0, floor_bit2`."""
    return ", ".join(signal for signal, on in shown.items() if on) or "none"


def breaks(shown: Lines, wires: Mapping[str, Wire]) -> Iterator[tuple[str, str, dict[str, bool]]]:
    """Each line broken so that it reads wrong: (signal, `cut` or `shorted`, what is shown then).

    A cut line reads as its wiring makes it read (`Wire.broken_reads`); a shorted line, or one with a
    stuck contact, reads the opposite. A line that floats (`pull: none`) may read either way when cut.
    """
    for signal, on in shown.items():
        how = "shorted" if wires[signal].broken_reads() is on else "cut"
        yield signal, how, {**shown, signal: not on}


def one_cut(shown: Lines, wires: Mapping[str, Wire]) -> Iterator[tuple[str, dict[str, bool]]]:
    """Each signal whose cut wire changes what is shown, and what is shown then."""
    return ((signal, then) for signal, how, then in breaks(shown, wires) if how == "cut")


def told_of_cuts(readings: Sequence[tuple[str, str]]) -> str:
    """(signal, what a cut of it reads as) as one text: `L1: floor_bit1; a fault: floor_bit0`."""
    by_reading: dict[str, list[str]] = {}
    for signal, reading in readings:
        by_reading.setdefault(reading, []).append(signal)
    texts = (f"{reading}: {', '.join(signals)}" for reading, signals in by_reading.items())
    return "; ".join(texts) or "nothing changes"
