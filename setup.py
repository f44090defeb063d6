"""Add the commit to the version, which pyproject.toml cannot do.

`0.1.0+r900.gabcdef0` is the 900th commit; `.m` and the time of the last change follow for a checkout
with changes. The commit with the tag `v0.1.0` is version 0.1.0 itself. Where there is no git, the build
is unknown: the version is 0.1.0, and the built `bridges` has an empty BUILD.
"""

import re
import subprocess
import time
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

HERE = Path(__file__).resolve().parent
FACE = "bridges/__init__.py"
RELEASE = "release"
PLAIN = re.search(r'__version__ = "(.*)"', (HERE / FACE).read_text())[1]  # type: ignore[index]


def build() -> str:
    """Return the commit's number and short hash, or `release`; "" if this is no checkout of its own."""
    if not (HERE / ".git").exists():
        return ""
    try:
        number, short = _git("rev-list", "--count", "HEAD"), _git("rev-parse", "--short", "HEAD")
        changed = _git("diff", "--name-only", "HEAD").splitlines()
        tags = _git("tag", "--points-at", "HEAD").splitlines()
    except (OSError, subprocess.CalledProcessError):
        return ""
    if f"v{PLAIN}" in tags and not changed:
        return RELEASE
    return f"r{number}.g{short}" + (_last_change(changed) if changed else "")


def _last_change(files: list[str]) -> str:
    """Return the time of the last change to these files; for a deleted file, the checkout's time."""
    there = [path if path.exists() else HERE for path in map(HERE.joinpath, files)]
    at = time.gmtime(max(path.stat().st_mtime for path in there))
    return time.strftime(".m%Y%m%d%H%M%S", at)


def _git(*words: str) -> str:
    done = subprocess.run(["git", "-C", HERE, *words], capture_output=True, text=True, check=True)
    return done.stdout.strip()


BUILD = build()
VERSION = PLAIN if BUILD in ("", RELEASE) else f"{PLAIN}+{BUILD}"


class BuildPy(build_py):
    """Writes the build into the copy of `bridges` that is installed."""

    def run(self) -> None:
        super().run()
        built = Path(self.build_lib) / FACE
        if built.exists():  # an editable installation has no copy, as its sources change
            text = (HERE / FACE).read_text()
            built.unlink()  # the copy may be a hard link to our source
            built.write_text(text.replace('BUILD = ""', f'BUILD = "{BUILD}"'))


setup(version=VERSION, cmdclass={"build_py": BuildPy})
