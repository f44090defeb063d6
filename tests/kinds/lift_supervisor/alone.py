"""The core of the lift supervisor for one lift, without a network, in virtual time.

The tests give events to the core, and read its messages from a list.
"""

from bridges.kinds.lift_supervisor import core
from bridges.kinds.lift_supervisor.memory import LiftSupervisorLimits, SupervisedLift
from bridges.kinds.lift_supervisor.report import SupervisorReport
from bridges.kinds.lift_supervisor.signals import (
    Event,
    LiftStateHeard,
    RideEnded,
    RideRequested,
    Target,
)
from bridges.messages.definitions import LiftMode, LiftRequest, Message
from tests.kinds.shared import alone

MODES = {"AGV": LiftMode.MODE_AGV, "FIRE": LiftMode.MODE_FIRE, "OFFLINE": LiftMode.MODE_OFFLINE}
TYPES = {0: "END", 1: "AGV", 2: "HUMAN"}


def words(message: LiftRequest) -> str:
    """Return a request in words: `AGV a L3`, `END a L1`."""
    name = TYPES[message.request_type]
    return f"{name} {message.session_id} {message.destination_floor}".rstrip()


class Alone(alone.Alone[SupervisedLift, Event, LiftSupervisorLimits, SupervisorReport]):
    """The core for one lift."""

    def __init__(self, limits: LiftSupervisorLimits | None = None, *, speaks: bool = True) -> None:
        super().__init__(
            core.initial("Lift1", 0.0), core.decide, limits or LiftSupervisorLimits(), speaks
        )
        self.skew = 0.0

    def words(self, message: Message) -> str:
        assert isinstance(message, LiftRequest)
        return words(message)

    def asks(self, session: str, floor: str = "L3", *, kind: int = 1, aged: float = 0.0) -> None:
        """Let an adapter's request arrive that was sent `aged` seconds ago."""
        stamp = self.stamped(aged)
        door = 2 if kind == 1 else 0
        self.hears(RideRequested(session, Target(kind, floor, door), stamp, self.now - stamp))

    def ends(self, session: str, *, aged: float = 0.0) -> None:
        """Let an adapter's END arrive that was sent `aged` seconds ago."""
        stamp = self.stamped(aged)
        self.hears(RideEnded(session, stamp, self.now - stamp))

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
        """Let a LiftState arrive."""
        door = 2 if open else 0
        self.hears(LiftStateHeard(session, floor, to, door, MODES[mode], floors))

    def ride(self, session: str = "a") -> None:
        """Let a state arrive in which the lift is open at L3 for this session. Then the supervisor need
        not repeat its request."""
        self.shows(session, "L3", to="L3", open=True)

    @property
    def faults(self) -> list[str]:
        return [fault.code for fault in self.report.faults]

    @property
    def waiting(self) -> list[str]:
        return [session for session, _ in self.report.waiting]
