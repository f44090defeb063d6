"""Binary numbers on lines, and floor codes that are read from lines."""

from typing import Any

import pytest

from drivers.lift.codes import Encoding, decode, encode
from drivers.lift.wiring import FloorCode
from tests.drivers.lift.wirings import FLOORS, bits, line, settings


def on(text: str) -> list[bool]:
    """Return the lines of a binary number, least significant first. `011` is 3, because the first
    character is the most significant bit."""
    return [c == "1" for c in reversed(text)]


@pytest.mark.parametrize(
    ("encoding", "shown", "numbers"),
    [
        (
            "binary",
            ["000", "001", "010", "011", "100", "101", "110", "111"],
            [0, 1, 2, 3, 4, 5, 6, 7],
        ),
        (
            "gray",
            ["000", "001", "011", "010", "110", "111", "101", "100"],
            [0, 1, 2, 3, 4, 5, 6, 7],
        ),
        ("bcd", ["00000", "01000", "01001", "10000", "11001"], [0, 8, 9, 10, 19]),
    ],
)
def test_every_encoding_reads_and_shows_its_numbers(
    encoding: Encoding, shown: list[str], numbers: list[int]
) -> None:
    width = len(shown[0])
    assert [decode(encoding, on(text)) for text in shown] == numbers
    assert [list(encode(encoding, n, width)) for n in numbers] == [on(text) for text in shown]


def test_a_bcd_digit_above_nine_is_not_a_number() -> None:
    assert [decode("bcd", on(text)) for text in ("1010", "1111", "00011010")] == [None] * 3


@pytest.mark.parametrize(
    ("encoding", "number", "width"), [("binary", 8, 3), ("gray", 4, 2), ("bcd", 10, 4)]
)
def test_a_number_that_does_not_fit_is_refused(encoding: Encoding, number: int, width: int) -> None:
    with pytest.raises(ValueError, match=f"^{number} does not fit on {width} lines in {encoding}$"):
        encode(encoding, number, width)


def code(**section: Any) -> FloorCode:
    return settings(floor_code=section).floor_code


def shown(text: str) -> dict[str, bool]:
    return {f"floor_bit{i}": asserted for i, asserted in enumerate(on(text))}


BINARY = {"encoding": "binary", "bits": bits(3), "codes": {1: "B1", 2: "G", 4: "1"}}


def test_only_listed_codes_are_floors_and_no_line_on_is_between_floors() -> None:
    binary = code(**BINARY)
    assert {text: binary.read(shown(text)) for text in ("000", "001", "010", "011", "100")} == {
        "000": (None, ""),
        "001": ("B1", ""),
        "010": ("G", ""),
        "011": (None, "code 3 is no floor's code"),
        "100": ("1", ""),
    }


def test_a_floor_may_have_code_0_if_another_code_means_between_floors() -> None:
    binary = code(
        encoding="binary", bits=bits(2), codes={0: "B1", 1: "G", 2: "1"}, between_floors=[3]
    )
    assert [binary.read(shown(text)) for text in ("00", "01", "10", "11")] == [
        ("B1", ""),
        ("G", ""),
        ("1", ""),
        (None, ""),
    ]


def test_parity_shows_every_single_broken_line() -> None:
    for total in ("even", "odd"):
        checked = code(**BINARY, parity=line(30, total=total))
        for level in (*FLOORS, None):
            right = checked.show(level)
            assert checked.read(right) == (level, "")
            wrong = [checked.read({**right, s: not right[s]}) for s in right]
            assert wrong == [(None, f"parity is not {total}: a line is broken")] * 4


def test_one_line_for_each_floor_and_never_two() -> None:
    hot = settings().floor_code
    none = {f"floor_{level}": False for level in FLOORS}
    assert hot.read(none) == (None, "")
    assert [hot.read({**none, f"floor_{level}": True}) for level in FLOORS] == [
        (level, "") for level in FLOORS
    ]
    assert hot.read({**none, "floor_B1": True, "floor_1": True}) == (
        None,
        "the lines of B1 and 1 are on at once",
    )
    assert [hot.show(level) for level in ("G", None)] == [{**none, "floor_G": True}, none]


def test_a_bcd_code_that_is_not_a_digit_is_a_fault() -> None:
    bcd = code(encoding="bcd", bits=bits(4), codes={1: "B1", 2: "G", 3: "1"})
    assert bcd.read(shown("1010")) == (None, "a BCD digit above 9")


def test_gray_neighbours_are_one_line_apart() -> None:
    gray = code(encoding="gray", bits=bits(2), codes={1: "B1", 2: "G", 3: "1"})
    assert [gray.read(shown(text)) for text in ("00", "01", "11", "10")] == [
        (None, ""),
        ("B1", ""),
        ("G", ""),
        ("1", ""),
    ]
