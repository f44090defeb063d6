"""Waits for events outside this thread. Such an event occurs in a process, on a socket or on DDS."""

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
    r"|is not a frame: a collision|has come on .+ since the connection began"
)
"""Error texts of a bus whose answer or first message came late, or of a serial line on which two
answers collided."""

LEASE_S = 9.5
"""A wait (s) slightly shorter than the lease, which is 10 s. After the lease, DDS removes a node that
has ended without saying so. A node that leaves the graph properly is gone before this wait ends."""


def wait_until(condition: Callable[[], object], what: str, patience_s: float = PATIENCE_S) -> None:
    """Check the condition again and again until it holds. If it never holds, fail, and name `what`.

    The pauses grow with the time waited, because each check costs CPU time that the awaited process
    needs.
    """
    pause = threading.Event()
    began = time.monotonic()
    while not condition():
        waited = time.monotonic() - began
        assert waited < patience_s, f"never happened: {what}"
        pause.wait(min(0.003 + waited / 16, 0.05))


def at_last(step: Callable[[], T], what: str, between: Callable[[], object] = lambda: None) -> T:
    """Return the result of `step`, which uses a wire. If the wire's answer came late, repeat the step.
    On a busy machine, answers may come late.

    `between` runs before each repetition. Any other DriverError is raised at once.
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
