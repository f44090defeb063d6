"""Bits, and checks of number tables, for registers, CAN frames and JSON fields."""

from collections.abc import Collection, Mapping
from typing import Annotated, Final

import msgspec

from bridges.kinds.shared.remarks import Remarks

BITS: Final = 16
"""The number of bits in a register."""
Bit = Annotated[int, msgspec.Meta(ge=0, le=BITS - 1)]
"""A bit of a register. Bit 0 is the least significant."""
LongBit = Annotated[int, msgspec.Meta(ge=0, le=2 * BITS - 1)]
"""A bit of a number of up to 32 bits."""


def bits_on(number: int) -> list[int]:
    """Return the set bits of a number, the least significant first."""
    return [bit for bit in range(number.bit_length()) if number >> bit & 1]


def listed_twice(lists: Mapping[str, Collection[int]]) -> Remarks:
    """Yield a problem for each number that is listed twice, in one list or in two. `lists` gives the
    numbers of each key of the YAML."""
    first: dict[int, str] = {}
    for key, numbers in lists.items():
        for i, number in enumerate(numbers):
            if number in first:
                path = (key, str(number if isinstance(numbers, Mapping) else i))
                yield path, f"{number} is listed under {first[number]} already"
            first.setdefault(number, key)
