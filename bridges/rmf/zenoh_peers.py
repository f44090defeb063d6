"""What the ends on a zenoh graph announce, by their tokens.

Each end of ours watches the tokens on its own topic (`zenoh_ends.py`). Those that show RMF's release
are watched here, whatever our topics are.
"""

from collections.abc import Callable

import zenoh
from zenoh.handlers import Callback

from bridges.rmf.peers import Announced, Peers
from bridges.rmf.zenoh_keys import Keys


class ZenohPeers:
    """Tells `peers` of tokens, on zenoh's thread. `news`: called after each."""

    def __init__(self, peers: Peers, news: Callable[[], None]) -> None:
        self._peers = peers
        self._news = news

    def watch(self, session: zenoh.Session, keys: Keys) -> list[object]:
        """Begin anew in this session; what is returned must be kept while it is open."""
        self._peers.clear()
        on_token: Callback[zenoh.Sample] = Callback(
            lambda sample: self._token(sample, keys), indirect=False
        )
        live = session.liveliness()
        return [live.declare_subscriber(key, on_token, history=True) for key in keys.witnesses()]

    def tell(self, token: str, end: Announced | None) -> None:
        """An end is there, or has gone (None)."""
        if end is None:
            self._peers.gone(token)
        else:
            self._peers.seen(token, end)
        self._news()

    def _token(self, sample: zenoh.Sample, keys: Keys) -> None:
        token = str(sample.key_expr)
        peer = keys.peer(token) if sample.kind == zenoh.SampleKind.PUT else None
        self.tell(token, peer.announced if peer else None)
