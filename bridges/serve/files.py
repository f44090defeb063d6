"""Files that are replaced as a whole, so that a reader sees either the old or the new one."""

import os
from pathlib import Path


def replace(path: Path, content: bytes) -> None:
    """Replace a file and sync it and its folder to disk; makes the folder if needed.

    Raises OSError, and then the old file remains.
    """
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    new = path.with_name(f".{path.name}.new")
    with new.open("wb") as out:
        out.write(content)
        out.flush()
        os.fsync(out.fileno())
    new.replace(path)
    _sync(path.parent)


def show(path: Path, content: bytes) -> None:
    """Replace a file that need not survive a reboot. Raises OSError."""
    new = path.with_name(f".{path.name}.new")
    new.write_bytes(content)
    new.replace(path)


def _sync(folder: Path) -> None:
    opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)
