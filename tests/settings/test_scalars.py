"""Strings, numbers and choices that YAML could misread, or that lie outside their bounds."""

from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from bridges.yaml.scalars import reads_as
from tests.depth import examples
from tests.settings.reading import RIGHT, changed, config_of, problems_of

NAMES_THAT_ARE_NONE = {
    "017": "is written 017, which YAML may read as the number 15",
    "08": "is written 08, which YAML may read as the number 8",
    "0o17": "is written 0o17, which YAML may read as the number 15",
    "0b11": "is written 0b11, which YAML may read as the number 3",
    "0x10": "is written 0x10, which YAML may read as the number 16",
    "1:30": "is written 1:30, which YAML may read as the number 90",
    "-1:30": "is written -1:30, which YAML may read as the number -90",
    "1:30.5": "is written 1:30.5, which YAML may read as the number 90.5",
    "1_0": "is written 1_0, which YAML may read as the number 10",
    "1__": "is written 1__, which YAML may read as a number",
    "17": "is the number 17",
    "1.0": "is the number 1.0",
    "1e3": "is the number 1e3",
    ".5": "is the number .5",
    ".inf": "is written .inf, which YAML may read as infinity",
    ".nan": "is written .nan, which YAML may read as not a number",
    "no": "is written no, which YAML may read as false",
    "y": "is written y, which YAML may read as true",
    "N": "is written N, which YAML may read as false",
    "On": "is written On, which YAML may read as true",
    "YES": "is written YES, which YAML may read as true",
    "true": "is written true, which YAML may read as true",
    "~": "is written ~, which YAML may read as nothing",
    "null": "is written null, which YAML may read as nothing",
    "=": "is written =, which YAML may read as a special mark",
    "2024-02-30": "is written 2024-02-30, which YAML may read as a date",
}


@pytest.mark.parametrize("text", NAMES_THAT_ARE_NONE)
def test_a_name_that_yaml_may_read_as_something_else_must_be_quoted(file: Path, text: str) -> None:
    assert problems_of(file, changed("[in, out]", f"[in, out, {text}]")) == [
        f"8:22: item 3 of 'lanes' {NAMES_THAT_ARE_NONE[text]}: "
        f'if the text is meant, write "{text}" in quotes'
    ]


@pytest.mark.parametrize("text", NAMES_THAT_ARE_NONE)
def test_the_same_name_in_quotes_is_that_name(file: Path, text: str) -> None:
    for quote in "\"'":
        config = config_of(file, changed("[in, out]", f"[in, out, {quote}{text}{quote}]"))
        assert config.devices["north"].lanes == ["in", "out", text]


@pytest.mark.parametrize("begin", ["", "-", "0x", "0o", "0b", "0", "1e", "."])
def test_thousands_of_digits_are_a_problem_at_their_place(file: Path, begin: str) -> None:
    text = begin + "1" * 9000
    (problem,) = problems_of(file, changed("[in, out]", f"[in, out, {text}]"))
    assert problem.startswith("8:22: item 3 of 'lanes' is written ")
    assert len(problem) < 300


@pytest.mark.parametrize("name", ["L1", "B1", "8F_r", "nO", "1.2.3", "-", "L-1", "走廊", "a b"])
def test_an_ordinary_name_needs_no_quotes(file: Path, name: str) -> None:
    config = config_of(file, changed("[in, out]", f"[in, out, {name}]"))
    assert config.devices["north"].lanes == ["in", "out", name]


PLAIN = st.one_of(
    st.from_regex(r"[-+]?[0-9a-fA-FxXob_.:eE+-]{1,12}", fullmatch=True),
    st.text("0123456789_.:eExXob+-~<=nNyYtTuUlLrRsSoOfFaAiI \t", min_size=0, max_size=8),
)


@settings(max_examples=examples(1500))
@given(PLAIN)
def test_every_text_that_pyyaml_misreads_is_known(text: str) -> None:
    loader = yaml.SafeLoader("")
    tag = loader.resolve(yaml.ScalarNode, text, (True, False))  # type: ignore[no-untyped-call]
    assert tag == "tag:yaml.org,2002:str" or reads_as(text) is not None


OTHER_NAMES = {
    '""': "has 0 characters: 1 to 128 are allowed",
    "x" * 129: "has 129 characters: 1 to 128 are allowed",
    '" a"': "is ' a': write text without control characters, and without spaces at its ends",
    '"a\\n"': "is 'a\\n': write text without control characters, and without spaces at its ends",
    '"a\\0b"': "is 'a\\x00b': write text without control characters, and without spaces at its ends",
    "[a]": "is a list: write text",
    "{a: b}": "is a mapping: write text",
}


@pytest.mark.parametrize("text", OTHER_NAMES)
def test_a_name_is_neither_empty_nor_too_long(file: Path, text: str) -> None:
    assert problems_of(file, changed("[in, out]", f"[in, out, {text}]")) == [
        f"8:22: item 3 of 'lanes' {OTHER_NAMES[text]}"
    ]


