"""Opens and closes zenoh sessions."""

import ctypes
import json
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import zenoh

from bridges.transports.zenoh.config import Configuration


@contextmanager
def contained() -> Iterator[None]:
    """Raise a panic of zenoh in the block as ZError. A panic is no Exception, and would end the daemon.
    Every call into zenoh needs this block."""
    try:
        yield
    except BaseException as error:
        if (
            type(error).__name__ != "PanicException"
        ):  # pyo3 owns the class, which cannot be imported
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
    with suppress(zenoh.ZError), contained():  # a dead link does not take the closing message
        session.close()  # type: ignore[no-untyped-call]
    held.clear()


def trim_memory() -> None:
    """Return freed memory to the system. This is 2.5 MB after a session has opened."""
    with suppress(AttributeError):  # only glibc has this call
        ctypes.CDLL(None).malloc_trim(0)
