"""`make mutate` judges the mutants of a small file correctly, and tests only mutants without a stored
result. It needs the extra `mutate`."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mutmut", reason="pip install -e '.[mutate]'")

CODE = """
def noticed(number):
    return number + 1

class Holder:
    def unnoticed(self, number):
        return number + 2

def never_called(number):
    return number + 3
"""
TEST = """
import small

def test_small():
    assert small.noticed(1) == 2
    assert small.Holder().unnoticed(1)
"""
TOOL = """
[tool.mutmut]
source_paths = ["small.py"]
only_mutate = ["small.py"]
pytest_add_cli_args_test_selection = ["test_small.py"]
"""


def mutate(here: Path, *only: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tests.mutants", *only]
    path = {**os.environ, "PYTHONPATH": f"{here}{os.pathsep}{Path(__file__).parents[1]}"}
    return subprocess.run(command, cwd=here, env=path, capture_output=True, text=True)


def test_a_mutant_is_killed_survives_or_has_no_test_and_is_judged_once(tmp_path: Path) -> None:
    for name, text in (("small.py", CODE), ("test_small.py", TEST), ("pyproject.toml", TOOL)):
        (tmp_path / name).write_text(text)
    first = mutate(tmp_path)
    assert "6 mutants, 6 to judge" in first.stderr, first
    assert first.stdout.splitlines() == [
        "small: 6: 2 killed, 2 survived, 2 untested",
        "survived   small.xǁHolderǁunnoticed__mutmut_1",
        "           - return number + 2 + return number - 2",
        "survived   small.xǁHolderǁunnoticed__mutmut_2",
        "           - return number + 2 + return number + 3",
        "untested   small.x_never_called__mutmut_1",
        "           - return number + 3 + return number - 3",
        "untested   small.x_never_called__mutmut_2",
        "           - return number + 3 + return number + 4",
    ]
    assert first.returncode == 1
    assert "6 mutants, 0 to judge" in mutate(tmp_path).stderr
    (tmp_path / "test_small.py").write_text(TEST.replace("unnoticed(1)", "unnoticed(1) == 3"))
    assert "6 mutants, 2 to judge" in mutate(tmp_path).stderr
    part = mutate(tmp_path, "small.x_noticed*")
    assert (part.returncode, part.stdout) == (0, "small: 2: 2 killed\n")
    (tmp_path / "test_small.py").write_text(TEST.replace("== 2", "== 3"))
    assert "fails without a mutant" in mutate(tmp_path).stderr
