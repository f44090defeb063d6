"""The page's node on the graph. The node only listens. After the graph is lost, the node joins
again."""

import logging
import threading
import time
from collections.abc import Callable
from contextlib import closing
from functools import partial
from queue import Empty, Full, Queue
from typing import Final

from bridges.messages.definitions import Message
from bridges.messages.heard import Heard, Sender, bounded
from bridges.messages.topics import AnyTopic
from bridges.system.log import pairs
from bridges.transports.transport import Transport, TransportError
from workbench.graph.live import require_life, subscribed
from workbench.page.live_site import HEARD, LiveSite

log = logging.getLogger(__name__)

WAITING: Final = 20_000
"""Maximum number of messages that wait for the next turn. The listener drops and counts further
messages. Only a flood brings so many."""
LONGEST_TURN_S: Final = 0.05
"""Maximum time (s) in which one call of `turn` takes messages. Even during a flood, the browsers must
not wait longer."""
AGAIN_S: Final = 3.0


class Listener:
    """A thread that joins RMF's graph and passes its messages to the page's `site`."""

    def __init__(self, site: LiveSite, join: Callable[[], Transport]) -> None:
        self._site = site
        self._join = join
        self._queue: Queue[Heard] = Queue(WAITING)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._listen, name="graph", daemon=True)
        self.lost = 0
        self.cut = 0
        self.domain_id: int | None = None
        self.trouble = "has not joined RMF's graph yet"

    def start(self) -> None:
        """Join the graph in the background."""
        self._thread.start()

    def end(self) -> None:
        """Leave the graph."""
        self._ended.set()
        self._thread.join(timeout=5.0)

    def hear(self, heard: Heard) -> None:
        """Keep a message until the next turn. Any thread may call this method."""
        try:
            self._queue.put_nowait(heard)
        except Full:
            self.lost += 1

    def turn(self) -> bool:
        """Take the waiting messages, on the caller's thread. Return whether there were any."""
        any_heard = False
        until = time.monotonic() + LONGEST_TURN_S
        while time.monotonic() < until:
            try:
                heard = self._queue.get_nowait()
            except Empty:
                break
            self._site.take(heard)
            any_heard = True
        return any_heard

    def _listen(self) -> None:
        while not self._ended.is_set():
            try:
                with closing(self._join()) as transport:
                    subscribed(transport, HEARD, partial(self._receive, transport.sender))
                    self.domain_id, self.trouble = transport.domain_id, ""
                    self._stay(transport)
            except TransportError as error:
                if not self.trouble.endswith(str(error)):
                    log.error(pairs("graph_lost", reason=error))
                self.trouble = f"cannot join RMF's graph: {error}"
                self._ended.wait(AGAIN_S)

    def _stay(self, transport: Transport) -> None:
        while not self._ended.wait(1.0):
            require_life(transport)
            if found := transport.faults():
                self.trouble = "; ".join(f"{code}: {detail}" for code, detail in found)
            else:
                self.trouble = ""

    def _receive(
        self, sender: Callable[[], Sender | None], topic: AnyTopic
    ) -> Callable[[Message], None]:
        def receive(message: Message) -> None:
            kept = bounded(message)
            self.cut += kept is not message
            self.hear(Heard(time.monotonic(), time.time(), topic.name, kept, sender()))

        return receive
