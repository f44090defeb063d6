"""The kinds of bridges: each has a folder with its pure rules, which this file finds.

A kind is found by its name in a YAML. Only existing folders are imported: there is no table to
edit, and no other file imports a kind by its name.
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
    """List the values of `kind:`: the folders here that hold a `KIND`."""
    return holding(__path__, "*/__init__.py", "KIND", lambda path: path.parent.name)


def holding(
    roots: Iterable[str], pattern: str, record: str, name: Callable[[Path], str]
) -> list[str]:
    """List the names of the files in these folders that define `record`; `name` maps path to name."""
    return sorted({name(path) for path in _files(tuple(roots), pattern, record)})


@cache
def _files(roots: tuple[str, ...], pattern: str, record: str) -> list[Path]:
    """Find the files that define `record`. They are read once as text and not imported, because some
    need a vendor's library."""
    found = (path for root in roots for path in Path(root).glob(pattern))
    holds = re.compile(rf"^{record}(:| =)", re.MULTILINE).search
    return [path for path in found if holds(path.read_text("utf-8"))]


def kind_called(name: str) -> "AnyKind":
    """Return the kind with this name, which is in `kind_names()`."""
    kind: AnyKind = _package(name).KIND
    return kind


def recorded(kind: str) -> "Recorded":
    """Return the recorded names of a kind's values; empty if it uses the values of another kind."""
    found: Recorded = getattr(_package(kind), "RECORDED", {})
    return found


def _package(kind: str) -> ModuleType:
    return importlib.import_module(f"{__name__}.{kind}")
