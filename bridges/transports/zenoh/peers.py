"""The tokens by which ends announce themselves on a zenoh graph.

Each of our ends watches the tokens on its own topic (`place.py`). `ZenohPeers` watches the tokens that
show RMF's release, whatever topics we have.
"""

import logging
import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Final

import zenoh
from zenoh.handlers import Callback

from bridges.system.log import pairs
from bridges.transports.peers import Announced, Peers
from bridges.transports.zenoh.keys import Keys, Peer

log = logging.getLogger(__name__)

MOST: Final = 1000
"""The most tokens that are kept. No site has more ends on one topic."""

Order = Callable[[], None]
"""Work for the transport's thread."""


class Merged:
    """An order that is queued for the transport's thread at most once at a time."""

    def __init__(self, do: Callable[[Order], None], order: Order) -> None:
        self._do, self._order = do, order
        self._waits = False

    def __call__(self) -> None:
        """Queue the order; from any thread."""
        if not self._waits:
            self._waits = True
            self._do(self._run)

    def _run(self) -> None:
        self._waits = False
        self._order()


class Tokens:
    """The tokens that match some key expressions, while the session is open or until `leave`.

    `came(token, peer)`, `gone(token)`: called on zenoh's thread. At most MOST tokens are kept; further
    tokens are left out, and this is logged once. When half of the kept tokens have gone, all tokens are
    queried again, so that no token is missing after a flood. `do(order)` runs an order on the
    transport's thread.
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
        """Stop watching the tokens."""
        with self._lock:
            self._left = True
            watching, self._watching = self._watching, []
            _undeclare(watching)

    def _watch(self) -> None:
        """Watch for all present tokens, and for each token that comes or goes."""
        on_token = Callback(self._look, indirect=False)
        self._watching = [
            self._live.declare_subscriber(expression, on_token, history=True)
            for expression in self._expressions
        ]

    def _watch_again(self) -> None:
        with self._lock, suppress(zenoh.ZError):  # the session may have been closed meanwhile
            if self._left:
                return
            _undeclare(self._watching)
            for token in list(self._known):
                self._known.discard(token)
                self._gone(token)
            self._watch()

    def _look(self, sample: zenoh.Sample) -> None:
        """Note a token that has come or gone; called on zenoh's thread."""
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
    """Reports tokens to `peers`, on zenoh's thread. `news`: called after each token. `do`: see
    `Tokens`."""

    def __init__(self, peers: Peers, news: Order, do: Callable[[Order], None]) -> None:
        self._peers = peers
        self._news = news
        self._do = do

    def watch(self, session: zenoh.Session, keys: Keys) -> Tokens:
        """Watch in this session from the beginning. The caller must keep the returned Tokens while the
        session is open."""
        self._peers.clear()
        return Tokens(session, keys, keys.witnesses(), self._came, self._gone, self._do)

    def tell(self, token: str, end: Announced | None) -> None:
        """Note an end that has come; None: the end has gone."""
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
