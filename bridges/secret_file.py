"""A secret comes from a file that its daemon's user alone can read, never from a YAML."""

import re
from typing import Final

from bridges import regular_file

OTHERS: Final = 0o077
LONGEST: Final = 4096


class SecretError(Exception):
    """The file cannot be read, others can read it, or it does not hold one secret."""


def one_line(name: str, file: str, what: str) -> str:
    """The `what` (token, password) that stands in a file, on one line, in printable ASCII.

    `name`: the setting that names the file, for the SecretError that says what is wrong with it.
    """
    secret = content(name, file).strip()
    if not re.fullmatch(rb"[!-~]{1,%d}" % LONGEST, secret):
        raise SecretError(f"{name} {file} does not hold one {what} on one line")
    return secret.decode()


def content(name: str, file: str) -> bytes:
    """What a private file holds, up to a little more than the longest secret."""
    try:
        found, mode = regular_file.read(file, LONGEST)
    except OSError as error:
        raise SecretError(f"{name} {file} cannot be read: {error.strerror}") from None
    if mode & OTHERS:
        raise SecretError(f"{name} {file} is open to other users: chmod 600 {file}")
    return found
