"""Assign a charger to a robot, or cancel the assignment. The request goes to the charger's daemon or to
the coordinator's queue."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, Final

from bridges.kinds.charger.refusals import OCCUPIED
from bridges.messages import definitions as d
from bridges.messages import topics, words
from bridges.messages.stamps import duration
from bridges.messages.topics import AnyTopic
from workbench.graph.requests import Failed, Fulfilled, Obstacle, Request, RequestProgress

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
class RobotCharge(_Charger):
    """A request that assigns the charger to a robot. `send` makes up the request's id."""

    fleet: str
    robot: str
    request_id: str
    start_timeout_s: float

    own: ClassVar[AnyTopic] = topics.CHARGER_REQUESTS
    answers: ClassVar[tuple[AnyTopic, ...]] = (topics.CHARGER_REFUSALS,)

    def message(self, seen: RequestProgress) -> d.ChargerRequest:
        """Return the request. The request's id is always the same, so a repeat is no new request."""
        charger = "" if self.name == ANY else self.name
        limit = duration(self.start_timeout_s)
        return d.ChargerRequest(charger, self.fleet, self.robot, limit, self.request_id)

    def outcome(self, seen: RequestProgress) -> Fulfilled | Failed | None:
        """Return Fulfilled if a state with our request's id shows that the charger serves the robot.
        Return Failed after a refusal."""
        answer = seen.answer(d.ChargerState)
        if answer is None or answer.state not in SERVING or answer.request_id != self.request_id:
            return self._refused(seen)
        state = words.plain(d.ChargerStateValue, answer.state)
        return Fulfilled(f"{self.name} is {state} for request {self.request_id}")

    def _refused(self, seen: RequestProgress) -> Failed | None:
        refusal = next((r for r in seen.refusals if r.request_id == self.request_id), None)
        if refusal is None:
            return None
        text = f"{refusal.charger or self.name} refuses the request: {refusal.text}"
        if refusal.reason != OCCUPIED or not refusal.held_request:
            return Failed(text)
        cancel = ("send", "charger", refusal.charger, "--cancel", refusal.held_request)
        return Failed(f"{text}; to cancel that request: {self.line.other(*cancel)}")

    def obstacles(self, seen: RequestProgress) -> Iterable[Obstacle]:
        """Return the obstacles: the charger is in ERROR, serves another request, or did not accept this
        request."""
        state = seen.states_of(d.ChargerState)[-1]
        cancel = self.line.other("send", "charger", self.name, "--cancel", state.request_id)
        return (
            _error(state),
            Obstacle(
                state.request_id not in ("", self.request_id),
                f"{self.name} serves request {state.request_id}",
                f"to cancel that request: {cancel}",
            ),
            Obstacle(True, f"{self.name} did not accept the request: see its daemon's log"),
        )


def _error(state: d.ChargerState) -> Obstacle:
    failed = state.state == d.ChargerStateValue.CHARGER_ERROR
    return Obstacle(failed, f"{state.charger_name} reports an error: {state.error_message}")


@dataclass(frozen=True, slots=True)
class ChargeCancel(_Charger):
    """A request to cancel the charge that the charger serves."""

    request_id: str

    own: ClassVar[AnyTopic] = topics.CHARGER_CANCELS

    def message(self, seen: RequestProgress) -> d.ChargerCancel:
        """Return the ChargerCancel for this request id."""
        return d.ChargerCancel(self.name, self.request_id)

    def outcome(self, seen: RequestProgress) -> Fulfilled | Failed | None:
        """Return Fulfilled when the charger no longer serves the request that it served before. Return
        Failed if the charger never served this request."""
        answer = seen.answer(d.ChargerState)
        if answer is None or self._holds(answer):
            return None
        if any(map(self._holds, seen.states_of(d.ChargerState))):
            return Fulfilled(f"{self.name} no longer serves request {self.request_id}")
        state = words.described(answer)
        return Failed(f"{self.name} does not serve request '{self.request_id}' (state: {state})")

    def _holds(self, state: d.ChargerState) -> bool:
        released = (d.ChargerStateValue.CHARGER_IDLE, d.ChargerStateValue.CHARGER_RELEASED)
        return state.request_id == self.request_id and state.state not in released

    def obstacles(self, seen: RequestProgress) -> Iterable[Obstacle]:
        """Return the only obstacle: the charger still serves the request."""
        text = f"{self.name} still serves request {self.request_id}: see its daemon's log"
        return (Obstacle(True, text),)


