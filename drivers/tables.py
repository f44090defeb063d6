"""What a cut wire makes of a code on several lines, for the tables that `check` prints."""

from collections.abc import Iterator, Mapping, Sequence

from drivers.hal.points import Wire


def lines_on(shown: Mapping[str, bool]) -> str:
    """The signals that are asserted: `floor_bit0, floor_bit2`."""
    return ", ".join(signal for signal, on in shown.items() if on) or "none"


def one_cut(
    shown: Mapping[str, bool], wires: Mapping[str, Wire]
) -> Iterator[tuple[str, dict[str, bool]]]:
    """Each signal whose cut wire changes what is shown, and what is shown then.

    A wire that floats (`pull: none`) may read either way.
    """
    for signal, on in shown.items():
        reads = wires[signal].broken_reads()
        if reads is None or reads != on:
            yield signal, {**shown, signal: not on}


def told_of_cuts(readings: Sequence[tuple[str, str]]) -> str:
    """(signal, what a cut of it reads as) as one text: `L1: floor_bit1; a fault: floor_bit0`."""
    by_reading: dict[str, list[str]] = {}
    for signal, reading in readings:
        by_reading.setdefault(reading, []).append(signal)
    texts = (f"{reading}: {', '.join(signals)}" for reading, signals in by_reading.items())
    return "; ".join(texts) or "nothing changes"
