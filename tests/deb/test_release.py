"""deb/release.sh makes a release only if tree, tag, version, CHANGELOG and key agree."""

import shutil
import subprocess
from pathlib import Path

import pytest

from bridges import __version__
from tests.deb.test_version import git

ROOT = Path(__file__).parents[2]


@pytest.fixture
def sources(tmp_path: Path) -> Path:
    """Return a checkout with a release's commit and CHANGELOG, but without the release's tag."""
    for name in ("deb/release.sh", "bridges/__init__.py", "ros/package.xml", "CHANGELOG.md"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    changelog = tmp_path / "CHANGELOG.md"
    changelog.write_text(
        f"# Changelog\n\n## {__version__}, 2026-11-24\n- Now.\n\n## 0.0.9\n- Before.\n"
    )
    git(tmp_path, "init", "-q")
    commit(tmp_path)
    return tmp_path


def commit(folder: Path) -> None:
    git(folder, "add", "--all")
    git(folder, "commit", "-q", "--allow-empty", "-m", "a step")


def refusal(folder: Path, key: str = "nobody's") -> str:
    """Run the script, which must fail. Return its reason."""
    environment = {"PATH": "/usr/bin:/bin", "KEY": key, "GNUPGHOME": str(folder / ".git")}
    script = ["sh", "deb/release.sh"]
    done = subprocess.run(script, cwd=folder, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (1, "")
    assert not (folder / "dist").exists()
    return done.stderr.removeprefix("no release: ").strip()


def test_a_commit_without_its_tag_is_no_release(sources: Path) -> None:
    wanted = f"the version is {__version__}: its tag is v{__version__}"
    assert refusal(sources) == f"the commit has the tag '', but {wanted}"
    git(sources, "tag", "v9.9.9")
    assert refusal(sources) == f"the commit has the tag 'v9.9.9', but {wanted}"


@pytest.mark.parametrize("name", ["CHANGELOG.md", "stranger.py"])
def test_a_changed_or_unknown_file_is_no_release(sources: Path, name: str) -> None:
    git(sources, "tag", f"v{__version__}")
    with (sources / name).open("a") as changed:
        changed.write("more\n")
    assert refusal(sources) == "the checkout has changes (git status)"


@pytest.mark.parametrize(
    "heading", ["## 9.9.9, 2026-11-24", f"## {__version__}, not released yet", f"# {__version__}"]
)
def test_a_changelog_without_the_version_is_no_release(sources: Path, heading: str) -> None:
    (sources / "CHANGELOG.md").write_text(f"# Changelog\n\n{heading}\n- Now.\n")
    commit(sources)
    git(sources, "tag", f"v{__version__}")
    assert refusal(sources) == f"CHANGELOG.md has no section '## {__version__}, DATE'"


def test_a_ros_package_of_another_version_is_no_release(sources: Path) -> None:
    package = sources / "ros/package.xml"
    package.write_text(package.read_text().replace(__version__, "9.9.9"))
    commit(sources)
    git(sources, "tag", f"v{__version__}")
    assert refusal(sources) == f"ros/package.xml has another version than {__version__}"


def test_without_a_secret_key_nothing_is_made(sources: Path) -> None:
    git(sources, "tag", f"v{__version__}")
    assert refusal(sources, "").startswith("KEY names no key")
    assert refusal(sources) == "gpg has no secret key 'nobody's'"
