"""The last mark of a service: it says that every output was verified off.

`outputs-off` follows each end of a service, and has nothing to do after such a mark. The mark names the
one run of the service that it is about (INVOCATION_ID, systemd.exec(5)), so an old one says nothing;
one that is missing or cannot be read says nothing either.
"""

import os
from collections.abc import Mapping
from typing import Final

MARK: Final = "all-off"
LONGEST: Final = 64


def leave(environ: Mapping[str, str] = os.environ) -> None:
    """Leave the mark, if a unit of systemd started us. Raises OSError."""
    if path := _path(environ):
        mark = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, 0o640)
        try:
            os.write(mark, environ["INVOCATION_ID"].encode())
        finally:
            os.close(mark)


def says_off(environ: Mapping[str, str]) -> bool:
    """Whether this process follows a service that stopped well and left the mark."""
    path = _path(environ)
    if not path or environ.get("SERVICE_RESULT") != "success":
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


def _path(environ: Mapping[str, str]) -> str:
    """Where the mark of this run is; "" outside of a unit."""
    folder = environ.get("RUNTIME_DIRECTORY", "").split(":")[0]
    return os.path.join(folder, MARK) if folder and environ.get("INVOCATION_ID") else ""
