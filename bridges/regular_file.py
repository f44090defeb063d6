"""A file that a person has named, read whole: only a regular one, and no more than is wanted.

A FIFO or a device in its place would keep a daemon waiting for ever, or never end.
"""

import errno
import os
import stat
from typing import NamedTuple


class Held(NamedTuple):
    """What a file holds, and its mode."""

    content: bytes
    mode: int


def read(file: str | os.PathLike[str], longest: int) -> Held:
    """Its first `longest` + 1 bytes, so that one that is too long shows. Raises OSError."""
    descriptor = os.open(file, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with open(descriptor, "rb") as opened:
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(file))
        if not stat.S_ISREG(mode):
            raise OSError(errno.EINVAL, "it is no file but a pipe, a socket or a device", str(file))
        return Held(opened.read(longest + 1), mode)
