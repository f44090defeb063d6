"""Files that a user names in a YAML or on the command line. Only regular files are read, and always as
a whole. A FIFO would block a daemon for ever, and a device file may never end.

Secrets have stricter rules. A secret comes from a file that only the daemon's user can read, and is
never in a YAML.
"""

import errno
import os
import re
import stat
from typing import Final, NamedTuple

OTHERS: Final = 0o077
LONGEST_SECRET: Final = 4096


class SecretError(Exception):
    """The error for the file of a secret. The file cannot be read, or other users can read it, or it
    does not hold one secret."""


class Content(NamedTuple):
    """A file's bytes and mode."""

    content: bytes
    mode: int


def read(file: str | os.PathLike[str], longest: int) -> Content:
    """Return up to `longest` + 1 bytes of a file. The extra byte shows that the file is too long.
    Raises OSError."""
    descriptor = os.open(file, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with open(descriptor, "rb") as opened:
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(file))
        if not stat.S_ISREG(mode):
            raise OSError(errno.EINVAL, "it is a pipe, a socket or a device, not a file", str(file))
        return Content(opened.read(longest + 1), mode)


def secret_line(name: str, file: str, what: str) -> str:
    """Return the secret in a file, which is one line of printable ASCII. Raises SecretError with a
    remedy.

    `name`: the setting that holds the file's path. `what`: `token` or `password`, for the error's text.
    """
    line = secret(name, file).strip()
    if not re.fullmatch(rb"[!-~]{1,%d}" % LONGEST_SECRET, line):
        raise SecretError(f"{name} {file} does not hold one {what} on one line")
    return line.decode()


def secret(name: str, file: str) -> bytes:
    """Return the content of a private file, up to LONGEST_SECRET + 1 bytes. Raises SecretError."""
    try:
        content, mode = read(file, LONGEST_SECRET)
    except OSError as error:
        raise SecretError(f"{name} {file} cannot be read: {error.strerror}") from None
    if mode & OTHERS:
        raise SecretError(f"{name} {file} is open to other users: chmod 600 {file}")
    return content
