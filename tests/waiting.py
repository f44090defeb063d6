"""Waits for events outside this thread: in a real process, on a real socket, on DDS."""

import re
import threading
import time
from collections.abc import Callable
from typing import TypeVar

from drivers import DriverError

T = TypeVar("T")

PATIENCE_S = 120.0
"""The longest wait (s), enough for a very busy machine. No passing test waits this long."""

TOO_LATE = re.compile(
    r" within [\d.]+ s\b|first bytes are not the echo|echo came late|is half a frame"
    r"|is not a frame: a collision"
)
"""A bus's words for a late answer, or for two answers that collide on a serial line."""

LEASE_S = 9.5
"""A wait (s) below the 10 s after which DDS notices that a node left without a farewell."""


def wait_until(condition: Callable[[], object], what: str, patience_s: float = PATIENCE_S) -> None:
    """Look repeatedly until the condition holds. If it never holds, fail with the name `what`.

    The pauses grow with the time waited, because each look costs CPU that the awaited process needs.
    """
    pause = threading.Event()
    began = time.monotonic()
    while not condition():
        waited = time.monotonic() - began
        assert waited < patience_s, f"never happened: {what}"
        pause.wait(min(0.003 + waited / 16, 0.05))


def at_last(step: Callable[[], T], what: str, between: Callable[[], object] = lambda: None) -> T:
    """Return the result of a step on a wire. Repeat the step on late answers, which busy machines give.

    `between` runs before each repetition. Any DriverError other than a late answer is raised.
    """
    done: list[T] = []

    def tried() -> bool:
        try:
            done.append(step())
        except DriverError as error:
            if not TOO_LATE.search(str(error)):
                raise
            between()
        return bool(done)

    wait_until(tried, what)
    return done[0]
