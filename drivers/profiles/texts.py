"""The texts of profiles and DBC files: those that this process has read, or was given.

A daemon records these texts together with its claims. `outputs-off` may run much later, even after an
upgrade that changed the files; it gets the recorded texts and so reads the maps as the daemon did.

A file of drivers/profiles/ is stored under its name, any other under its path.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).parent
_texts: dict[str, bytes] = {}


def text(file: Path, read: Callable[[], bytes]) -> bytes:
    """A file's text: the stored one, or what `read` returns, which is then stored."""
    if _name(file) not in _texts:
        _texts[_name(file)] = read()
    return _texts[_name(file)]


def known(file: Path) -> bytes | None:
    """A file's stored text, or None."""
    return _texts.get(_name(file))


def known_in(folder: Path) -> list[Path]:
    """The files of a folder whose texts are stored."""
    return [file for name in _texts if (file := FOLDER / name).parent == folder]


def all_known() -> dict[str, bytes]:
    """Name -> text of every stored file."""
    return dict(_texts)


def give(texts: Mapping[str, bytes]) -> None:
    """Replace the stored texts by these; they are not read from disk again."""
    _texts.clear()
    _texts.update(texts)


def _name(file: Path) -> str:
    return file.name if file.parent == FOLDER else str(file)
