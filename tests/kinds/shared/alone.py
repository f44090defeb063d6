"""The core of any kind without hardware and network, in virtual time.

The tests give events to the core, and read its messages from a list.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Generic, TypeVar

from bridges.kinds.shared.decision import Decision, Report
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages.definitions import Message

M = TypeVar("M")
L = TypeVar("L")
R = TypeVar("R", bound=Report)
E = TypeVar("E")


class Alone(ABC, Generic[M, E, L, R]):
    """A core that gets its events from the test. `sent` has (s, words) of each message. `refused` has
    (s, reason).

    The clocks of requesters are `skew` seconds ahead of ours.
    """

    def __init__(
        self,
        memory: M,
        decide: Callable[[M, E | MaySpeak | Woken, float, L], Decision[M, None, R]],
        limits: L,
        speaks: bool,
    ) -> None:
        self.memory = memory
        self.limits = limits
        self.now = 0.0
        self.skew = 100.0
        self.wake_at = 0.0
        self.report: R
        self.sent: list[tuple[float, str]] = []
        self.refused: list[tuple[float, str]] = []
        self._decide = decide
        self.hears(MaySpeak(speaks))

    @abstractmethod
    def words(self, message: Message) -> str:
        """Return a message in short words. Return "" for a message that `sent` shall not show."""

    def hears(self, event: E | MaySpeak | Woken) -> None:
        """Let the core decide on this event now."""
        decided = self._decide(self.memory, event, self.now, self.limits)
        self.memory, self.report, self.wake_at = decided.memory, decided.report, decided.wake_at
        at = round(self.now, 3)
        words = [self.words(message) for _, message in decided.publish]
        self.sent += [(at, word) for word in words if word]
        if decided.refused:
            self.refused.append((at, decided.refused))

    def until(self, at: float) -> None:
        """Let time pass until `at`. Wake the core whenever it has asked for a wake-up."""
        while self.wake_at <= at:
            self.now = self.wake_at
            self.hears(Woken())
            assert self.wake_at > self.now, "the core asks again and again to be woken at once"
        self.now = at

    def stamped(self, aged: float) -> float:
        """Return the stamp (s) of a message that was sent `aged` seconds ago, by the requester's
        clock."""
        return self.now + self.skew - aged
