"""Refused requests that wait for an answer. At most MOST requests wait, so that a flood of requests
causes no flood of answers."""

from collections import deque
from collections.abc import Callable, Mapping
from typing import Final

from bridges.kinds.shared.durations import AGES_AGO, NEVER
from bridges.kinds.shared.kind import RefusalAnswer
from bridges.runtime.clock import TELL_GAP_S
from bridges.runtime.subject import Publish

MOST: Final = 10
"""The maximum number of requests that are answered every TELL_GAP_S. In a flood only the latest
requests are answered."""


class RefusalAnswers:
    """The refused requests of one device or node. `last`: the last answer, for the status file."""

    def __init__(self) -> None:
        self.last: Mapping[str, str] = {}
        self._waiting: deque[tuple[object, str]] = deque(maxlen=MOST)
        self._said_at = AGES_AGO

    def add(self, request: object, reason: str) -> None:
        """Note a refused request and the reason. `request`: the request's message or event. Any thread
        may call this method."""
        self._waiting.append((request, reason))

    @property
    def due_at(self) -> float:
        """The time of the next answers (monotonic s), or NEVER if no request waits."""
        return self._said_at + TELL_GAP_S if self._waiting else NEVER

    def say(
        self, now: float, answer: Callable[[object, str], RefusalAnswer | None], say: Publish
    ) -> None:
        """Publish the answers that are due."""
        if now < self.due_at:
            return
        self._said_at = now
        for _ in range(len(self._waiting)):
            found = answer(*self._waiting.popleft())
            if found is not None:
                self.last = found.status
                say(found.topic, found.message)

    def status(self) -> Mapping[str, Mapping[str, str]]:
        """Return the last answer for the status file. Return nothing before the first answer."""
        return {"last_refusal": self.last} if self.last else {}
