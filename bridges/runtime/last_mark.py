"""Two marks, which are files that a service's run leaves for the process `outputs-off` that systemd
starts after it.

The mark `claimed` says that the run was about to claim outputs. `outputs-off` then switches these
outputs off, even if another process has the lock.

The mark `all-off` says that every output was verified off. `outputs-off` then has nothing to do.

A mark holds the INVOCATION_ID of its run (systemd.exec(5)). Marks of older runs and unreadable marks
are ignored.
"""

import os
from collections.abc import Mapping
from typing import Final

MARK: Final = "all-off"
CLAIMED: Final = "claimed"
LONGEST: Final = 64


def leave(environ: Mapping[str, str] = os.environ, name: str = MARK) -> None:
    """Write a mark, if a systemd unit started this process. Raises OSError."""
    if path := _path(environ, name):
        mark = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, 0o640)
        try:
            os.write(mark, environ["INVOCATION_ID"].encode())
        finally:
            os.close(mark)


def says_off(environ: Mapping[str, str]) -> bool:
    """Return whether the service's last run ended well and left the mark `all-off`."""
    return environ.get("SERVICE_RESULT") == "success" and _is_left(environ, MARK)


def says_claimed(environ: Mapping[str, str]) -> bool:
    """Return whether the service's last run left the mark `claimed`."""
    return bool(environ.get("SERVICE_RESULT")) and _is_left(environ, CLAIMED)


def _is_left(environ: Mapping[str, str], name: str) -> bool:
    path = _path(environ, name)
    if not path:
        return False
    try:
        mark = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return False
    try:
        return os.read(mark, LONGEST) == environ["INVOCATION_ID"].encode()
    except OSError:
        return False
    finally:
        os.close(mark)


def _path(environ: Mapping[str, str], name: str) -> str:
    """Return the path of this run's mark. Return "" outside of a unit."""
    folder = environ.get("RUNTIME_DIRECTORY", "").split(":")[0]
    return os.path.join(folder, name) if folder and environ.get("INVOCATION_ID") else ""
