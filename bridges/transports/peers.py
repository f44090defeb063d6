"""The publishers and subscriptions that other nodes have announced. Both are called ends. The
transports report the ends to this module. The ends show RMF's release, and message types that do not
match ours.

RMF's fleet adapter shows the release. It publishes FleetState. In newer releases it also subscribes to
EmergencySignal. Our daemons do not do this.

With `auto` we use the messages of the fleet adapters' release. Without a fleet adapter we use the
default release. If there are fleet adapters of two releases, this is a fault, and we do not change our
release.
"""

import logging
from collections import Counter
from collections.abc import Hashable, Iterator
from typing import Final

from msgspec import Struct

from bridges.messages.definitions import Alert, EmergencySignal, FleetState
from bridges.messages.releases import DEFAULT, Release
from bridges.messages.rihs01 import releases_of, type_hash, type_name
from bridges.messages.topics import AnyTopic
from bridges.system.log import pairs
from bridges.transports import notices

log = logging.getLogger(__name__)

MOST: Final = 5000
"""The maximum number of ends in memory. No site has more ends."""
WITNESSES: Final = {
    (type_name(FleetState), True),
    (type_name(EmergencySignal), False),
    (type_name(Alert), False),
}
"""The message types that show RMF's release, because only RMF's own nodes publish them (True) or
subscribe to them (False)."""
MISFIT: Final = "TYPE_MISFIT"
MIXED: Final = "TWO_RELEASES"


class Announced(Struct, frozen=True):
    """An announced publisher or subscription of any node.

    - `topic`: the topic's name without the first slash
    - `type`: the message's name in the form `package/msg/Name`
    - `hash`: the type hash, or "" if unknown
    """

    topic: str
    type: str
    hash: str
    publishes: bool


class Peers:
    """The announced ends of other nodes, and the release that these ends show. `wanted`: the release of
    the YAML, or None for `auto`."""

    def __init__(self, wanted: Release | None) -> None:
        self.release = wanted or DEFAULT
        self._auto = wanted is None
        self._ends: dict[Hashable, Announced] = {}
        self._ours: dict[tuple[str, bool], AnyTopic] = {}
        self._mixed = False
        self._named: set[tuple[str, bool]] = set()

    def ours(self, topic: AnyTopic, *, publishes: bool) -> None:
        """Note an end of our own node."""
        self._ours[topic.name.strip("/"), publishes] = topic

    def seen(self, key: Hashable, end: Announced) -> None:
        """Note an end of another node."""
        if len(self._ends) < MOST or key in self._ends:
            self._ends[key] = end

    def gone(self, key: Hashable) -> None:
        """Note that an end has left the graph."""
        self._ends.pop(key, None)

    def present(self) -> list[Hashable]:
        """Return the keys of all present ends. Any thread may call this method."""
        return list(self._ends)

    def clear(self) -> None:
        """Forget all ends, because our node joins the graph again."""
        self._ends.clear()

    def settle(self) -> bool:
        """Adopt the release of RMF's nodes. Return True if our release has changed."""
        heard = self._heard()
        self._name_mixed(heard)
        if not self._auto or len(heard) != 1 or self.release in heard:
            return False
        (self.release,) = heard
        log.info(pairs("release", speaks=self.release.name, reason="RMF's fleet adapters do"))
        return True

    def name_misfits(self) -> None:
        """Log each topic on which other nodes use a type that differs from ours. Log each topic only
        once."""
        for end in list(self._ends.values()):
            if self._misfits(end):
                self.name(self._ours[end.topic, not end.publishes], published=end.publishes)

    def name(self, topic: AnyTopic, *, published: bool) -> None:
        """Log that other nodes use a type on this topic that differs from ours. Log each topic only
        once. `published`: Do the other nodes publish the topic? Otherwise they subscribe to it."""
        key = topic.name.strip("/"), published
        if key not in self._named:
            self._named.add(key)
            notices.misfit(topic, notices.NOT_HEARD if published else notices.NOT_SERVED, "type")

    def differs(self, topic: AnyTopic, before: Release) -> bool:
        """Return whether this topic's message differs between the present release and `before`."""
        return _hash_of(topic, self.release) != _hash_of(topic, before)

    def faults(self) -> list[tuple[str, str]]:
        """Return the code and the detail of each present fault that keeps nodes from hearing each
        other."""
        heard = sorted(release.name for release in self._heard())
        found = [(MIXED, f"{' and '.join(heard)} are both on this graph")] if len(heard) > 1 else []
        counts = Counter(end.topic for end in list(self._ends.values()) if self._misfits(end))
        what = f"peer(s) with another definition than ours ({self.release.name})"
        return found + [(MISFIT, f"{topic}: {n} {what}") for topic, n in sorted(counts.items())]

    def _heard(self) -> set[Release]:
        return {
            release
            for end in list(self._ends.values())
            if (end.type, end.publishes) in WITNESSES
            for release in _only(end.hash)
        }

    def _misfits(self, end: Announced) -> bool:
        ours = self._ours.get((end.topic, not end.publishes))
        if ours is None or not self.release.has(ours.type):
            return False
        fits = end.hash in ("", type_hash(ours.type, self.release))
        return end.type != type_name(ours.type) or not fits

    def _name_mixed(self, heard: set[Release]) -> None:
        """Log when a second release appears on the graph."""
        if len(heard) > 1 and not self._mixed:
            names = " ".join(sorted(release.name for release in heard))
            log.warning(pairs("two_releases", on_this_graph=names, we_speak=self.release.name))
        self._mixed = len(heard) > 1


def _hash_of(topic: AnyTopic, release: Release) -> str:
    return type_hash(topic.type, release) if release.has(topic.type) else ""


def _only(hashed: str) -> Iterator[Release]:
    """Yield the release with this hash. Yield nothing if several releases have the hash."""
    found = releases_of(hashed)
    return iter(found if len(found) == 1 else ())
