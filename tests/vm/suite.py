"""Tests for the machine to run, on what the package has installed there, and what they need."""

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

from tests.vm.image import Unusable

PYTHON: Final = "3.13"
"""Debian 13's."""
MACHINES: Final = {"amd64": "x86_64", "arm64": "aarch64"}
NEEDED: Final = ("hypothesis", "pytest", "pytest-timeout", "trustme")


def suite(arch: str, root: Path, folder: Path) -> Path:
    """A folder with `tests`, the fakes, `config`, `pyproject.toml`, and in `site` what runs them.

    Raises Unusable.
    """
    made, site = folder / "suite", folder / "suite/site"
    for name in ("tests", "hal_fakes", "config"):
        shutil.rmtree(made / name, ignore_errors=True)
        shutil.copytree(root / name, made / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(root / "pyproject.toml", made)
    if not site.exists():
        _fetch(MACHINES[arch], site)
    return made


def _fetch(machine: str, site: Path) -> None:
    fresh = site.with_name("site.new")
    platforms = [f"manylinux{name}_{machine}" for name in ("_2_28", "_2_17", "2014")]
    words = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    words += ["--no-compile", "--only-binary", ":all:", "--python-version", PYTHON]
    words += [word for platform in platforms for word in ("--platform", platform)]
    shutil.rmtree(fresh, ignore_errors=True)
    done = subprocess.run([*words, "--target", str(fresh), *NEEDED], stderr=subprocess.DEVNULL)
    if done.returncode:
        raise Unusable(f"pip could not fetch {', '.join(NEEDED)} for {machine}")
    fresh.rename(site)
