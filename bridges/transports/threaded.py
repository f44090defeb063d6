"""The common base of the transports `dds`, `zenoh` and `ros2`. Each of them has a thread."""

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
"""The period (s) of checks for changed addresses of the machine. The libraries do not make such checks.
A library that starts when only `lo` is up stays on `lo` for ever, and no library notices a changed
address."""
SET_BACK_S: Final = 1.0
"""The largest step back (s) that does no harm. Cyclone renews a lease of 10 s every 8 s."""


class WallClock:
    """A clock watch that notices when the wall clock is set back, because Cyclone DDS waits by the wall
    clock.

    Cyclone 0.10.5 (ROS 2 Jazzy) always does (github.com/eclipse-cyclonedds/cyclonedds, issue 1995).
    Cyclone 11.0.1 does in the wheel on PyPI, built without pthread_condattr_setclock. When the clock is
    set back, Cyclone's threads sleep longer by the size of the step. During this sleep a node renews no
    lease, and other nodes forget it after 10 s. The node also answers no new node, and does not ask for
    lost samples again. A node that joins later waits by the new time. A step forward wakes the threads
    early, which does no harm.

    `ahead_s`, in all functions of this file: the wall clock minus a clock that never steps (s).
    """

    def __init__(self, ahead_s: float) -> None:
        self._most_s = ahead_s

    def set_back_s(self, ahead_s: float) -> float:
        """Return how far (s) the clock was set back; 0 for a step of SET_BACK_S or less.

        Small steps add up until they exceed SET_BACK_S, because several steps may come during one sleep
        of a thread.
        """
        self._most_s = max(self._most_s, ahead_s)
        back_s = self._most_s - ahead_s
        if back_s <= SET_BACK_S:
            return 0.0
        self._most_s = ahead_s
        return back_s


def ahead_s() -> float:
    """Return the wall clock minus the time since the machine's start (s). This time includes the
    machine's sleep."""
    return time.time() - time.clock_gettime(time.CLOCK_BOOTTIME)


class Threaded:
    """A node on the graph with one thread. On DDS a second thread watches the clock.

    `refusals`: the library's exceptions. `release`: None to follow RMF's release.
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
        """The release of RMF's messages that the node speaks at present."""
        return self._peers.release

    def faults(self) -> list[tuple[str, str]]:
        """Return (code, detail) of each present fault that keeps nodes from hearing each other. Any
        thread may call this."""
        return self._peers.faults()

    def sender(self) -> Sender | None:
        """Return the publisher of the message that a callback receives now. Return None if the wire
        does not tell, as with rclpy (Jazzy)."""
        return self._senders.now()

    @property
    def lives(self) -> bool:
        """Does the transport's thread run? The answer is True even without a network, a router or a
        peer."""
        return not self._closed and self._thread.is_alive()

    def wall(self) -> float:
        """Return the wall clock's time (s since the epoch)."""
        return time.time()

    def _start(self, run: Callable[[], None], wire: str) -> None:
        self._thread = threading.Thread(target=run, name=f"{self.name}-{wire}", daemon=True)
        self._thread.start()

    def _watch_clock(self) -> None:
        """Start a thread that watches the wall clock. When the clock is set back, the thread sets
        `_set_back` and wakes our thread.

        Our thread cannot watch the clock, because our thread may itself wait by the wall clock.
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
        """If the node has joined, end the wait of our thread. The caller holds the lock."""

    def _look_is_due(self) -> bool:
        """Is it time to look at the network again? If so, the call also plans the next look."""
        now = time.monotonic()
        if now < self._look_at:
            return False
        self._look_at = now + LOOK_EVERY_S
        return True

    def _network_changed(self) -> bool:
        """Have the machine's addresses changed since the node joined? If so, the call logs the new
        addresses."""
        found = addresses.addresses()
        if found == self._addresses:
            return False
        self._addresses = found
        log.info(pairs("network", addresses=" ".join(sorted(a for _, a in found)) or "none"))
        return True

    def _join_thread(self) -> None:
        """Wait for the end of the threads. The calling thread does not wait for itself."""
        if self._clock_thread is not None:
            self._clock_thread.join()
        if threading.current_thread() is not self._thread:
            self._thread.join()

    @contextmanager
    def _reporting(self, text: str) -> Iterator[None]:
        """Raise the library's exceptions as TransportError. `text` names the failure."""
        if self._closed:
            raise TransportError(f"{text}: {self.name} has left the graph")
        try:
            yield
        except self.refusals as error:
            raise TransportError(f"{text}: {error}") from error
