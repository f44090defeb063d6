"""Imports the optional packages: the workbench, the hardware fakes, and the library for the web page.
No daemon needs these packages. `bridges` imports them only through this module.

Each version of an optional Debian package has its own folder. The folder of the daemons has a `.pth`
file, which names the package folder of the same version (deb/scripts/rmf-bridges.postinst). With pip,
one distribution contains all packages.
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
    """Return whether `workbench` or `hal_fakes` is installed in the same version as the daemons."""
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
        return f"in the git clone of rmf-bridges run .venv/bin/pip install {wanted}"
    command = f"sudo apt install ./{package}_{place.name}_*.deb"
    for other in sorted(place.parent.glob("[0-9]*")):
        if other != place:
            return (
                f"{package} is {other.name}, and these daemons are {place.name}: both must be the same"
                " version. If an upgrade was refused, run sudo dpkg --configure -a; otherwise run"
                f" {command}"
            )
    return command
