"""Opens and closes zenoh sessions."""

import ctypes
import json
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import zenoh

from bridges.transports.zenoh.config import Configuration


@contextmanager
def contained() -> Iterator[None]:
    """Turn a panic of zenoh inside the block into a ZError. A panic is not an Exception, so it would
    end the daemon. Therefore every call into zenoh needs this block."""
    try:
        yield
    except BaseException as error:
        if (
            type(error).__name__ != "PanicException"
        ):  # the class is inside pyo3 and cannot be imported
            raise
        raise zenoh.ZError(f"zenoh has panicked: {error}") from error


def opened(ways: list[Configuration]) -> zenoh.Session:
    """Open a session with the first configuration that works. Raises ZError if no configuration
    works."""
    wanted, *further = ways
    config = zenoh.Config()
    for key, value in wanted.items():
        config.insert_json5(key, json.dumps(value))
    try:
        with contained():
            return zenoh.open(config)
    except zenoh.ZError:
        if further:
            return opened(further)
        raise


def closed(session: zenoh.Session, held: list[object]) -> None:
    with suppress(zenoh.ZError), contained():  # closing fails if the link is dead
        session.close()  # type: ignore[no-untyped-call]
    held.clear()


def trim_memory() -> None:
    """Return freed memory to the system. After a session has opened, 2.5 MB are returned."""
    with suppress(AttributeError):  # only glibc has this call
        ctypes.CDLL(None).malloc_trim(0)
