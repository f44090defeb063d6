"""Converts between a number and the lines that show the number together. The encoding is binary, Gray
or BCD. The least significant line always comes first. Also checks the numbers of calls."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Literal

Encoding = Literal["binary", "gray", "bcd"]


def decode(encoding: Encoding, lines: Sequence[bool]) -> int | None:
    """Return the number on these lines. Return None for a BCD digit above 9."""
    number = sum(on << place for place, on in enumerate(lines))
    if encoding == "gray":
        return _from_gray(number)
    return _from_bcd(number) if encoding == "bcd" else number


def encode(encoding: Encoding, number: int, width: int) -> tuple[bool, ...]:
    """Return the lines for a number. Raises ValueError if `width` lines are too few for the number."""
    pattern = number
    if encoding == "gray":
        pattern = number ^ (number >> 1)
    if encoding == "bcd":
        pattern = int(str(number), 16)
    if number < 0 or pattern >> width:
        raise ValueError(f"{number} does not fit on {width} lines in {encoding}")
    return tuple(bool(pattern >> place & 1) for place in range(width))


def shown_number(prefix: str, shown: Mapping[str, bool], width: int) -> int:
    """Return the number on the binary lines `<prefix>_bit0`, `<prefix>_bit1`…"""
    return sum(shown[f"{prefix}_bit{i}"] << i for i in range(width))


def lines(prefix: str, number: int, width: int) -> dict[str, bool]:
    """Return the levels of the binary lines `<prefix>_bit0`, `<prefix>_bit1`… for this number. True
    means that the line is asserted."""
    return {f"{prefix}_bit{i}": bool(number >> i & 1) for i in range(width)}


def called_twice(calls: Mapping[int, str]) -> Iterator[tuple[int, str]]:
    """Yield (number, problem) for each number that calls a landing which an earlier number calls
    already. `calls` gives the landing for each number."""
    first: dict[str, int] = {}
    for number, level in calls.items():
        if (other := first.setdefault(level, number)) != number:
            yield number, f"{level} is called by {other} already: give each landing one number"


def _from_gray(pattern: int) -> int:
    number = 0
    while pattern:
        number ^= pattern
        pattern >>= 1
    return number


def _from_bcd(pattern: int) -> int | None:
    digits = f"{pattern:x}"
    return int(digits) if digits.isdecimal() else None
