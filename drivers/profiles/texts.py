"""The texts of profiles and DBC files, as this process has read them or was given them.

A daemon writes down what it claims together with these texts. `outputs-off`, much later and perhaps
after an upgrade, is given them, and so finds what the dead daemon meant, whatever now has the name.

A file of drivers/profiles/ goes by its name, any other by its path.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).parent
_texts: dict[str, bytes] = {}


def text(file: Path, read: Callable[[], bytes]) -> bytes:
    """A file's text: as it is known, else as `read` finds it, and from then on known."""
    if _name(file) not in _texts:
        _texts[_name(file)] = read()
    return _texts[_name(file)]


def known(file: Path) -> bytes | None:
    """A file's text, if it is known."""
    return _texts.get(_name(file))


def known_in(folder: Path) -> list[Path]:
    """The files of a folder whose texts are known."""
    return [file for name in _texts if (file := FOLDER / name).parent == folder]


def all_known() -> dict[str, bytes]:
    """Name -> text of every one that was read or given."""
    return dict(_texts)


def give(texts: Mapping[str, bytes]) -> None:
    """Know these and no others; the disk is not looked at for them."""
    _texts.clear()
    _texts.update(texts)


def _name(file: Path) -> str:
    return file.name if file.parent == FOLDER else str(file)
