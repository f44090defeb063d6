"""The supervisor's core alone, for one lift, in virtual time: told by hand, its words written down."""

from typing import Any

from bridges.core.decision import Decision
from bridges.core.graph_kind import MaySpeak, Woken
from bridges.lift_supervisor import core
from bridges.lift_supervisor.memory import Limits, Memory
from bridges.lift_supervisor.report import SupervisorReport
from bridges.lift_supervisor.signals import Ended, Requested, StateHeard, Target
from bridges.rmf.definitions import LiftMode, LiftRequest

MODES = {"AGV": LiftMode.MODE_AGV, "FIRE": LiftMode.MODE_FIRE, "OFFLINE": LiftMode.MODE_OFFLINE}
TYPES = {0: "END", 1: "AGV", 2: "HUMAN"}
AGES_AGO = 1e6


def words(message: LiftRequest) -> str:
    """`AGV a L3`, `END a L1`."""
    name = TYPES[message.request_type]
    return f"{name} {message.session_id} {message.destination_floor}".rstrip()


class Alone:
    """`sent`: (s, words) of each request to the node. `requester clocks` are ours plus `skew`."""

    def __init__(self, limits: Limits | None = None, *, speaks: bool = True) -> None:
        self.limits = limits or Limits()
        self.now = 0.0
        self.skew = 0.0
        self.memory: Memory = core.initial("Lift1", 0.0)
        self.sent: list[tuple[float, str]] = []
        self.refused: list[tuple[float, str]] = []
        self.report: SupervisorReport
        self.wake_at = 0.0
        self.hears(MaySpeak(speaks))

    def hears(self, event: Any) -> None:
        """One decision, now."""
        decided: Decision[Any, Any, Any] = core.decide(self.memory, event, self.now, self.limits)
        self.memory, self.report, self.wake_at = decided.memory, decided.report, decided.wake_at
        self.sent += [(round(self.now, 3), words(m)) for _, m in decided.publish]  # type: ignore[arg-type]
        if decided.refused:
            self.refused.append((round(self.now, 3), decided.refused))

    def until(self, at: float) -> None:
        """Time passes; the core is woken when it wants to be."""
        while self.wake_at <= at:
            self.now = self.wake_at
            self.hears(Woken())
            assert self.wake_at > self.now, "it wants to be woken at once, for ever"
        self.now = at

    def asks(self, session: str, floor: str = "L3", *, kind: int = 1, aged: float = 0.0) -> None:
        """An adapter's request, sent `aged` s ago by its own clock."""
        stamp = self.now + self.skew - aged
        door = 2 if kind == 1 else 0
        self.hears(Requested(session, Target(kind, floor, door), stamp, self.now - stamp))

    def ends(self, session: str, *, aged: float = 0.0) -> None:
        """An adapter's END."""
        stamp = self.now + self.skew - aged
        self.hears(Ended(session, stamp, self.now - stamp))

    def shows(
        self,
        session: str = "",
        floor: str = "L1",
        *,
        to: str = "",
        open: bool = False,
        mode: str = "AGV",
        floors: tuple[str, ...] = (),
    ) -> None:
        """A LiftState."""
        door = 2 if open else 0
        self.hears(StateHeard(session, floor, to, door, MODES[mode], floors))

    def ride(self, session: str = "a") -> None:
        """The lift is there, for this session: nothing is left to ask for."""
        self.shows(session, "L3", to="L3", open=True)

    @property
    def faults(self) -> list[str]:
        return [fault.code for fault in self.report.faults]

    @property
    def waiting(self) -> list[str]:
        return [session for session, _ in self.report.waiting]
