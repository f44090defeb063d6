"""A thread that runs rounds, one after the other, until it is stopped."""

import logging
import threading
import time
from collections.abc import Sequence
from typing import Any, Protocol

from bridges.host.log import pairs
from bridges.runtime.clock import Clock
from bridges.runtime.contained import LeftOn
from bridges.runtime.inbox import Inbox

log = logging.getLogger(__name__)

LEAST_GAP_S = 0.001
"""The least time between rounds that no event has caused."""


class Rounds(Protocol):
    """What is served in rounds: the devices of a bus, or a kind without hardware.

    Its thread is the only one that calls it, and tests call it without a thread, in their own time.
    """

    @property
    def name(self) -> str:
        """The thread's name."""

    @property
    def inbox(self) -> Inbox[Any]:
        """What wakes it before `wake_at`."""

    @property
    def wake_at(self) -> float:
        """When the next round is due if no event comes (monotonic s)."""

    @property
    def finished(self) -> int:
        """How many steps it has finished; counts within a round too."""

    @property
    def ready(self) -> bool:
        """Whether it is in service."""

    def round(self) -> None:
        """Take the waiting events, and do what is due."""

    def end(self) -> bool:
        """Outputs off, and everything released. False if that could not be verified."""


def stop(loops: Sequence["Serving"], within_s: float) -> bool:
    """End all at once, so that none waits for another; False if one does not end, or not safely."""
    for loop in loops:
        loop.close()
    deadline = time.monotonic() + within_s
    ended = [loop.ended(max(0.0, deadline - time.monotonic())) for loop in loops]
    return all(ended)


class Serving:
    """One thread of a service, as the daemon sees it. `died`: why it died; "" if it has not."""

    def __init__(self, serves: Rounds, clock: Clock) -> None:
        self._rounds = 0
        self._serves = serves
        self._clock = clock
        self._safe = False
        self.died = ""
        self._thread = threading.Thread(target=self._run, name=serves.name, daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self) -> None:
        """Ask for the end: after the current round, outputs off."""
        self._serves.inbox.close()

    def ended(self, timeout_s: float) -> bool:
        """Wait for the end; False if it does not come, or not safely."""
        if self._thread.ident is not None:  # else it was never started
            self._thread.join(timeout_s)
        return not self._thread.is_alive() and self._safe

    @property
    def alive(self) -> bool:
        """False when it serves no more: stopped, or, even if it still switches off, by a defect."""
        return self._thread.is_alive() and not self.died

    @property
    def finished(self) -> int:
        """Grows as long as it gets on with its work."""
        return self._rounds + self._serves.finished

    @property
    def ready(self) -> bool:
        """Has it finished its first round, and is it in service?"""
        return self._rounds > 0 and self._serves.ready

    def _run(self) -> None:
        serves = self._serves
        try:
            while not serves.inbox.closed:
                wait_s = serves.wake_at - self._clock.monotonic()
                serves.inbox.wait(max(wait_s, LEAST_GAP_S))
                serves.round()
                self._rounds += 1
        except LeftOn as error:
            self.died = f"{serves.name}: {error}"
            log.critical(pairs("died", thread=serves.name, reason=error))
        except Exception as error:  # a defect of ours: the daemon ends, and is started again
            self.died = f"{serves.name}: {type(error).__name__}: {error}"
            log.critical(pairs("died", thread=serves.name, reason=error), exc_info=True)
        finally:
            self._safe = serves.end()
