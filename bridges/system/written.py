"""The error text and the exit code for an output file that cannot be written."""

import errno
import os
import sys
from pathlib import Path


def no_folder(path: Path) -> str:
    """Return the reason why no file can be made in the path's folder. Return "" without such a
    reason."""
    if not path.parent.is_dir():
        return os.strerror(errno.ENOENT)
    return "" if os.access(path.parent, os.W_OK | os.X_OK) else os.strerror(errno.EACCES)


def not_written(path: Path | str, why: str | None) -> int:
    """Print the error to stderr, and return EX_CANTCREAT.

    Flush stdout first. Both streams often go to one log, whose lines must be in order.
    """
    sys.stdout.flush()
    print(f"{path} cannot be written: {why}", file=sys.stderr)
    return os.EX_CANTCREAT
