"""A thread that runs one round after another until it is stopped."""

import logging
import threading
import time
from collections.abc import Sequence
from typing import Any, Protocol

from bridges.runtime.clock import Clock
from bridges.runtime.contained import LeftOn
from bridges.runtime.inbox import Inbox
from bridges.system.log import pairs

log = logging.getLogger(__name__)

LEAST_GAP_S = 0.001
"""The minimum time (s) to wait before a round, if no event has come."""


class Rounds(Protocol):
    """Work that is done in rounds. It is either the work of the devices on one bus, or the work of a
    kind without hardware.

    Only one thread calls the methods. Tests call the methods without such a thread, in virtual time.
    """

    @property
    def name(self) -> str:
        """The thread's name."""

    @property
    def inbox(self) -> Inbox[Any]:
        """The inbox. An event in it causes a round before `wake_at`."""

    @property
    def wake_at(self) -> float:
        """The time (monotonic s) of the next round if no event comes before."""

    @property
    def finished(self) -> int:
        """The number of finished steps. It may also grow during a round."""

    @property
    def ready(self) -> bool:
        """Return whether the devices, or the kind without hardware, can serve."""

    def round(self) -> None:
        """Take the waiting events, and do the work that is due."""

    def end(self) -> bool:
        """Switch the outputs off and release everything. Return False if an output is not verified
        off."""


def stop(loops: Sequence["Serving"], within_s: float) -> bool:
    """End all loops at the same time. Return False if a loop does not end within `within_s` (s), or
    leaves an output on."""
    for loop in loops:
        loop.close()
    deadline = time.monotonic() + within_s
    ended = [loop.ended(max(0.0, deadline - time.monotonic())) for loop in loops]
    return all(ended)


class Serving:
    """One thread of a service. `died`: the defect that ended the thread, or "" without a defect."""

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
        """Ask the thread to end. After the present round the thread switches the outputs off."""
        self._serves.inbox.close()

    def ended(self, timeout_s: float) -> bool:
        """Wait for the thread's end. Return False if it does not end within `timeout_s` (s), or leaves
        an output on."""
        if self._thread.ident is not None:  # otherwise the thread was never started
            self._thread.join(timeout_s)
        return not self._thread.is_alive() and self._safe

    @property
    def alive(self) -> bool:
        """Return whether the thread serves. Return False after a stop and after a defect, even if the
        thread is still switching outputs off."""
        return self._thread.is_alive() and not self.died

    @property
    def finished(self) -> int:
        """A number that grows while the thread makes progress."""
        return self._rounds + self._serves.finished

    @property
    def ready(self) -> bool:
        """Return whether the thread has finished its first round and its work is ready."""
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
        except Exception as error:  # our own defect: the daemon ends, and systemd restarts it
            self.died = f"{serves.name}: {type(error).__name__}: {error}"
            log.critical(pairs("died", thread=serves.name, reason=error), exc_info=True)
        finally:
            self._safe = serves.end()
