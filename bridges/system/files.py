"""A daemon's own files. Each file is replaced as a whole. So a reader sees either the old file or the
new file."""

import os
import stat
from contextlib import suppress
from pathlib import Path


def replace(path: Path, content: bytes, like: os.stat_result | None = None) -> None:
    """Replace a file, and write the file and its folder to disk. Make the folder if it is missing.

    `like`: the owner, the group and the mode that the file has from its first byte. Without it they are
    those of any new file of this process.

    Raises OSError. In this case the old file is unchanged, and nothing else is left.
    """
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    new = path.with_name(f".{path.name}.new")
    try:
        with open(new if like is None else _made(new, like), "wb") as out:
            out.write(content)
            out.flush()
            os.fsync(out.fileno())
        new.replace(path)
    except OSError:
        with suppress(OSError):
            new.unlink()
        raise
    _sync(path.parent)


def _made(path: Path, like: os.stat_result) -> int:
    """Make a file with this owner, group and mode, and return its descriptor. Nobody else can read the
    file before. Raises OSError."""
    path.unlink(missing_ok=True)
    made = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    try:
        os.fchown(made, like.st_uid, like.st_gid)
        os.fchmod(made, stat.S_IMODE(like.st_mode))
    except OSError:
        os.close(made)
        raise
    return made


def show(path: Path, content: bytes) -> None:
    """Replace a file that need not survive a reboot. The file's group may read it. Raises OSError."""
    new = path.with_name(f".{path.name}.new")
    flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW | os.O_CLOEXEC
    with open(os.open(new, flags, 0o640), "wb") as out:
        out.write(content)
    new.replace(path)


def read(path: Path, longest: int) -> bytes:
    """Return the file's content, up to `longest` bytes. Raises OSError, also for a symbolic link.

    If the path is a FIFO, do not wait for data.
    """
    flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
    with open(os.open(path, flags), "rb") as source:
        return source.read(longest) or b""


def _sync(folder: Path) -> None:
    opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)
