"""The kinds of bridges. Each kind has a folder with its pure rules, and this file finds the folders.

A YAML names its kind. Only folders that exist are imported: there is no table to edit, and no other
file imports a kind by its name.
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
    """List the values that `kind:` may have: the folders here whose `__init__.py` defines a `KIND`."""
    return holding(__path__, "*/__init__.py", "KIND", lambda path: path.parent.name)


def holding(
    roots: Iterable[str], pattern: str, record: str, name: Callable[[Path], str]
) -> list[str]:
    """List the names of the files in these folders that define `record`; `name` makes a name of a
    path."""
    return sorted({name(path) for path in _files(tuple(roots), pattern, record)})


@cache
def _files(roots: tuple[str, ...], pattern: str, record: str) -> list[Path]:
    """Find the files that define `record`. This reads the files as text once, because importing some of
    them needs a vendor's library."""
    found = (path for root in roots for path in Path(root).glob(pattern))
    holds = re.compile(rf"^{record}(:| =)", re.MULTILINE).search
    return [path for path in found if holds(path.read_text("utf-8"))]


def kind_called(name: str) -> "AnyKind":
    """Return the kind with this name, which is in `kind_names()`."""
    kind: AnyKind = _package(name).KIND
    return kind


def recorded(kind: str) -> "Recorded":
    """Return the recorded names of a kind's values. A kind that uses another kind's values has none."""
    found: Recorded = getattr(_package(kind), "RECORDED", {})
    return found


def _package(kind: str) -> ModuleType:
    return importlib.import_module(f"{__name__}.{kind}")
