"""The supervisor's core alone, for one door, in virtual time: told by hand, its words written down."""

from typing import Any

from bridges.core.graph_kind import MaySpeak, Woken
from bridges.door_supervisor import core
from bridges.door_supervisor.core import Decided
from bridges.door_supervisor.memory import Limits, Memory
from bridges.door_supervisor.signals import CloseRequested, OpenRequested, StateHeard
from bridges.rmf.definitions import DoorModeValue, DoorRequest

SECOND_NS = 10**9


class Alone:
    """`sent`: (s, word) of each request to the node. Requesters' clocks are ours plus `skew`."""

    def __init__(self, limits: Limits | None = None, *, speaks: bool = True) -> None:
        self.limits = limits or Limits()
        self.now = 0.0
        self.skew = 100.0
        self.memory: Memory = core.initial("ward", 0.0)
        self.sent: list[tuple[float, str]] = []
        self.refused: list[tuple[float, str]] = []
        self.faults: list[tuple[float, tuple[str, ...]]] = []
        self.last: Decided
        self.hears(MaySpeak(speaks))

    def hears(self, event: Any) -> None:
        """One decision, now."""
        self.last = core.decide(self.memory, event, self.now, self.limits)
        self.memory = self.last.memory
        at = round(self.now, 3)
        for _, message in self.last.publish:
            assert isinstance(message, DoorRequest)
            assert (message.requester_id, message.door_name) == ("door_supervisor", "ward")
            word = DoorModeValue(message.requested_mode.value).name.removeprefix("MODE_")
            self.sent.append((at, word))
        if self.last.refused:
            self.refused.append((at, self.last.refused))
        faults = tuple(str(fault) for fault in self.last.report.faults)
        if faults != (self.faults[-1][1] if self.faults else ()):
            self.faults.append((at, faults))

    def until(self, at: float) -> None:
        """Time passes; the core is woken when it wants to be."""
        while self.last.wake_at <= at:
            self.now = self.last.wake_at
            self.hears(Woken())
            assert self.last.wake_at > self.now, "it wants to be woken at once, for ever"
        self.now = at

    def opens(self, who: str = "a", *, aged: float = 0.0) -> None:
        """A requester's OPEN, sent `aged` s ago by its own clock."""
        self.hears(OpenRequested(who, self.stamp(aged)))

    def closes(self, who: str = "a", *, aged: float = 0.0) -> None:
        """A requester's CLOSE."""
        self.hears(CloseRequested(who, self.stamp(aged)))

    def stamp(self, aged: float) -> int:
        return round((self.now + self.skew - aged) * SECOND_NS)

    def shows(self, mode: str, until: float | None = None) -> None:
        """A DoorState; with `until`, one each second from now until then."""
        self.hears(StateHeard(DoorModeValue[f"MODE_{mode}"]))
        while until is not None and self.now + 1.0 <= until:
            self.until(self.now + 1.0)
            self.hears(StateHeard(DoorModeValue[f"MODE_{mode}"]))
        if until is not None:
            self.until(until)

    @property
    def holders(self) -> list[str]:
        return [holder.requester for holder in self.memory.holders]
