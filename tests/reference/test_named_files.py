"""Check that the files which the documentation names exist."""

import re
from pathlib import Path, PurePath

import pytest

ROOT = Path(__file__).parents[2]
ROOMS = (
    "bridges",
    "drivers",
    "hal_fakes",
    "workbench",
    "tests",
    "bench",
    "deb",
    "config",
    "docs",
    "systemd",
    "ros",
)
THERE = [
    PurePath(path.relative_to(ROOT))
    for room in ROOMS
    for path in (ROOT / room, *(ROOT / room).rglob("*"))
    if "__pycache__" not in path.parts
]
PATH = re.compile(r"`([\w.-]+(?:/[\w.-]+)*(?:/|\.(?:py|md|yaml|dbc)))`")
"""A pattern for the path of a file or folder in a text. It does not match a path with `<kind>` or `*`,
because such a path means many files."""
WAYS = ("a request", "an edge", "a register", "a frame", "a YAML")


def named(text: str) -> list[str]:
    return [found for found in PATH.findall(text) if found != "plant.sock"]


@pytest.mark.parametrize("page", ["docs/explanation/architecture.md", "CONTRIBUTING.md"])
def test_every_file_that_is_named_exists(page: str) -> None:
    found = named((ROOT / page).read_text())
    assert len(found) > 10
    assert [n for n in found if not any(path.match(n.rstrip("/")) for path in THERE)] == []


def test_each_program_that_a_page_names_by_its_folder_exists() -> None:
    """The test also checks old decisions. If a file has moved, a decision must name the file's present
    path."""
    programs = [path for path in THERE if path.suffix == ".py"]
    lost = [
        f"{page.name}: {found}"
        for page in (ROOT / "README.md", *(ROOT / "docs").rglob("*.md"))
        for found in named(page.read_text())
        if "/" in found and found.endswith(".py") and not any(p.match(found) for p in programs)
    ]
    assert lost == []


@pytest.mark.parametrize("way", WAYS)
def test_each_of_the_five_paths_is_described_file_by_file(way: str) -> None:
    page = (ROOT / "docs" / "explanation" / "architecture.md").read_text()
    section = page.partition(f"\n## The path of {way}\n")[2].partition("\n## ")[0]
    steps = re.split(r"\n\d\. ", section)[1:]
    assert len(steps) >= 6
    assert [step for step in steps[:-1] if not named(step)] == []
