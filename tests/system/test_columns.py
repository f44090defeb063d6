"""Tables and sentences that fit into the terminal. A table cuts a word only if nothing else helps."""

import pytest

from bridges.system.columns import aligned, hanging, width

ROWS = [
    ("device", "point", "meaning"),
    ("ward_door", "unit 1 coil 0", "a released door stays open"),
]


@pytest.mark.parametrize("columns", range(12, 80))
def test_no_line_is_wider_than_the_terminal(columns: int) -> None:
    lines = [*aligned(ROWS, columns), *hanging("a released door stays open", columns)]
    assert max(map(width, lines)) <= columns


def test_words_are_whole_while_they_fit() -> None:
    lines = aligned(ROWS, 32)
    assert max(map(width, lines)) <= 32
    assert {word for line in lines for word in line.split()} == {
        w for r in ROWS for w in " ".join(r).split()
    }


def test_a_space_between_columns_is_given_up_before_a_word_is_cut() -> None:
    assert aligned([("ward_door", "released")], 18) == ["ward_door released"]
    assert aligned([("ward_door", "released")], 17) == ["ward_doo released", "r"]


def test_later_lines_of_a_sentence_are_indented() -> None:
    assert hanging("file.yaml:3:1: warning: lower it", 20) == [
        "file.yaml:3:1:",
        "  warning: lower it",
    ]
