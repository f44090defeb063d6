"""Check that each line of the threat model names an existing test, or has the word **gap:**."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/explanation/threats.md"
HEAD = "| act | what stops it | test |"
TEST = re.compile(r"`(tests/[\w/]+\.py)::(test_\w+)`")
ROWS = [
    line
    for part in PAGE.read_text().split(HEAD)[1:]
    for line in part.partition("\n\n")[0].splitlines()[2:]
]


def test_each_wire_has_its_rows() -> None:
    sections = PAGE.read_text().split("\n## ")[1:]
    assert [part.partition("\n")[0] for part in sections if HEAD in part] == [
        "RMF's graph",
        "Field wires",
        "The machine",
        "The page",
        "The software",
    ]
    assert len(ROWS) == PAGE.read_text().count("\n| ") - 5


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[2:60])
def test_a_row_names_an_existing_test_or_a_gap(row: str) -> None:
    _, _, stops, proof, _ = row.split("|")
    assert ("**gap:**" in stops) == (proof.strip() == "–")
    assert proof.strip() == "–" or TEST.search(proof)
    for file, test in TEST.findall(row):
        assert re.search(rf"^    ?def {test}\(|^def {test}\(", (ROOT / file).read_text(), re.M)
