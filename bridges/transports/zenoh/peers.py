"""The liveliness tokens with which publishers and subscriptions announce themselves on zenoh. Both are
called ends.

Each of our ends watches the tokens of its own topic (`place.py`). `ZenohPeers` watches the tokens that
show RMF's release. These may be on topics that we do not use.
"""

import logging
import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import partial
from typing import Final

import zenoh
from zenoh.handlers import Callback

from bridges.system.log import pairs
from bridges.transports.peers import Announced, Peers
from bridges.transports.zenoh.keys import Keys, Peer

log = logging.getLogger(__name__)

MOST: Final = 1000
"""The maximum number of tokens that one `Tokens` keeps. It is enough, because no site has more ends on
one topic."""

Order = Callable[[], None]
"""Work for the transport's thread."""


class Merged:
    """An order for the transport's thread. While the order is in the queue, calling this object again
    does nothing."""

    def __init__(self, do: Callable[[Order], None], order: Order) -> None:
        self._do, self._order = do, order
        self._waits = False

    def __call__(self) -> None:
        """Queue the order. Any thread may call this method."""
        if not self._waits:
            self._waits = True
            self._do(self._run)

    def _run(self) -> None:
        self._waits = False
        self._order()


class Tokens:
    """A watch for the tokens that match some key expressions, until `leave` or the session's end.

    zenoh's threads call `came(token, peer)` and `gone(token)`, one call at a time. `do(order)` queues a
    function for the transport's thread.

    At most MOST tokens are kept. Further tokens are left out, and the first of them is logged. When
    half of the kept tokens have gone, all tokens are queried again. So no token is missing after a
    flood.

    zenoh reports the tokens that exist already on one thread, and all changes on another thread.
    Therefore the report that a token has gone may come before the report that it has come. In that case
    `Tokens` asks other nodes for the token, and counts it only if it still exists.
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
        self._gone_before: dict[str, None] = {}
        """The tokens that were reported as gone before they were reported as come, the oldest first. At
        most MOST are kept."""
        self._doubtful: dict[str, Peer] = {}
        """The tokens that were reported as come after they were reported as gone. Other nodes will be
        asked for these tokens."""
        self._asked: dict[str, Peer] = {}
        self._ask = Merged(do, self._ask_all)
        self._crowded = self._named = self._left = False
        self._lock = threading.Lock()
        self._changing = threading.Lock()
        self._watch_number = 0
        self._watching: list[zenoh.Subscriber[None]] = []
        self._watch()

    def leave(self) -> None:
        """Stop watching the tokens."""
        with self._lock:
            self._left = True
            watching, self._watching = self._watching, []
            _undeclare(watching)

    def _watch(self) -> None:
        """Watch the present tokens, and each token that comes or goes."""
        on_token = Callback(partial(self._look, self._watch_number), indirect=False)
        self._watching = [
            self._live.declare_subscriber(expression, on_token, history=True)
            for expression in self._expressions
        ]

    def _watch_again(self) -> None:
        with self._lock, suppress(zenoh.ZError):  # the session may already be closed
            if self._left:
                return
            _undeclare(self._watching)
            with self._changing:
                self._watch_number += 1
                for token in self._known:
                    self._gone(token)
                for tokens in (self._known, self._gone_before, self._doubtful, self._asked):
                    tokens.clear()
            self._watch()

    def _look(self, watch: int, sample: zenoh.Sample) -> None:
        """Note that a token has come or gone. zenoh's threads call this method.

        `watch`: the number of the watch that reports this. Reports of an earlier watch are ignored,
        because they may arrive after its end.
        """
        token = str(sample.key_expr)
        goes = sample.kind == zenoh.SampleKind.DELETE
        peer = None if goes else self._keys.peer(token)
        with self._changing:
            if watch != self._watch_number:
                return
            if goes:
                self._part(token)
            elif peer is not None and token in self._gone_before:
                self._doubtful[token] = peer
                self._ask()
            elif peer is not None:
                self._meet(token, peer)

    def _meet(self, token: str, peer: Peer) -> None:
        if token not in self._known and len(self._known) >= MOST:
            self._crowd()
            return
        self._known.add(token)
        self._came(token, peer)

    def _part(self, token: str) -> None:
        self._doubt_no_more(token)
        if token in self._known:
            self._known.remove(token)
        else:
            self._gone_before[token] = None
            if len(self._gone_before) > MOST:
                oldest = next(iter(self._gone_before))
                del self._gone_before[oldest]
                self._doubt_no_more(oldest)
        self._gone(token)
        if self._crowded and len(self._known) < MOST / 2:
            self._crowded = False
            self._do(self._watch_again)

    def _doubt_no_more(self, token: str) -> None:
        self._doubtful.pop(token, None)
        self._asked.pop(token, None)

    def _ask_all(self) -> None:
        """Ask other nodes for the doubtful tokens. The transport's thread calls this method."""
        with self._changing:
            asked, self._doubtful = self._doubtful, {}
            self._asked.update(asked)
            on_reply = Callback(partial(self._answered, self._watch_number), indirect=False)
        with suppress(zenoh.ZError):  # the session may already be closed
            for token in asked:
                self._live.get(token, on_reply)

    def _answered(self, watch: int, reply: zenoh.Reply) -> None:
        """Note that a token exists. Ignore the answer if the token has gone since the question."""
        if (sample := reply.ok) is None:
            return
        token = str(sample.key_expr)
        with self._changing:
            if watch == self._watch_number and (peer := self._asked.pop(token, None)):
                self._gone_before.pop(token, None)
                self._meet(token, peer)

    def _crowd(self) -> None:
        self._crowded = True
        if not self._named:
            self._named = True
            self._do(self._name)

    def _name(self) -> None:
        on, reason = self._expressions[0], "further ends are neither counted nor compared with ours"
        log.warning(pairs("crowded", on=on, most=MOST, reason=reason))


class ZenohPeers:
    """A watch for the tokens that show RMF's release. It reports their ends to `peers` on zenoh's
    thread, and calls `news` after each token. `do`: as in `Tokens`."""

    def __init__(self, peers: Peers, news: Order, do: Callable[[Order], None]) -> None:
        self._peers = peers
        self._news = news
        self._do = do

    def watch(self, session: zenoh.Session, keys: Keys) -> Tokens:
        """Watch a new session. The caller must keep the returned Tokens until the session is closed."""
        self._peers.clear()
        return Tokens(session, keys, keys.witnesses(), self._came, self._gone, self._do)

    def tell(self, token: str, end: Announced | None) -> None:
        """Note an end that has come. If `end` is None, the end with this token has gone."""
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
