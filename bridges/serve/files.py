"""Files that are replaced whole, so that whoever reads sees the old one or the new."""

import os
from pathlib import Path


def replace(path: Path, content: bytes) -> None:
    """Put this file on the disk, its folder's entry too, before returning; the folder is made.

    Raises OSError, and then the old one stands.
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
    """Replace a file that need not outlive the machine's next start. Raises OSError."""
    new = path.with_name(f".{path.name}.new")
    new.write_bytes(content)
    new.replace(path)


def _sync(folder: Path) -> None:
    opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)
