"""The common base of the transports `dds`, `zenoh` and `ros2`. Each transport has a thread."""

import logging
import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import ClassVar, Final

from bridges.messages.heard import Sender
from bridges.messages.releases import Release
from bridges.system.log import pairs
from bridges.transports import addresses
from bridges.transports.peers import Peers
from bridges.transports.senders import Senders
from bridges.transports.transport import TransportError

log = logging.getLogger(__name__)

LOOK_EVERY_S: Final = 1.0
"""The interval (s) at which a transport checks the machine's addresses, because the libraries do not
check them. A library that starts when only `lo` is up stays on `lo` for ever. No library notices a
changed address."""
SET_BACK_S: Final = 1.0
"""The largest step back (s) of the clock that does no harm. Cyclone renews a lease of 10 s every 8 s,
so it may be up to 2 s late."""


class WallClock:
    """A watch that notices when the wall clock is set back. Cyclone DDS needs it, because its threads
    measure their waiting time by the wall clock.

    Cyclone 0.10.5 (ROS 2 Jazzy) always waits by the wall clock
    (github.com/eclipse-cyclonedds/cyclonedds, issue 1995). Cyclone 11.0.1 also waits by the wall clock
    in the wheel on PyPI, which is built without pthread_condattr_setclock.

    When the clock is set back, Cyclone's threads sleep longer by the size of the step. During this
    sleep a node renews no lease, and other nodes forget the node after 10 s. The node does not answer
    new nodes. It does not ask again for lost samples. A node that joins after the step has no such
    delay.

    A step forward wakes the threads early, which does no harm.

    `ahead_s`, in all functions of this file: the wall clock minus a clock that never steps (s).
    """

    def __init__(self, ahead_s: float) -> None:
        self._most_s = ahead_s

    def set_back_s(self, ahead_s: float) -> float:
        """Return by how much (s) the clock was set back. Return 0 for a step of SET_BACK_S or less.

        Several small steps count as one step, because they may all come while a thread sleeps.
        """
        self._most_s = max(self._most_s, ahead_s)
        back_s = self._most_s - ahead_s
        if back_s <= SET_BACK_S:
            return 0.0
        self._most_s = ahead_s
        return back_s


def ahead_s() -> float:
    """Return the wall clock minus the time since the machine's start (s). That time includes the time
    in which the machine was suspended."""
    return time.time() - time.clock_gettime(time.CLOCK_BOOTTIME)


class Threaded:
    """A node on the ROS graph with one thread. On DDS a second thread watches the clock.

    `refusals`: the exceptions of the transport's library. `release`: the RMF release whose messages the
    node uses, or None to use the release of RMF's own nodes.
    """

    refusals: ClassVar[tuple[type[Exception], ...]]

    def __init__(self, node_name: str, domain_id: int, release: Release | None = None) -> None:
        self.name = node_name
        self.domain_id = domain_id
        self._peers = Peers(release)
        self._senders = Senders()
        self.dropped: dict[str, int] = {}
        self._lock = threading.Lock()
        self._closed = False
        self._stop = threading.Event()
        self._clock_thread: threading.Thread | None = None
        self._wall_clock = WallClock(ahead_s())
        self._set_back = False
        self._look_at = -math.inf
        self._addresses: addresses.Addresses = frozenset()

    @property
    def release(self) -> Release:
        """The RMF release whose messages the node uses now."""
        return self._peers.release

    def faults(self) -> list[tuple[str, str]]:
        """Return the code and the detail of each present fault that keeps nodes from hearing each
        other. Any thread may call this method."""
        return self._peers.faults()

    def sender(self) -> Sender | None:
        """Return the publisher of the message that a callback now receives. Return None if the protocol
        does not name the publisher, as with rclpy (Jazzy)."""
        return self._senders.now()

    @property
    def lives(self) -> bool:
        """Return whether the transport's thread runs. It runs even without a network, a router or a
        peer."""
        return not self._closed and self._thread.is_alive()

    def wall(self) -> float:
        """Return the wall clock's time (s since the epoch)."""
        return time.time()

    def _start(self, run: Callable[[], None], wire: str) -> None:
        self._thread = threading.Thread(target=run, name=f"{self.name}-{wire}", daemon=True)
        self._thread.start()

    def _watch_clock(self) -> None:
        """Start a thread that watches the wall clock. When the clock is set back, this thread sets
        `_set_back` and wakes the transport's thread.

        The transport's thread cannot watch the clock itself. It may be waiting, and the step makes this
        wait longer.
        """
        run, name = self._look_at_clock, f"{self.name}-clock"
        self._clock_thread = threading.Thread(target=run, name=name, daemon=True)
        self._clock_thread.start()

    def _look_at_clock(self) -> None:
        while not self._stop.wait(LOOK_EVERY_S):
            if back_s := self._wall_clock.set_back_s(ahead_s()):
                log.info(pairs("clock_set_back", node=self.name, by_s=round(back_s, 1)))
                with self._lock:
                    self._set_back = True
                    self._wake()

    def _wake(self) -> None:
        """Wake the transport's thread, if the node has joined. The caller holds the lock."""

    def _look_is_due(self) -> bool:
        """Return whether LOOK_EVERY_S has passed since the last check of the network. If so, count this
        call as the new check."""
        now = time.monotonic()
        if now < self._look_at:
            return False
        self._look_at = now + LOOK_EVERY_S
        return True

    def _network_changed(self) -> bool:
        """Return whether the machine's addresses have changed since the last check. If so, log the new
        addresses."""
        found = addresses.addresses()
        if found == self._addresses:
            return False
        self._addresses = found
        log.info(pairs("network", addresses=" ".join(sorted(a for _, a in found)) or "none"))
        return True

    def _join_thread(self) -> None:
        """Wait for the end of the threads. A thread does not wait for itself."""
        if self._clock_thread is not None:
            self._clock_thread.join()
        if threading.current_thread() is not self._thread:
            self._thread.join()

    @contextmanager
    def _reporting(self, text: str) -> Iterator[None]:
        """Raise the library's exceptions as TransportError. `text` says what failed."""
        if self._closed:
            raise TransportError(f"{text}: {self.name} has left the graph")
        try:
            yield
        except self.refusals as error:
            raise TransportError(f"{text}: {error}") from error
