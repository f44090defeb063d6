"""The workbench, the fakes and the page's library may not be installed: no daemon needs them, and
nothing of `bridges` imports them in any other way.

A Debian package of ours has one version in its folder, and the daemons' tree has a `.pth` that names
the folder of the tree's own version (deb/scripts/rmf-bridges.postinst). By pip it is one distribution.
"""

import importlib
import importlib.util
from pathlib import Path
from types import ModuleType

SITE = Path(__file__).parents[2]
"""Where `bridges` is installed."""


class NotInstalled(Exception):
    """It is not on this machine. The text says what to install."""


def is_there(package: str) -> bool:
    """Whether `workbench` or `hal_fakes` is installed, in the version of these daemons."""
    return importlib.util.find_spec(package) is not None


def of_workbench(name: str) -> ModuleType:
    """A module of `workbench` or `hal_fakes`, by its whole name. Raises NotInstalled."""
    if not is_there(name.partition(".")[0]):
        raise NotInstalled(f"not installed: {how_to_install('workbench')}")
    return importlib.import_module(name)


def how_to_install(part: str, site: Path = SITE) -> str:
    """What to do where the `workbench` or the `page` is missing."""
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