SECONDS = "write a number from 0.1 to 60 s"
NO_SECONDS = {
    "0": f"is 0: {SECONDS}",
    "-1": f"is -1: {SECONDS}",
    "60.01": f"is 60.01: {SECONDS}",
    "1e3": f"is 1e3: {SECONDS}; for 1000 milliseconds write 1",
    "5 s": f"is written 5 s: write the number alone, {SECONDS[6:]}",
    "0.2s": f"is written 0.2s: write the number alone, {SECONDS[6:]}",
    '"5"': f'is the text "5": {SECONDS}, without quotes',
    "fast": f"is the text 'fast': {SECONDS}",
    "yes": f"is true (yes): {SECONDS}",
    "~": f"is nothing (~): {SECONDS}",
    ".inf": f"is infinity (.inf): {SECONDS}",
    ".nan": f"is not a number (.nan): {SECONDS}",
    "1e999": "is written 1e999, which YAML may read as the number inf: "
    "write a number from 0.1 to 60 s plainly",
    "017": "is written 017, which YAML may read as the number 15: "
    "write a number from 0.1 to 60 s plainly",
    "1:30": "is written 1:30, which YAML may read as the number 90: "
    "write a number from 0.1 to 60 s plainly",
    "1_0": "is written 1_0, which YAML may read as the number 10: "
    "write a number from 0.1 to 60 s plainly",
    "0x10": "is written 0x10, which YAML may read as the number 16: "
    "write a number from 0.1 to 60 s plainly",
    "[1]": f"is a list: {SECONDS}",
}


@pytest.mark.parametrize("text", NO_SECONDS)
def test_a_duration_is_a_plain_number_within_its_bounds(file: Path, text: str) -> None:
    column = "15:22" if text[0] != "[" else "15:14"
    assert problems_of(file, changed("open_s: 3", f"open_s: {text}")) == [
        f"{column}: 'open_s' {NO_SECONDS[text]}"
    ]


@pytest.mark.parametrize(
    ("text", "value"),
    [("5", 5), ("5.", 5), (".5", 0.5), ("1e1", 10), ("+2.5E-1", 0.25), ("60", 60)],
)
def test_a_duration_may_be_written_in_every_plain_way(file: Path, text: str, value: float) -> None:
    config = config_of(file, changed("open_s: 3", f"open_s: {text}"))
    assert config.devices["north"].limits.open_s == value


WHOLE = "a whole number of at least 1"
NO_WHOLE = {
    "0": f"is 0: write {WHOLE}",
    "1.0": f"is the number 1.0: write {WHOLE}",
    "1e3": f"is the number 1e3: write {WHOLE}",
    "017": f"is written 017, which YAML may read as the number 15: write {WHOLE} plainly",
    "08": f"is written 08, which YAML may read as the number 8: write {WHOLE} plainly",
    "0o17": f"is written 0o17, which YAML may read as the number 15: write {WHOLE} plainly",
    "0b11": f"is written 0b11, which YAML may read as the number 3: write {WHOLE} plainly",
    "1:30": f"is written 1:30, which YAML may read as the number 90: write {WHOLE} plainly",
    "1_0": f"is written 1_0, which YAML may read as the number 10: write {WHOLE} plainly",
    "off": f"is false (off): write {WHOLE}",
    '"3"': f'is the text "3": write {WHOLE}, without quotes',
    "three": f"is the text 'three': write {WHOLE}",
    "2024-01-01": f"is a date (2024-01-01): write {WHOLE}",
    "9" * 30: f"is the number {'9' * 30}: write {WHOLE}",
}


@pytest.mark.parametrize("text", NO_WHOLE)
def test_a_count_is_a_plain_whole_number(file: Path, text: str) -> None:
    assert problems_of(file, changed("tries: 2", f"tries: {text}")) == [
        f"15:32: 'tries' {NO_WHOLE[text]}"
    ]


@pytest.mark.parametrize(("text", "value"), [("1", 1), ("+7", 7), ("0x10", 16), ("123456", 123456)])
def test_a_count_may_be_decimal_or_hexadecimal(file: Path, text: str, value: int) -> None:
    config = config_of(file, changed("tries: 2", f"tries: {text}"))
    assert config.devices["north"].limits.tries == value


FIELDS = {
    "even: 3": "'even' is 3: write a whole number in steps of 2",
    "gain: x": "'gain' is the text 'x': write a number",
    "loud: yes": "'loud' is written yes, which YAML versions read differently: write true",
    "loud: N": "'loud' is written N, which YAML versions read differently: write false",
    'loud: "true"': "'loud' is the text \"true\": write true or false, without quotes",
    "loud: 1": "'loud' is the number 1: write true or false",
    "baud: 960": "'baud' is '960': write 9600 or 19200 (did you mean '9600'?)",
    "label: A": "'label' is 'A': write a small word",
    "label: no": "'label' is written no, which YAML may read as false: "
    'if the text is meant, write "no" in quotes',
    "close_s: 5": "'close_s' may not be longer than 'open_s'",
}


@pytest.mark.parametrize("text", FIELDS)
def test_every_type_of_field_describes_its_values(file: Path, text: str) -> None:
    column = 27 + text.index(":")
    assert problems_of(file, changed("tries: 2", text)) == [f"15:{column}: {FIELDS[text]}"]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("label: 7", 7),
        ("label: seven", "seven"),
        ("loud: TRUE", True),
        ("loud: false", False),
        ("baud: 19200", 19200),
        ("close_s: ~", None),
        ("close_s: null", None),
        ("even: -4", -4),
    ],
)
def test_every_type_of_field_accepts_its_values(file: Path, text: str, value: object) -> None:
    limits = config_of(file, changed("tries: 2", text)).devices["north"].limits
    assert getattr(limits, text.partition(":")[0]) == value


def test_a_misspelt_choice_is_reported_with_the_similar_choice(file: Path) -> None:
    text = RIGHT.replace("lanes: [in, out]", "lanes: {in: {side: lfet}, out: {side: 'right'}}")
    assert problems_of(file, text) == [
        "8:24: 'side' is 'lfet': write left or right (did you mean 'left'?)"
    ]


def test_a_long_value_is_shown_in_part(file: Path) -> None:
    assert problems_of(file, changed("dds", "x" * 1000)) == [
        f"3:18: 'transport' is '{'x' * 37}...': write auto, dds, ros2 or zenoh"
    ]
