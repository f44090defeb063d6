"""The import rules name whole folders; a new kind must be among them."""

import tomllib
from pathlib import Path

from bridges.kinds import kind_names

PYPROJECT = Path(__file__).parents[3] / "pyproject.toml"


def test_every_kind_is_under_the_purity_contract() -> None:
    contracts = tomllib.loads(PYPROJECT.read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    [pure] = [c["source_modules"] for c in contracts if c["name"].startswith("A kind")]
    assert set(pure) == {
        "bridges.kinds.shared.*",
        *(f"bridges.kinds.{kind}.*" for kind in kind_names()),
    }
