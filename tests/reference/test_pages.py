"""Check that the generated pages of docs/ are up to date."""

import os
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from bridges import cli
from bridges.exit_codes import EXIT_CODES
from bridges.kinds import kind_names
from tests.reference.pages import DOCS, PAGES

ROOT = DOCS.parent


@pytest.mark.parametrize("page", PAGES)
def test_a_generated_page_equals_the_output_of_the_program(page: str) -> None:
    """If this test fails, run `make reference`."""
    assert (DOCS / page).read_text() == PAGES[page]()


def test_each_command_has_its_exit_codes() -> None:
    assert EXIT_CODES.keys() == cli.COMMANDS.keys()


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_each_exit_code_of_a_command_is_documented(command: str) -> None:
    source = Path(cli._module(command).__file__).read_text()
    named = {getattr(os, name) for name in re.findall(r"os\.(EX_[A-Z]+)", source)}
    named |= {int(code) for code in re.findall(r"return (\d+)$", source, re.M)}
    assert named - {2} <= EXIT_CODES[command].keys()


def test_the_table_of_packages_has_every_command() -> None:
    text = (DOCS / "how-to/install.md").read_text().partition("| package | has |")[2]
    daemons, people, page, *_ = (line for line in text.splitlines() if line.startswith("| `"))
    own, theirs, pages = (
        {word for words in re.findall(r"`([\w -]+)`", line) for word in words.split()}
        for line in (daemons, people, page)
    )
    assert own & cli.COMMANDS.keys() == cli.COMMANDS.keys() - cli.WORKBENCH
    assert (theirs | pages | {"page"}) & cli.WORKBENCH == cli.WORKBENCH


def test_the_form_of_a_defect_has_every_kind() -> None:
    form = yaml.safe_load((ROOT / ".github/ISSUE_TEMPLATE/defect.yml").read_text())
    [options] = [part["attributes"]["options"] for part in form["body"] if part.get("id") == "kind"]
    assert set(kind_names()) - set(options) == set()


def tracked(pattern: str) -> Iterator[Path]:
    """Yield the repository's files, except files in the folders of virtual environments and builds."""
    for path in sorted(ROOT.rglob(pattern)):
        if not {".venv", ".venv-ros", "build", "dist"} & set(path.relative_to(ROOT).parts):
            yield path


PAGE = re.compile(r"\bdocs/[\w./-]+\.(?:md|svg|png)\b")


@pytest.mark.parametrize("pattern", ["*.py", "*.md", "*.yaml", "*.service", "*.toml", "*.xml"])
def test_each_page_of_docs_that_a_text_names_exists(pattern: str) -> None:
    """This test is needed because `make docs` checks only the links within docs/."""
    wrong = {
        f"{path.relative_to(ROOT)}: {page}"
        for path in tracked(pattern)
        for page in PAGE.findall(path.read_text())
        if not (ROOT / page).is_file()
    }
    assert sorted(wrong) == []


LIST = re.compile(r"^(?![ |#-]|\d+\. |<!--|```).*\S\n(?:- |1\. |\| )", re.M)


def test_a_list_or_table_begins_after_an_empty_line() -> None:
    """Without the empty line Python-Markdown adds the list or table to the paragraph before."""
    texts = {
        page.name: re.sub(r"^ *```.*?^ *```$", "", page.read_text(), flags=re.M | re.S)
        for page in DOCS.rglob("*.md")
    }
    assert {name: found for name, text in texts.items() if (found := LIST.findall(text))} == {}
