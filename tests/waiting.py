"""Waiting for what happens outside this thread: in a real process, on a real socket, on DDS."""

import threading
import time
from collections.abc import Callable

PATIENCE_S = 120.0
"""Long enough for a very busy machine; a test that passes never waits for it."""

LEASE_S = 9.5
"""Less than DDS takes to miss who has gone without a farewell (10 s)."""


def wait_until(condition: Callable[[], object], what: str, patience_s: float = PATIENCE_S) -> None:
    """Look again and again until the condition holds; fail by name when it never does."""
    pause = threading.Event()
    deadline = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < deadline, f"never happened: {what}"
        pause.wait(0.005)
