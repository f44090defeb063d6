"""The runtime directory of a daemon in service."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec

from bridges.runtime.holder import HOLDER, ourselves


@contextmanager
def served(folder: Path, told: object) -> Iterator[Path]:
    """Yield the runtime directory of a live daemon.

    After the block the daemon is dead, and another process has its process id.
    """
    folder.mkdir()
    (folder / "status.json").write_text(json.dumps(told))
    name = ourselves(Path("x"), serves=True)
    (folder / HOLDER).write_bytes(msgspec.json.encode(name))
    try:
        yield folder
    finally:
        dead = msgspec.structs.replace(name, started=1)
        (folder / HOLDER).write_bytes(msgspec.json.encode(dead))
