"""For any content of a file the loader makes a Config or raises SettingsError."""

from pathlib import Path

import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.depth import examples
from tests.settings.reading import RIGHT, problems_of
from tests.settings.test_shipped import FILES
from tests.settings.test_whole_file import BAD

MANY = settings(max_examples=examples(200))
BITS = [*"[]{}:,-?&*!|>'\"%@`#~<=\n\t \\\0", ": ", "- ", "\n  ", "&a ", "*a", "<<: ", "!!str "]
BITS += ["017", "1:30", "no", "1e3", "null", "2024-01-01", ".inf", "0x10", "é", "\ud800", "---\n"]
BITS += ["lanes", "inputs", "point", "active", "codes", "limits", "bus", "header", "type", "north"]


def check_config_or_settings_error(file: Path, text: str | bytes) -> None:
    if isinstance(text, str):
        text = text.encode("utf-8", "surrogatepass")
    for problem in problems_of(file, text):
        line, column, reason = problem.split(":", 2)
        assert int(line) >= 1
        assert int(column) >= 1
        assert reason.isprintable()


@MANY
@given(st.binary(max_size=200))
def test_any_bytes_are_accepted_or_refused_at_their_place(file: Path, text: bytes) -> None:
    check_config_or_settings_error(file, text)


@MANY
@given(st.lists(st.sampled_from(BITS), max_size=40).map("".join))
def test_any_pieces_of_yaml_are_accepted_or_refused_at_their_place(file: Path, text: str) -> None:
    check_config_or_settings_error(file, text)


@MANY
@given(st.sampled_from([RIGHT, BAD, *(path.read_text() for path in FILES)]), st.data())
def test_a_file_with_added_and_removed_pieces_is_accepted_or_refused_at_its_place(
    file: Path, text: str, data: st.DataObject
) -> None:
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(text)))
        length = data.draw(st.integers(0, 20))
        text = text[:start] + data.draw(st.sampled_from(["", *BITS])) + text[start + length :]
    check_config_or_settings_error(file, text)


SCALARS = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(), st.dates(), st.binary()
)
KEYS = st.one_of(st.sampled_from([b for b in BITS if b.isalpha()]), st.integers(), st.text())
VALUES = st.recursive(
    SCALARS, lambda v: st.one_of(st.lists(v), st.dictionaries(KEYS, v)), max_leaves=12
)
SECTIONS = ["kind", "driver", "rmf", "buses", "gates"]


@MANY
@given(st.dictionaries(st.sampled_from(SECTIONS), VALUES), VALUES)
def test_any_values_instead_of_sections_are_accepted_or_refused_at_their_place(
    file: Path, sections: dict[str, object], gate: object
) -> None:
    document = {**yaml.safe_load(RIGHT), **sections}
    check_config_or_settings_error(file, yaml.dump(document, allow_unicode=True))
    document["gates"] = {"north": gate}
    check_config_or_settings_error(file, yaml.dump(document))
