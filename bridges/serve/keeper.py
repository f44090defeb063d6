"""What a kind without hardware keeps on disk, and the message that it publishes about all subjects.

It writes to disk before it publishes, because others act on what is published.
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
    """The file that outlives the daemon; None before the first `write`, which replaces it as a whole.
    Both may raise OSError."""

    def read(self) -> bytes | None: ...

    def write(self, kept: bytes) -> None: ...


class Keeper(Generic[S, L, M, E, R]):
    """The keeper of one node. `kept`: None to keep nothing. `tell_at`: when to publish next."""

    def __init__(self, kind: GraphKind[S, L, M, E, R], kept: Kept | None, publish: Publish) -> None:
        self.tell_at = NEVER
        self._kind = kind
        self._kept = kept
        self._publish = publish
        self._bytes: bytes | None = None
        self._pace = Pace()

    def restore(self, settings: S, now: float) -> Mapping[str, M]:
        """The memories that were kept; an invalid file is logged and ignored."""
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
        """Write what must survive a restart, if it has changed."""
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
        """Publish the message about all subjects, if it is due."""
        if self._kind.together is None or not may_speak:
            self.tell_at = NEVER
            return
        topic, message = self._kind.together(memories)
        if now >= self._pace.due_at(message):
            self._publish(topic, message)
            self._pace.told(message, now)
        self.tell_at = self._pace.due_at(message)
