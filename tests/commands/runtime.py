"""A runtime directory as a daemon that serves has it."""

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def served(folder: Path, told: object) -> Iterator[Path]:
    """A runtime directory whose lock a daemon holds."""
    folder.mkdir()
    (folder / "status.json").write_text(json.dumps(told))
    lock = os.open(folder / "lock", os.O_RDWR | os.O_CREAT)
    os.write(lock, json.dumps({"pid": 4711, "file": "x", "serves": True}).encode())
    fcntl.flock(lock, fcntl.LOCK_EX)
    try:
        yield folder
    finally:
        os.close(lock)
