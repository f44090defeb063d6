"""Waiting for what happens outside this thread: in a real process, on a real socket, on DDS."""

import re
import threading
import time
from collections.abc import Callable
from typing import TypeVar

from drivers import DriverError

T = TypeVar("T")

PATIENCE_S = 120.0
"""Long enough for a very busy machine; a test that passes never waits for it."""

TOO_LATE = re.compile(
    r" within [\d.]+ s\b|what came first is not the echo|echo came late|is half a frame"
    r"|is not a frame: a collision"
)
"""What a bus says of an answer that is late, or that meets the next one on a serial line."""

LEASE_S = 9.5
"""Less than DDS takes to miss who has gone without a farewell (10 s)."""


def wait_until(condition: Callable[[], object], what: str, patience_s: float = PATIENCE_S) -> None:
    """Look again and again until the condition holds; fail by name when it never does.

    The longer it has taken, the longer the pause before the next look: a look costs CPU, which what is
    waited for needs.
    """
    pause = threading.Event()
    began = time.monotonic()
    while not condition():
        waited = time.monotonic() - began
        assert waited < patience_s, f"never happened: {what}"
        pause.wait(min(0.003 + waited / 16, 0.05))


def at_last(step: Callable[[], T], what: str, between: Callable[[], object] = lambda: None) -> T:
    """What a step on a wire gives; tried again when an answer comes late, as on a busy machine.

    `between`: done before it is tried again. Every other DriverError is raised.
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
