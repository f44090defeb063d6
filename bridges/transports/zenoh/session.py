"""Opens and closes zenoh sessions."""

import ctypes
import json
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import zenoh

from bridges.transports.zenoh.config import Configuration


@contextmanager
def contained() -> Iterator[None]:
    """Raise zenoh's panics as ZError, for every call into zenoh: a panic is not an Exception, and would
    end the daemon."""
    try:
        yield
    except BaseException as error:
        if type(error).__name__ != "PanicException":  # pyo3's, which cannot be imported
            raise
        raise zenoh.ZError(f"zenoh has panicked: {error}") from error


def opened(ways: list[Configuration]) -> zenoh.Session:
    """Open a session with the first of these configurations that works. Raises ZError if none does."""
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
    with suppress(zenoh.ZError), contained():  # on a dead link the farewell is lost
        session.close()  # type: ignore[no-untyped-call]
    held.clear()


def trim_memory() -> None:
    """Return freed memory to the system: 2.5 MB after the opening of a session."""
    with suppress(AttributeError):  # a C library other than glibc has no such call
        ctypes.CDLL(None).malloc_trim(0)
