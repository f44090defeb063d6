"""setup.py adds the commit to the version, so that a corrected package has a newer version."""

import shutil
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import pytest

from bridges import __version__

ROOT = Path(__file__).parents[2]


def git(folder: Path, *words: str) -> str:
    names = ("-c", "user.name=n", "-c", "user.email=n@n")
    command = ["git", "-C", str(folder), *names, *words]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def version(folder: Path) -> str:
    words = [sys.executable, "setup.py", "--version"]
    done = subprocess.run(words, cwd=folder, check=True, capture_output=True, text=True)
    return done.stdout.splitlines()[-1]


@pytest.fixture
def sources(tmp_path: Path) -> Path:
    for name in ("setup.py", "bridges/__init__.py"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    return tmp_path


def test_each_commit_and_each_uncommitted_change_gives_a_newer_version(sources: Path) -> None:
    git(sources, "init", "-q")
    seen = []
    for number in (1, 2):
        git(sources, "add", "setup.py", "bridges")
        git(sources, "commit", "-q", "--allow-empty", "-m", "a step")
        seen.append(version(sources))
        assert (
            seen[-1] == f"{__version__}+r{number}.g{git(sources, 'rev-parse', '--short', 'HEAD')}"
        )
    with (sources / "bridges/__init__.py").open("a") as changed:
        changed.write("# changed\n")
    seen.append(version(sources))
    assert seen[-1].startswith(f"{seen[1]}.m20")
    packages = [f"{__version__}+deb13", *(f"{each}+deb13" for each in seen)]
    for older, newer in pairwise(packages):
        subprocess.run(["dpkg", "--compare-versions", older, "lt", newer], check=True)


def test_without_its_own_checkout_the_build_is_unknown(sources: Path) -> None:
    git(sources, "init", "-q")
    inner = sources / "archive"
    shutil.copytree(sources / "bridges", inner / "bridges")
    shutil.copy(sources / "setup.py", inner)
    assert version(inner) == __version__


def test_the_commit_with_the_tag_of_a_version_has_that_version_without_changes(
    sources: Path,
) -> None:
    git(sources, "init", "-q")
    git(sources, "add", "setup.py", "bridges")
    git(sources, "commit", "-q", "-m", "a release")
    git(sources, "tag", "v9.9.9")
    assert version(sources).startswith(f"{__version__}+r1.g")
    git(sources, "tag", f"v{__version__}")
    assert version(sources) == __version__
    with (sources / "bridges/__init__.py").open("a") as changed:
        changed.write("# changed\n")
    assert version(sources).startswith(f"{__version__}+r1.g")


def test_the_ros_package_has_the_same_version() -> None:
    package = ElementTree.parse(ROOT / "ros/package.xml").getroot()
    assert package.findtext("version") == __version__
