"""Keys, lists and mappings that are unknown, repeated, missing, or of the wrong type."""

from pathlib import Path

import pytest

from tests.settings.reading import RIGHT, changed, config_of, problems_of

INPUT = "point, active, pull, debounce_s, bus"


def test_an_unknown_key_is_reported_with_the_similar_key(file: Path) -> None:
    assert problems_of(file, changed("debounce_s: 1e-2", "debonce_s: 1e-2")) == [
        f"11:52: unknown key 'debonce_s': did you mean 'debounce_s'? known here: {INPUT}"
    ]


def test_an_unknown_key_without_a_similar_key_is_reported_with_the_known_keys(file: Path) -> None:
    assert problems_of(file, changed("debounce_s: 1e-2", "color: red")) == [
        f"11:52: unknown key 'color': known here: {INPUT}"
    ]


def test_a_misspelt_key_is_not_reported_as_missing_too(file: Path) -> None:
    assert problems_of(file, changed("{point: A0", "{piont: A0")) == [
        f"10:16: unknown key 'piont': did you mean 'point'? known here: {INPUT}"
    ]


def test_a_missing_key_is_reported_at_its_parent(file: Path) -> None:
    text = changed("{point: A0, active: high, pull: up}", "{}")
    text = changed("    lanes: [in, out]\n", "", text)
    assert problems_of(file, text) == [
        "7:3: 'north' needs 'lanes': a list ([...]) or a mapping (key: value)",
        "9:7: 'opened' needs 'active': high or low",
        "9:7: 'opened' needs 'point': text",
    ]


def test_a_repeated_key_names_the_line_of_the_first(file: Path) -> None:
    text = changed("    outputs:\n", "    lanes: [a]\n    'lanes': [b]\n    outputs:\n")
    assert problems_of(file, text) == [
        "12:5: the key 'lanes' is already on line 8: delete one of the two",
        "13:5: the key 'lanes' is already on line 8: delete one of the two",
    ]


def test_a_number_as_a_key_is_the_same_in_any_spelling(file: Path) -> None:
    assert problems_of(file, changed("{1: in, 2: out}", "{1: in, 0x1: out}")) == [
        "14:20: the key '0x1' is already on line 14: delete one of the two"
    ]


def test_keys_follow_the_same_rules_as_values(file: Path) -> None:
    codes = '{01: in, "2": out, 16: in, x: out, [1]: in}'
    assert problems_of(file, changed("{1: in, 2: out}", codes)) == [
        "14:13: this key is written 01, which YAML may read as the number 1: "
        "write a whole number from 0 to 15 plainly",
        '14:21: this key is the text "2": write a whole number from 0 to 15, without quotes',
        "14:31: this key is 16: write a whole number from 0 to 15",
        "14:39: this key is the text 'x': write a whole number from 0 to 15",
        "14:47: a key must be text, but this is a list",
    ]


def test_merge_keys_are_refused_with_a_remedy(file: Path) -> None:
    text = changed("opened: {", "opened: &o {")
    text = changed("closed: {point: 1A,", "closed: {<<: *o, point: 1A,", text)
    assert problems_of(file, text) == [
        "11:16: merge keys ('<<') are not accepted: write the keys out"
    ]


def test_a_quoted_merge_mark_is_an_ordinary_key(file: Path) -> None:
    assert problems_of(file, changed("debounce_s: 1e-2", "'<<': 1")) == [
        f"11:52: unknown key '<<': known here: {INPUT}"
    ]


NOT_LANES = {
    "in": "8:12: 'lanes' is the text 'in'",
    "7": "8:12: 'lanes' is the number 7",
    "": "8:5: 'lanes' has no value",
    "~": "8:12: 'lanes' has no value",
}


@pytest.mark.parametrize("text", NOT_LANES)
def test_a_list_or_a_mapping_is_neither_text_nor_number(file: Path, text: str) -> None:
    assert problems_of(file, changed("[in, out]", text)) == [
        f"{NOT_LANES[text]}: write a list ([...]) or a mapping (key: value)"
    ]


def test_a_key_that_takes_a_list_or_a_mapping_reads_both(file: Path) -> None:
    as_mapping = changed("[in, out]", "{in: {heights: [2, 3.5]}, out: {side: right}}")
    lanes = config_of(file, as_mapping).devices["north"].lanes
    assert {n: (lane.side.value, lane.heights) for n, lane in lanes.items()} == {
        "in": ("left", (2.0, 3.5)),
        "out": ("right", ()),
    }
    assert config_of(file, RIGHT).devices["north"].lanes == ["in", "out"]


def test_an_item_of_a_list_is_named_by_its_number(file: Path) -> None:
    text = changed("[in, out]", "{in: {heights: [2, 5, tall, {}, 0]}, out: {}}")
    wanted = "write a number above 0 and below 5 m"
    assert problems_of(file, text) == [
        f"8:31: item 2 of 'heights' is 5: {wanted}",
        f"8:34: item 3 of 'heights' is the text 'tall': {wanted}",
        f"8:40: item 4 of 'heights' is a mapping: {wanted}",
        f"8:44: item 5 of 'heights' is 0: {wanted}",
    ]


def test_a_list_has_no_more_entries_than_allowed(file: Path) -> None:
    bits = ", ".join(f"{{point: A{n}, active: high, pull: up}}" for n in (3, 4, 5))
    assert problems_of(file, changed("    outputs:", f"    bits: [{bits}]\n    outputs:")) == [
        "12:5: 'bits' has 3 entries: at most 2 are allowed"
    ]


def test_a_mapping_is_neither_a_list_nor_a_word(file: Path) -> None:
    text = changed("{open_s: 3, tries: 2}", "[3, 2]")
    text = changed("{1: in, 2: out}", "none", text)
    assert problems_of(file, text) == [
        "14:12: 'codes' is the text 'none': write a mapping (key: value)",
        "15:5: 'limits' is a list: write a mapping (key: value)",
    ]


def test_an_empty_section_is_named(file: Path) -> None:
    assert problems_of(file, changed(" {open_s: 3, tries: 2}", "")) == [
        "15:5: 'limits' has no value: write a mapping (key: value)"
    ]


def test_an_empty_value_is_named_even_if_the_key_is_optional(file: Path) -> None:
    assert problems_of(file, changed("tries: 2", "close_s:")) == [
        "15:25: 'close_s' has no value: write a number from 0 to 86400 s"
    ]


def test_a_problem_of_a_struct_is_reported_at_the_place_that_it_names(file: Path) -> None:
    text = changed("{1: in, 2: out}", "{1: in, 2: yard, 0x3: roof}")
    text = changed("tries: 2", "close_s: 9", text)
    assert problems_of(file, text) == [
        "14:5: 'codes': code 3 is no lane: 'roof'",
        "14:23: 'codes': code 2 is no lane: 'yard'",
        "15:34: 'close_s' may not be longer than 'open_s'",
    ]
