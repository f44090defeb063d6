"""What a kind without hardware keeps for its next start, and what it tells of all its subjects at once.

What is kept is kept before it is told: others act on what they are told.
"""

import logging
from collections.abc import Mapping
from typing import Generic, Protocol

from bridges.core.decision import M, R
from bridges.core.durations import NEVER
from bridges.core.graph_kind import GraphKind
from bridges.core.kind import E, L, S
from bridges.log import pairs
from bridges.serve.clock import Pace
from bridges.serve.subject import Publish

log = logging.getLogger(__name__)


class Kept(Protocol):
    """What outlives the daemon: one file, or nothing yet. `write` replaces it whole; both may raise
    OSError."""

    def read(self) -> bytes | None: ...

    def write(self, kept: bytes) -> None: ...


class Keeper(Generic[S, L, M, E, R]):
    """Of one node. `kept`: None to forget. `tell_at`: when all subjects are to be told of next."""

    def __init__(self, kind: GraphKind[S, L, M, E, R], kept: Kept | None, publish: Publish) -> None:
        self.tell_at = NEVER
        self._kind = kind
        self._kept = kept
        self._publish = publish
        self._bytes: bytes | None = None
        self._pace = Pace()

    def restore(self, settings: S, now: float) -> Mapping[str, M]:
        """What was kept; a file that cannot be right is as good as none, and says so."""
        if self._kept is None or self._kind.restore is None:
            return {}
        try:
            kept = self._kept.read()
            found = {} if kept is None else self._kind.restore(kept, settings, now)
        except (OSError, ValueError) as error:
            log.error(pairs("not_restored", kind=self._kind.name, reason=error))
            return {}
        self._bytes = kept
        return found

    def keep(self, memories: Mapping[str, M]) -> None:
        """Write down what must outlive us, if it has changed."""
        if self._kept is None or self._kind.persist is None:
            return
        kept = self._kind.persist(memories)
        if kept == self._bytes:
            return
        self._bytes = kept
        try:
            self._kept.write(kept)
        except OSError as error:
            log.error(pairs("not_kept", kind=self._kind.name, reason=error))

    def tell(self, memories: Mapping[str, M], now: float, may_speak: bool) -> None:
        """Tell of all subjects together, when that is due."""
        if self._kind.together is None or not may_speak:
            self.tell_at = NEVER
            return
        topic, message = self._kind.together(memories)
        if now >= self._pace.due_at(message):
            self._publish(topic, message)
            self._pace.told(message, now)
        self.tell_at = self._pace.due_at(message)
