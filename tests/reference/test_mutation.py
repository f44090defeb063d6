"""`make mutate` runs every quick story of a kind (the selection in pyproject.toml)."""

import re
import tomllib
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[2]
LONG: Final = re.compile(r"test_(\w*walk|\w*properties|chaos|broken_parts)\.py")
"""Walks over states and drawn examples, which take too long to run for each mutant."""
NO_CORE: Final = {"test_examples.py", "test_shipped.py", "test_purity.py", "test_rules.py"}
"""Tests of shipped files and of the source text. They run no core that a mutant could be in."""


def test_no_quick_story_of_a_kind_is_left_out_of_the_selection() -> None:
    tool = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["mutmut"]
    selected = set(tool["pytest_add_cli_args_test_selection"])
    stories = {
        str(path.relative_to(ROOT))
        for path in (ROOT / "tests/kinds").rglob("test_*.py")
        if not LONG.fullmatch(path.name) and path.name not in NO_CORE
    }
    assert stories - selected == set()
    assert {story for story in selected if not (ROOT / story).is_file()} == set()
