"""A charger assigned to a robot, or no longer: by its own daemon, or from the coordinator's queue."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, Final

from bridges.commands.requests import Done, Failed, Obstacle, Request, Seen
from bridges.rmf import definitions as d
from bridges.rmf import topics, words
from bridges.rmf.stamps import duration
from bridges.rmf.topics import AnyTopic

ANY: Final = "any"
SERVING: Final = (
    d.ChargerStateValue.CHARGER_ASSIGNED,
    d.ChargerStateValue.CHARGER_CHARGING,
    d.ChargerStateValue.CHARGER_RELEASED,
)


class _Charger(Request):
    __slots__ = ()
    kind = "charger"
    states = topics.CHARGER_STATES


@dataclass(frozen=True, slots=True)
class Charge(_Charger):
    """The charger assigned to a robot under our request id."""

    fleet: str
    robot: str
    request_id: str
    start_timeout_s: float

    own: ClassVar[AnyTopic] = topics.CHARGER_REQUESTS

    def message(self, seen: Seen) -> d.ChargerRequest:
        """The same id each time, so that a repeat is no new request."""
        charger = "" if self.name == ANY else self.name
        limit = duration(self.start_timeout_s)
        return d.ChargerRequest(charger, self.fleet, self.robot, limit, self.request_id)

    def outcome(self, seen: Seen) -> Done | None:
        """A state with our id that serves it."""
        answer = seen.answer()
        if answer is None or answer.state not in SERVING or answer.request_id != self.request_id:
            return None
        state = words.plain(d.ChargerStateValue, answer.state)
        return Done(f"{self.name} is {state} for request {self.request_id}")

    def obstacles(self, seen: Seen) -> Iterable[Obstacle]:
        """An error, or another's request."""
        state: d.ChargerState = seen.latest()
        cancel = self.line.other("send", "charger", self.name, "--cancel", state.request_id)
        return (
            _error(state),
            Obstacle(
                state.request_id not in ("", self.request_id),
                f"{self.name} serves request {state.request_id}",
                f"to cancel that: {cancel}",
            ),
            Obstacle(True, f"{self.name} did not take the request: its daemon's log says why"),
        )


def _error(state: d.ChargerState) -> Obstacle:
    failed = state.state == d.ChargerStateValue.CHARGER_ERROR
    return Obstacle(failed, f"{state.charger_name} reports an error: {state.error_message}")


@dataclass(frozen=True, slots=True)
class ChargeCancel(_Charger):
    """The charger no longer assigned to that request."""

    request_id: str

    own: ClassVar[AnyTopic] = topics.CHARGER_CANCELS

    def message(self, seen: Seen) -> d.ChargerCancel:
        """By its id."""
        return d.ChargerCancel(self.name, self.request_id)

    def outcome(self, seen: Seen) -> Done | Failed | None:
        """Released, or the id gone; an id that was never there is a mistake worth an error."""
        answer = seen.answer()
        if answer is None or self._holds(answer):
            return None
        if any(self._holds(heard.message) for heard in seen.states):
            return Done(f"{self.name} no longer serves request {self.request_id}")
        state = words.described(answer)
        return Failed(f"{self.name} does not serve request '{self.request_id}' (state: {state})")

    def _holds(self, state: d.ChargerState) -> bool:
        released = (d.ChargerStateValue.CHARGER_IDLE, d.ChargerStateValue.CHARGER_RELEASED)
        return state.request_id == self.request_id and state.state not in released

    def obstacles(self, seen: Seen) -> Iterable[Obstacle]:
        """It goes on."""
        text = f"{self.name} still serves request {self.request_id}: its daemon's log says why"
        return (Obstacle(True, text),)


COORDINATOR: Final = "charger coordinator"


@dataclass(frozen=True, slots=True)
class QueuedCharge(Charge):
    """Some charger that serves this robot; the charger of this `name`, unless it is ANY."""

    own = topics.ADAPTER_CHARGER_REQUESTS
    listener = COORDINATOR

    @property
    def who(self) -> str:
        """The robot, by its fleet."""
        return f"{self.fleet}/{self.robot}"

    def about(self, state: words.Stated) -> bool:
        """A charger that shows this robot."""
        return isinstance(state, d.ChargerState) and (
            (state.robot_fleet, state.robot_name) == (self.fleet, self.robot)
        )

    def ready(self, seen: Seen) -> bool:
        """Some charger is heard."""
        return bool(seen.names)

    def outcome(self, seen: Seen) -> Done | None:
        """A charger serves it."""
        answer = seen.answer()
        if answer is None or answer.state not in SERVING:
            return None
        state = words.plain(d.ChargerStateValue, answer.state)
        return Done(f"{answer.charger_name} is {state} for {self.who}")

    def unheard(self, names: frozenset[str]) -> Obstacle:
        """It waits, as far as one can see."""
        if not names:
            silence = "no charger is heard: no daemon of one runs in this domain and network"
            return Obstacle(True, silence, self._loopback())
        cancel = ("send", "charger", ANY, "--queue", "--cancel", self.request_id)
        return Obstacle(
            True,
            f"no charger serves {self.who} yet: it waits in the {COORDINATOR}'s queue"
            " (`rmf-bridge watch` shows it), or was refused (the coordinator's log says why)",
            f"to withdraw the request: {self.line.other(*cancel)}",
        )

    def obstacles(self, seen: Seen) -> Iterable[Obstacle]:
        """What the charger says that has it."""
        text = f"the {COORDINATOR} has not given {self.who} a charger: its log says why"
        return _error(seen.latest()), Obstacle(True, text)


@dataclass(frozen=True, slots=True)
class QueuedCancel(ChargeCancel):
    """A queued request withdrawn; no state shows whether it was there."""

    own = topics.ADAPTER_CHARGER_CANCELS
    listener = COORDINATOR

    def message(self, seen: Seen) -> d.ChargerCancel:
        """By its id, whichever charger it was for."""
        return d.ChargerCancel("", self.request_id)

    def about(self, state: words.Stated) -> bool:
        """No state tells."""
        return False

    def ready(self, seen: Seen) -> bool:
        """Some charger is heard."""
        return bool(seen.names)

    def outcome(self, seen: Seen) -> Done | None:
        """The coordinator was told."""
        if seen.first_sent_at is None:
            return None
        return Done(f"the {COORDINATOR} was told that request {self.request_id} is withdrawn")

    def unheard(self, names: frozenset[str]) -> Obstacle:
        """Nobody was told."""
        return Obstacle(True, f"the {COORDINATOR} could not be told")
