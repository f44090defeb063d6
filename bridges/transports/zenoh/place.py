"""The presence of a publisher or subscription in one zenoh session. It knows which ends of other nodes
match, and which do not."""

from collections.abc import Callable

import zenoh

from bridges.messages.rihs01 import type_hash
from bridges.messages.topics import AnyTopic
from bridges.transports.peers import Announced
from bridges.transports.zenoh import keys as zenoh_keys
from bridges.transports.zenoh.keys import Keys, Kind
from bridges.transports.zenoh.peers import Order, Tokens

Tell = Callable[[str, Announced | None], None]
"""A callback with a token and the publisher or subscription that it announces. The latter is None if it
has gone."""


class Place:
    """The presence of one publisher or subscription (an end) in one session: its own token, and the
    tokens of its peers.

    A peer of a publisher is a subscription on the same topic, in any process. A peer of a subscription
    is a publisher.

    - `peers`: maps the token of each peer that matches this end to the peer
    - `unheard`: the gids of the peers that do not match
    - `misfit(policy)`: a callback on zenoh's thread for each peer whose QoS does not match
    - `tell(token, end)`: a callback on zenoh's thread for each peer that comes or goes. `end` is None
      if the peer goes.
    - `do`: as in `Tokens`
    """

    def __init__(
        self,
        session: zenoh.Session,
        keys: Keys,
        kind: Kind,
        topic: AnyTopic,
        number: int,
        misfit: Callable[[str], None],
        tell: Tell,
        do: Callable[[Order], None],
    ) -> None:
        self.key = keys.data(topic)
        self.token = keys.token(kind, topic, number)
        self.gid = zenoh_keys.gid(self.token)
        self.peers: dict[str, zenoh_keys.Peer] = {}
        self.unheard: set[bytes] = set()
        self._keys = keys
        self._kind = kind
        self._topic = topic
        self._misfit = misfit
        self._tell = tell
        retained = topic.publish if kind == "MP" else topic.subscribe
        self._transient_local = retained.durability == "transient_local"
        self._live = session.liveliness()
        others = keys.others("MS" if kind == "MP" else "MP", topic)
        self._tokens = Tokens(session, keys, [others], self._meet, self._part, do)
        self._alive: zenoh.LivelinessToken | None = None

    def appear(self) -> None:
        """Declare the token. Other nodes see this end from now on."""
        self._alive = self._live.declare_token(self.token)

    def leave(self) -> None:
        """Withdraw the token."""
        if self._alive:
            self._alive.undeclare()  # type: ignore[no-untyped-call]
        self._tokens.leave()

    def _part(self, token: str) -> None:
        """Forget a peer that has gone. zenoh's thread calls this method and `_meet`."""
        self.peers.pop(token, None)
        self.unheard.discard(zenoh_keys.gid(token))
        self._tell(token, None)

    def _meet(self, token: str, peer: zenoh_keys.Peer) -> None:
        self._tell(token, peer.announced)
        policy = self._incompatible(peer)
        if not policy:
            self.peers[token] = peer
            return
        self.unheard.add(zenoh_keys.gid(token))
        if policy != "type":  # `peers.py` logs types that do not match
            self._misfit(policy)

    def _incompatible(self, theirs: zenoh_keys.Peer) -> str:
        """Return the QoS policy that would keep DDS from matching the two ends. Return "" if the ends
        match."""
        hashed = type_hash(self._topic.type, self._keys.release)
        if theirs.type != self._keys.type(self._topic) or theirs.announced.hash not in ("", hashed):
            return "type"
        wants, keeps = theirs.transient_local, self._transient_local
        if self._kind == "MS":
            wants, keeps = keeps, wants
        return "durability" if wants and not keeps else ""
