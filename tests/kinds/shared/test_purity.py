"""Checks of two lists in pyproject.toml: the import contract must name every kind, and the files for
`make mutate` must exist."""

import tomllib
from pathlib import Path

from bridges.kinds import kind_names

ROOT = Path(__file__).parents[3]
TOOLS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]


def test_every_kind_is_under_the_purity_contract() -> None:
    contracts = TOOLS["importlinter"]["contracts"]
    [pure] = [c["source_modules"] for c in contracts if c["name"].startswith("A kind")]
    assert set(pure) == {
        "bridges.kinds.shared.*",
        *(f"bridges.kinds.{kind}.*" for kind in kind_names()),
    }


def test_each_file_that_make_mutate_uses_exists() -> None:
    lists = ("source_paths", "only_mutate", "also_copy", "pytest_add_cli_args_test_selection")
    named = [path for name in lists for path in TOOLS["mutmut"][name]]
    assert [path for path in named if not (ROOT / path).exists()] == []
