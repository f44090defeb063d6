"""Stores the texts of profiles and DBC files. This process has read each text itself, or has got it
from another process through `give`.

A daemon records these texts together with the outputs that it claims. `outputs-off` may run much later,
even after an upgrade that changed the files. With the recorded texts, `outputs-off` reads the same maps
as the daemon.

A file of drivers/profiles/ is stored under its name. Any other file is stored under its path.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).parent
_texts: dict[str, bytes] = {}


def text(file: Path, read: Callable[[], bytes]) -> bytes:
    """Return a file's stored text. If no text is stored, call `read` and store the result."""
    if _name(file) not in _texts:
        _texts[_name(file)] = read()
    return _texts[_name(file)]


def known(file: Path) -> bytes | None:
    """Return a file's stored text. Return None if no text is stored."""
    return _texts.get(_name(file))


def known_in(folder: Path) -> list[Path]:
    """Return the files of a folder that have a stored text."""
    return [file for name in _texts if (file := FOLDER / name).parent == folder]


def all_known() -> dict[str, bytes]:
    """Return the text of every stored file, by its name or path."""
    return dict(_texts)


def give(texts: Mapping[str, bytes]) -> None:
    """Replace all stored texts by `texts`. Later calls of `text` do not read these files from disk."""
    _texts.clear()
    _texts.update(texts)


def _name(file: Path) -> str:
    return file.name if file.parent == FOLDER else str(file)
