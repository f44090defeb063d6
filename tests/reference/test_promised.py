"""Check that promised names stay for a whole major version. If a YAML key gets a new name, files with
the old name must stay readable."""

import re
from fnmatch import fnmatch
from pathlib import Path

from bridges import cli
from bridges.kinds import kind_names
from bridges.settings.renamed_keys import RENAMED
from tests.reference.promised import present, promised

PAGE = Path(__file__).parents[2] / "docs/reference/promises.md"


def test_every_promised_name_is_there() -> None:
    """If a key gets a new name, add a row to `bridges/settings/renamed_keys.py`."""
    renamed = [f"key {row.was}*" for row in RENAMED]
    lost = set(promised()) - present()
    assert [line for line in sorted(lost) if not any(fnmatch(line, was) for was in renamed)] == []


def test_every_name_of_this_version_is_promised() -> None:
    """If this test fails, run `make reference`."""
    assert present() - set(promised()) == set()


def test_every_experimental_name_exists() -> None:
    section = PAGE.read_text().partition("\n## Experimental\n")[2].partition("\n## ")[0]
    named = re.findall(r"^\| `([\w: ]+)`", section, re.M)
    assert named
    known = {*cli.COMMANDS, *(f"kind: {name}" for name in kind_names())}
    assert set(named) - known == set()
