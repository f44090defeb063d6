"""Imports the optional packages: the workbench, the fakes and the page's library. No daemon needs these
packages. `bridges` imports them only through this module.

Each version of an optional Debian package has its own folder. The daemons' tree has a `.pth` file,
which names the folder of the tree's own version (deb/scripts/rmf-bridges.postinst). For pip, all
packages are one distribution.
"""

import importlib
import importlib.util
from pathlib import Path
from types import ModuleType

SITE = Path(__file__).parents[2]
"""The folder in which `bridges` is installed."""


class NotInstalled(Exception):
    """The error of an optional package that is not installed. The error's text says how to install
    it."""


def is_there(package: str) -> bool:
    """Return whether `workbench` or `hal_fakes` is installed in the daemons' version."""
    return importlib.util.find_spec(package) is not None


def of_workbench(name: str) -> ModuleType:
    """Import a module of `workbench` or `hal_fakes` by its full name. Raises NotInstalled."""
    if not is_there(name.partition(".")[0]):
        raise NotInstalled(f"not installed: {how_to_install('workbench')}")
    return importlib.import_module(name)


def how_to_install(part: str, site: Path = SITE) -> str:
    """Return an instruction that installs the missing `workbench` or `page`."""
    package = f"rmf-bridges-{part}"
    try:
        place = Path((site / f"{package}.pth").read_text().strip())
    except OSError:
        wanted = "." if part == "workbench" else f"'.[{part}]'"
        return f"in the clone, .venv/bin/pip install {wanted}"
    command = f"sudo apt install ./{package}_{place.name}_*.deb"
    for other in sorted(place.parent.glob("[0-9]*")):
        if other != place:
            return (
                f"{package} is {other.name}, and these daemons are {place.name}: both must be the same"
                f" version. After an upgrade that was refused: sudo dpkg --configure -a; else {command}"
            )
    return command
