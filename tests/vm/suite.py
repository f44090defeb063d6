"""Makes the folder of tests that run inside the virtual machine. The tests use the libraries of the
installed package."""

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

from tests.vm.image import Unusable

PYTHON: Final = "3.13"
"""The version of Python in Debian 13."""
NEEDED: Final = ("hypothesis", "pytest", "pytest-timeout", "trustme")


def suite(arch: str, root: Path, folder: Path) -> Path:
    """Return a folder with `tests`, the fakes, `config` and `pyproject.toml`. Its folder `site` holds
    the libraries of the tests.

    Raises Unusable.
    """
    made, site = folder / "suite", folder / "suite/site"
    for name in ("tests", "hal_fakes", "config"):
        shutil.rmtree(made / name, ignore_errors=True)
        shutil.copytree(root / name, made / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(root / "pyproject.toml", made)
    if not site.exists():
        _fetch(arch, root, site)
    return made


def _fetch(arch: str, root: Path, site: Path) -> None:
    """Fetch the libraries that only the tests need, with the script that fetches the package's
    libraries (deb/wheels.py). pip itself would choose libraries for the architecture of this
    machine."""
    fresh = site.with_name("site.new")
    shutil.rmtree(fresh, ignore_errors=True)
    words = ["--arch", arch, "--python", PYTHON, "--target", str(fresh)]
    for name in NEEDED:
        command = [sys.executable, str(root / "deb/wheels.py"), name, *words]
        if subprocess.run(command, stderr=subprocess.DEVNULL).returncode:
            raise Unusable(f"cannot fetch {name} for {arch}: {' '.join(command)}")
    fresh.rename(site)