COORDINATOR: Final = "charger coordinator"


@dataclass(frozen=True, slots=True)
class QueuedCharge(RobotCharge):
    """A request to the coordinator for a charger. `name` is the wanted charger, or ANY for any
    charger."""

    own = topics.ADAPTER_CHARGER_REQUESTS
    listener = COORDINATOR

    @property
    def who(self) -> str:
        """The robot as FLEET/ROBOT."""
        return f"{self.fleet}/{self.robot}"

    def about(self, state: words.Stated) -> bool:
        """Return whether the state is from a charger that serves this robot. A charger that is RELEASED
        served the robot before this request."""
        return (
            isinstance(state, d.ChargerState)
            and (state.robot_fleet, state.robot_name) == (self.fleet, self.robot)
            and state.state != d.ChargerStateValue.CHARGER_RELEASED
        )

    def ready(self, seen: RequestProgress) -> bool:
        """Return whether any charger has been heard."""
        return bool(seen.names(self.kind))

    def outcome(self, seen: RequestProgress) -> Fulfilled | Failed | None:
        """Return Fulfilled after a charger serves the robot. Return Failed if the coordinator refuses,
        even if a charger still serves an earlier request of the robot."""
        if refused := self._refused(seen):
            return refused
        answer = seen.answer(d.ChargerState)
        if answer is None or answer.state not in SERVING:
            return None
        state = words.plain(d.ChargerStateValue, answer.state)
        return Fulfilled(f"{answer.charger_name} is {state} for {self.who}")

    def unheard(self, seen: RequestProgress) -> Obstacle:
        """Explain why no charger serves the robot yet. The robot may wait in the queue, or the
        coordinator may have refused the request."""
        if not seen.names(self.kind):
            return super(QueuedCharge, self).unheard(seen)
        cancel = ("send", "charger", ANY, "--queue", "--cancel", self.request_id)
        return Obstacle(
            True,
            f"no charger serves {self.who} yet: the robot waits in the {COORDINATOR}'s queue"
            f" (see `{self.line.other('watch')}`), or the request was refused (see the"
            " coordinator's log)",
            f"to withdraw the request: {self.line.other(*cancel)}",
        )

    def obstacles(self, seen: RequestProgress) -> Iterable[Obstacle]:
        """Return the obstacles: the charger is in ERROR, or the coordinator has not assigned a
        charger."""
        text = f"the {COORDINATOR} has not assigned {self.who} a charger: see the coordinator's log"
        return _error(seen.states_of(d.ChargerState)[-1]), Obstacle(True, text)


@dataclass(frozen=True, slots=True)
class QueuedCancel(ChargeCancel):
    """A request to cancel a queued request. RMF has no state that shows the queue, so `send` cannot
    check whether the request was in the queue."""

    own = topics.ADAPTER_CHARGER_CANCELS
    listener = COORDINATOR

    def message(self, seen: RequestProgress) -> d.ChargerCancel:
        """Return the ChargerCancel for this request id, for any charger."""
        return d.ChargerCancel("", self.request_id)

    def about(self, state: words.Stated) -> bool:
        """Return False, because no state shows a queued request."""
        return False

    def ready(self, seen: RequestProgress) -> bool:
        """Return whether any charger has been heard."""
        return bool(seen.names(self.kind))

    def outcome(self, seen: RequestProgress) -> Fulfilled | None:
        """Return Fulfilled after the cancel has been sent."""
        if seen.first_sent_at is None:
            return None
        return Fulfilled(f"the {COORDINATOR} was told that request {self.request_id} is withdrawn")

    def unheard(self, seen: RequestProgress) -> Obstacle:
        """Explain that the cancel was never sent."""
        return Obstacle(True, f"the cancel was not sent: no {COORDINATOR} listens")
