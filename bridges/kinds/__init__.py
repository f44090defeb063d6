"""The kinds of devices. Each kind has a folder with its rules, and this file finds the folders.

A device YAML names its kind, for example `kind: lift`. An installation may lack a kind's folder.
Therefore no table lists the kinds, and no other file imports a kind by its name.
"""

import importlib
import re
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bridges.kinds.shared.graph_kind import AnyKind
    from bridges.kinds.shared.recorded import Recorded


def kind_names() -> list[str]:
    """List the values that `kind:` may have. They are the names of the folders whose `__init__.py`
    defines `KIND`."""
    return holding(__path__, "*/__init__.py", "KIND", lambda path: path.parent.name)


def holding(
    roots: Iterable[str], pattern: str, record: str, name: Callable[[Path], str]
) -> list[str]:
    """List the names of the files that match `pattern` below `roots` and define `record`. The function
    `name` turns the path of a file into the listed name."""
    return sorted({name(path) for path in _files(tuple(roots), pattern, record)})


@cache
def _files(roots: tuple[str, ...], pattern: str, record: str) -> list[Path]:
    """Find the files that define `record`. The files are read as text and not imported, because some of
    them need a vendor's library."""
    found = (path for root in roots for path in Path(root).glob(pattern))
    holds = re.compile(rf"^{record}(:| =)", re.MULTILINE).search
    return [path for path in found if holds(path.read_text("utf-8"))]


def kind_called(name: str) -> "AnyKind":
    """Return the kind with this name, which is in `kind_names()`."""
    kind: AnyKind = _package(name).KIND
    return kind


def recorded(kind: str) -> "Recorded":
    """Return a table that maps recorded names to the types of this kind. The table is empty for a kind
    that uses only another kind's types."""
    found: Recorded = getattr(_package(kind), "RECORDED", {})
    return found


def _package(kind: str) -> ModuleType:
    return importlib.import_module(f"{__name__}.{kind}")
