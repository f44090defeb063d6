"""The error text and exit code for a file that cannot be written on a user's request."""

import errno
import os
import sys
from pathlib import Path


def no_folder(path: Path) -> str:
    """Return the reason why the path's folder forbids writing; "" if it permits it."""
    if not path.parent.is_dir():
        return os.strerror(errno.ENOENT)
    return "" if os.access(path.parent, os.W_OK | os.X_OK) else os.strerror(errno.EACCES)


def not_written(path: Path | str, why: str | None) -> int:
    """Print the error, after flushing stdout: both often go to one log. Return EX_CANTCREAT."""
    sys.stdout.flush()
    print(f"{path} cannot be written: {why}", file=sys.stderr)
    return os.EX_CANTCREAT
