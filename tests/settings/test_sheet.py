"""`check --json` prints its findings for programs. `check --sheet` writes a page for people to sign.
Both must say the same as the printed text."""

import json
import os
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from bridges.cli import main
from tests.settings.reading import RIGHT, changed

CONFIG = Path(__file__).parents[2] / "config"
LIFT = str(CONFIG / "lift_dry_contact.yaml")
EVIL = '"<script>alert(1)</script>&"'


class Page(HTMLParser):
    """A page with its text, its tags, and everything that it would load or run."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.open: list[str] = []
        self.cells: list[str] = []
        self.loads: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.loads += [name for name, _ in attrs if name in ("src", "href", "onclick")]
        if tag not in ("meta", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] in ("td", "h1", "p"):
            self.cells.append(data)


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def sheet_of(*files: str) -> Page:
    """Return the sheet of correct files."""
    assert main(["check", "-q", "--sheet", "sheet.html", *files]) == 0
    return Page(Path("sheet.html").read_text("utf-8"))


def json_of(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, Any]:
    """Return the exit code and the printed JSON. Fail if the command prints anything else."""
    code = main(["check", "--json", *arguments])
    out, err = capsys.readouterr()
    assert err == ""
    return code, json.loads(out)


def test_a_sheet_has_a_page_for_each_controller() -> None:
    page = sheet_of(LIFT, str(CONFIG / "door_register.yaml"))
    assert page.tags.count("section") == 3
    assert [cell for cell in page.cells if ": lift" in cell or ": door" in cell] == [
        "Lift1: lift, driver dry_contact",
        "ward_door: door, driver register",
        "lab_door: door, driver register",
    ]


def test_every_wire_and_every_code_has_a_box() -> None:
    cells = sheet_of(LIFT).cells
    for row in (
        ["fire_alarm", "BCM4 = J8:7", "in", "low", "down", "0.05 s", "-", "asserted"],
        ["L3", "3", "floor_bit0, floor_bit1", "a fault: floor_bit0, floor_bit1"],
        ["call L4", "call_L4", "on until the car is there"],
    ):
        at = cells.index(row[0])
        while cells[at : at + len(row)] != row:
            at = cells.index(row[0], at + 1)
        assert cells[at + len(row)] == "☐"


def test_a_sheet_needs_nothing_beside_itself() -> None:
    page = sheet_of(LIFT)
    assert page.loads == []
    assert not {"script", "link", "img", "iframe"} & set(page.tags)


def test_texts_of_a_file_never_become_markup_in_the_sheet() -> None:
    Path("gate.yaml").write_text(changed("{1: in, 2: out}", "{}").replace("in, out", f"in, {EVIL}"))
    page = sheet_of("gate.yaml")
    assert "script" not in page.tags
    assert any("<script>alert(1)</script>&" in cell for cell in page.cells)


def test_a_wrong_file_has_no_sheet() -> None:
    Path("gate.yaml").write_text(changed("tries: 2", "tries: 0"))
    assert main(["check", "-q", "--sheet", "sheet.html", "gate.yaml"]) == os.EX_CONFIG
    assert not Path("sheet.html").exists()


def test_a_sheet_that_cannot_be_written_has_its_own_exit_code(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["check", "-q", "--sheet", "no/sheet.html", LIFT]) == os.EX_CANTCREAT
    assert capsys.readouterr().err == (
        "no/sheet.html cannot be written: No such file or directory\n"
    )


def test_json_agrees_with_the_printed_text_for_a_correct_file(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("gate.yaml").write_text(changed("tries: 2", "loud: true"))
    code, found = json_of(capsys, "gate.yaml")
    assert code == 0
    assert (found["ok"], found["errors"], found["warnings"]) == (True, 0, 1)
    (file,) = found["files"]
    assert file["warnings"] == [
        {"file": "gate.yaml", "line": 15, "column": 31, "text": "warning: 'north': it will be loud"}
    ]
    (part,) = file["parts"]
    assert part["tables"][0]["rows"][0] == {
        "signal": "opened",
        "point": "A0 = 0A",
        "direction": "in",
        "active": "high",
        "pull": "up",
        "debounce": "default",
        "at rest": "-",
        "wire broken": "asserted",
    }


def test_json_has_the_problems(capsys: pytest.CaptureFixture[str]) -> None:
    Path("gate.yaml").write_text(changed("tries: 2", "tries: 0"))
    Path("right.yaml").write_text(RIGHT)
    code, found = json_of(capsys, "gate.yaml", "right.yaml")
    assert code == os.EX_CONFIG
    assert (found["ok"], found["errors"]) == (False, 1)
    assert [file["errors"] for file in found["files"]] == [
        [
            {
                "file": "gate.yaml",
                "line": 15,
                "column": 32,
                "text": "'tries' is 0: write a whole number of at least 1",
            }
        ],
        [],
    ]
