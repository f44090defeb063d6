"""The daemons' package alone, with the workbench's package, and with a workbench of another version.

The tree of files has our own code and the libraries of the tests' environment. The real dpkg installs
it.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from tests.deb.small import SITE, System, archived, built

pytestmark = pytest.mark.skipif(shutil.which("dpkg") is None, reason="dpkg is Debian's")

ROOT = Path(__file__).parents[2]
LIFT, NO_OUTPUTS = ROOT / "config/lift_dry_contact.yaml", ROOT / "config/lift_supervisor.yaml"
ONE, TWO = "0.1.0+r1.ga", "0.1.0+r2.gb"
BENCH = "rmf-bridges-workbench"
PROGRAM = """#!/usr/bin/python3
import sys

from bridges.cli import main

sys.exit(main())
"""


def daemons(folder: Path, version: str) -> Path:
    """Return the package rmf-bridges with our code."""
    work, tree = folder / version, folder / f"{version}.tree"
    for name in ("bridges", "drivers"):
        shutil.copytree(ROOT / name, tree / SITE / name)
    (tree / SITE / "libraries.pth").write_text(sysconfig.get_path("purelib"))
    (tree / f"lib/python{sys.version_info.major}.{sys.version_info.minor}").symlink_to("python3")
    python = Path(sys.base_prefix, "bin/python3")
    (tree / "pyvenv.cfg").write_text(f"home = {python.parent}\n")
    (tree / "bin").mkdir()
    (tree / "bin/python3").symlink_to(python)
    (tree / "bin/rmf-bridge").write_text(PROGRAM)
    (tree / "bin/rmf-bridge").chmod(0o755)
    archived(work, tree)
    return built(work, "rmf-bridges", version)


def workbench(folder: Path, version: str) -> Path:
    work = folder / f"workbench-{version}"
    for name in ("workbench", "hal_fakes"):
        shutil.copytree(ROOT / name, work / "usr/lib" / BENCH / version / name)
    return built(work, BENCH, version, f"Depends: rmf-bridges (= {version})")


Debs = dict[str, tuple[Path, Path]]
"""The packages of the daemons and of the workbench, by version."""


@pytest.fixture(scope="module")
def debs(tmp_path_factory: pytest.TempPathFactory) -> Debs:
    folder = tmp_path_factory.mktemp("packages")
    return {v: (daemons(folder, v), workbench(folder, v)) for v in (ONE, TWO)}


def ask(made: System, *words: str | Path, **also: str) -> subprocess.CompletedProcess[str]:
    """Run the installed `rmf-bridge`, and return the finished process."""
    command = [made.root / "usr/lib/rmf-bridges/bin/rmf-bridge", *words]
    env = {**os.environ, "HOME": str(made.root), **also}
    env.pop("PYTHONPATH", None)
    return subprocess.run(command, env=env, capture_output=True, text=True, timeout=60)


def code(made: System, *words: str | Path) -> int:
    return ask(made, *words).returncode


def completed(made: System, typed: str) -> list[str]:
    """Return the words that a shell offers after these typed words."""
    told = made.root / "told"
    line = {"COMP_LINE": typed, "COMP_POINT": str(len(typed)), "_ARGCOMPLETE": "1"}
    asked = {"_ARGCOMPLETE_STDOUT_FILENAME": str(told), "_ARGCOMPLETE_IFS": "\n"}
    assert ask(made, **line, **asked).stderr == ""
    return sorted(word.strip() for word in told.read_text().splitlines())


def how(version: str) -> str:
    return f"sudo apt install ./{BENCH}_{version}_*.deb\n"


def serves(made: System) -> bool:
    """Return whether the daemons' commands work, and whether each workbench command names the missing
    package."""
    for asked in (("check", LIFT), ("outputs-off", NO_OUTPUTS), ("--help",)):
        assert code(made, *asked) == 0
    for words in (("watch",), ("walk", "--help"), ("run", "--simulate", LIFT)):
        told = ask(made, *words)
        text = f"rmf-bridge {words[0]}: not installed: {how(ONE)}"
        assert (told.returncode, told.stderr[-len(text) :]) == (os.EX_UNAVAILABLE, text)
    assert completed(made, "rmf-bridge re") == ["recorder", "reset"]
    assert "--simulate" in completed(made, "rmf-bridge run --s")
    return True


@pytest.mark.long(30)
def test_daemons_work_before_the_workbench_is_installed_and_after_its_removal(
    tmp_path: Path, debs: Debs
) -> None:
    made = System(tmp_path)
    assert made.dpkg("-i", debs[ONE][0]).returncode == 0
    assert serves(made)
    assert made.dpkg("-i", debs[ONE][1]).returncode == 0
    assert [code(made, "watch", "--help"), code(made, "check", LIFT)] == [0, 0]
    assert completed(made, "rmf-bridge re") == ["recorder", "release", "replay", "reset"]
    assert made.dpkg("-P", BENCH).returncode == 0
    assert not (made.root / "usr/lib" / BENCH).exists()
    assert serves(made)


@pytest.mark.long(30)
def test_daemons_whose_upgrade_was_refused_use_no_workbench_of_another_version(
    tmp_path: Path, debs: Debs
) -> None:
    made = System(tmp_path)
    assert made.dpkg("-i", *debs[ONE]).returncode == 0
    made.service("lift")
    yaml = made.root / "etc/rmf-bridges/lift.yaml"
    yaml.write_text("kind: lift\nflors: [L1]\n")
    told = made.dpkg("-i", *debs[TWO])
    assert (told.returncode, f"{yaml}:2:1: " in told.stderr) == (1, True)
    refused = ask(made, "watch")
    assert (refused.returncode, refused.stderr) == (
        os.EX_UNAVAILABLE,
        f"rmf-bridge watch: not installed: {BENCH} is {TWO}, and these daemons are {ONE}: both must be"
        " the same version. If an upgrade was refused, run sudo dpkg --configure -a; otherwise run"
        f" {how(ONE)}",
    )
    assert [code(made, "check", LIFT), code(made, "outputs-off", NO_OUTPUTS)] == [0, 0]
    shutil.copy(LIFT, yaml)
    assert made.dpkg("--configure", "-a").returncode == 0
    assert code(made, "watch", "--help") == 0
