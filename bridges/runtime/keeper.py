"""The memory on disk of a kind without hardware, such as a supervisor. The keeper also publishes the
one message that is about all subjects of the kind, such as a supervisor's heartbeat.

The memory is written before messages are published, because other nodes act on these messages. If
writing fails, the kind continues to serve with the fault NOT_KEPT. It tries to write again each second.
"""

import logging
from collections.abc import Mapping
from typing import Final, Generic, Protocol

from bridges.kinds.shared.decision import NOT_KEPT, Fault, M, R
from bridges.kinds.shared.durations import AGES_AGO, NEVER
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.kinds.shared.kind import E, L, S
from bridges.runtime.clock import PublishPace
from bridges.runtime.subject import Publish
from bridges.system.log import pairs

log = logging.getLogger(__name__)

AGAIN_S: Final = 1.0


class MemoryStore(Protocol):
    """A file that outlives the daemon. `read` returns None before the first `write`. `write` replaces
    the whole file. Both methods may raise OSError."""

    def read(self) -> bytes | None: ...

    def write(self, kept: bytes) -> None: ...


class Keeper(Generic[S, L, M, E, R]):
    """The keeper of one node's memory. `kept`: the store of the memory, or None if the memory is not
    kept. `tell_at`: the time at which the message about all subjects is due."""

    def __init__(
        self, kind: GraphKind[S, L, M, E, R], kept: MemoryStore | None, publish: Publish
    ) -> None:
        self.tell_at = NEVER
        self._kind = kind
        self._kept = kept
        self._publish = publish
        self._bytes: bytes | None = None
        self._again_at = AGES_AGO
        self._fault: Fault | None = None
        self._pace = PublishPace()

    def restore(self, settings: S, now: float) -> Mapping[str, M]:
        """Return the memory of each subject from disk. Log and ignore an invalid file."""
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

    @property
    def wake_at(self) -> float:
        """The time (monotonic s) at which the keeper has work: the next message about all subjects, or
        the next attempt to write."""
        return min(self.tell_at, self._again_at if self._fault else NEVER)

    @property
    def faults(self) -> tuple[Fault, ...]:
        """The fault NOT_KEPT if the latest memories are not on disk."""
        return (self._fault,) if self._fault else ()

    def keep(self, memories: Mapping[str, M], now: float) -> None:
        """Write the memories if the part that must survive a restart has changed."""
        if (
            self._kept is None
            or self._kind.persist is None
            or (self._fault and now < self._again_at)
        ):
            return
        kept = self._kind.persist(memories)
        if kept == self._bytes:
            self._keeps()
            return
        try:
            self._kept.write(kept)
        except OSError as error:
            self._again_at = now + AGAIN_S
            self._fails(
                Fault(NOT_KEPT, f"the memory is not on disk, so a restart would lose it: {error}")
            )
        else:
            self._bytes = kept
            self._keeps()

    def _fails(self, fault: Fault) -> None:
        if self._fault is None:
            log.error(pairs("fault", kind=self._kind.name, code=fault.code, detail=fault.detail))
        self._fault = fault

    def _keeps(self) -> None:
        if self._fault is not None:
            log.info(pairs("fault_over", kind=self._kind.name, code=NOT_KEPT))
        self._fault = None

    def tell(self, memories: Mapping[str, M], now: float, may_speak: bool) -> None:
        """Publish the message about all subjects, if it is due."""
        if self._kind.together is None or not may_speak:
            self.tell_at = NEVER
            return
        topic, message = self._kind.together(memories)
        if now >= self._pace.due_at(message):
            self._publish(topic, message)
            self._pace.published(message, now)
        self.tell_at = self._pace.due_at(message)
