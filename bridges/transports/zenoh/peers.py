"""What the ends on a zenoh graph announce, by their tokens.

Each end of ours watches the tokens on its own topic (`place.py`). Those that show RMF's release
are watched here, whatever our topics are.
"""

import logging
import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Final

import zenoh
from zenoh.handlers import Callback

from bridges.host.log import pairs
from bridges.transports.peers import Announced, Peers
from bridges.transports.zenoh.keys import Keys, Peer

log = logging.getLogger(__name__)

MOST: Final = 1000
"""More ends than any site has on one topic."""

Order = Callable[[], None]
"""Work for the transport's thread."""


class Merged:
    """An order that waits for the transport's thread once at most, however often it is given."""

    def __init__(self, do: Callable[[Order], None], order: Order) -> None:
        self._do, self._order = do, order
        self._waits = False

    def __call__(self) -> None:
        """Give it, on any thread."""
        if not self._waits:
            self._waits = True
            self._do(self._run)

    def _run(self) -> None:
        self._waits = False
        self._order()


class Tokens:
    """The tokens that match some key expressions, while the session is open or until `leave`.

    `came(token, peer)`, `gone(token)`: called on zenoh's thread. No more than MOST tokens are kept:
    further ones are left out, which is logged once. When half of them have gone, all are asked for
    again, so that after a flood nobody is missing. `do(order)`: runs it on the transport's thread.
    """

    def __init__(
        self,
        session: zenoh.Session,
        keys: Keys,
        expressions: Iterable[str],
        came: Callable[[str, Peer], None],
        gone: Callable[[str], None],
        do: Callable[[Order], None],
    ) -> None:
        self._live, self._keys, self._expressions = session.liveliness(), keys, list(expressions)
        self._came, self._gone, self._do = came, gone, do
        self._known: set[str] = set()
        self._crowded = self._named = self._left = False
        self._lock = threading.Lock()
        self._watching: list[zenoh.Subscriber[None]] = []
        self._watch()

    def leave(self) -> None:
        """Watch them no longer."""
        with self._lock:
            self._left = True
            watching, self._watching = self._watching, []
            _undeclare(watching)

    def _watch(self) -> None:
        """Hear of all that are there, and of each that comes or goes."""
        on_token = Callback(self._look, indirect=False)
        self._watching = [
            self._live.declare_subscriber(expression, on_token, history=True)
            for expression in self._expressions
        ]

    def _watch_again(self) -> None:
        with self._lock, suppress(zenoh.ZError):  # its session may have been closed meanwhile
            if self._left:
                return
            _undeclare(self._watching)
            for token in list(self._known):
                self._known.discard(token)
                self._gone(token)
            self._watch()

    def _look(self, sample: zenoh.Sample) -> None:
        """A token has come or gone. Called on zenoh's thread."""
        token = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.DELETE:
            self._known.discard(token)
            self._gone(token)
            if self._crowded and len(self._known) < MOST / 2:
                self._crowded = False
                self._do(self._watch_again)
        elif (peer := self._keys.peer(token)) is not None:
            if token not in self._known and len(self._known) >= MOST:
                self._crowd()
                return
            self._known.add(token)
            self._came(token, peer)

    def _crowd(self) -> None:
        self._crowded = True
        if not self._named:
            self._named = True
            self._do(self._name)

    def _name(self) -> None:
        on, reason = self._expressions[0], "further ends are not counted, nor compared with ours"
        log.warning(pairs("crowded", on=on, most=MOST, reason=reason))


class ZenohPeers:
    """Tells `peers` of tokens, on zenoh's thread. `news`: called after each. `do`: as `Tokens`."""

    def __init__(self, peers: Peers, news: Order, do: Callable[[Order], None]) -> None:
        self._peers = peers
        self._news = news
        self._do = do

    def watch(self, session: zenoh.Session, keys: Keys) -> Tokens:
        """Begin anew in this session; what is returned must be kept while it is open."""
        self._peers.clear()
        return Tokens(session, keys, keys.witnesses(), self._came, self._gone, self._do)

    def tell(self, token: str, end: Announced | None) -> None:
        """An end is there, or has gone (None)."""
        if end is None:
            self._peers.gone(token)
        else:
            self._peers.seen(token, end)
        self._news()

    def _came(self, token: str, peer: Peer) -> None:
        self.tell(token, peer.announced)

    def _gone(self, token: str) -> None:
        self.tell(token, None)


def _undeclare(watching: Iterable[zenoh.Subscriber[None]]) -> None:
    for one in watching:
        one.undeclare()  # type: ignore[no-untyped-call]
