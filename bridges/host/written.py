"""A file that a user wants written: why it cannot be, in one text and with one exit code."""

import errno
import os
import sys
from pathlib import Path


def no_folder(path: Path) -> str:
    """Why nothing can be written there, as far as its folder shows; "" if it can."""
    if not path.parent.is_dir():
        return os.strerror(errno.ENOENT)
    return "" if os.access(path.parent, os.W_OK | os.X_OK) else os.strerror(errno.EACCES)


def not_written(path: Path | str, why: str | None) -> int:
    """Say so, after what was printed: the two often end in one log. Returns EX_CANTCREAT."""
    sys.stdout.flush()
    print(f"{path} cannot be written: {why}", file=sys.stderr)
    return os.EX_CANTCREAT
