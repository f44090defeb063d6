"""Every request that `send` can make: its message, when it is fulfilled, and why it is not.

Messages and the conditions that fulfil them are those of RMF's fleet adapters (rmf_ros2 9dedd0f).
There is one file for each kind of device; this one has what they share. A request's `obstacles` are a
table, most specific first; the last one always applies.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any, ClassVar, NamedTuple

from bridges.charger.refusals import Refusal
from bridges.commands.graph import CommandLine, Heard
from bridges.rmf import words
from bridges.rmf.topics import AnyTopic


@dataclass(frozen=True, slots=True)
class Seen:
    """What has happened since the command began; times are monotonic s.

    `listeners`: matched subscriptions of the request's topic. `states`: those that concern the
    request, in order. `names`: every device of the kind that was heard. `heartbeat`: the latest of the
    door supervisor. `refusal`: the latest of a charger's that names our request.
    """

    began_at: float
    timeout_s: float
    listeners: int = 0
    first_sent_at: float | None = None
    last_sent_at: float | None = None
    states: tuple[Heard, ...] = ()
    names: frozenset[str] = frozenset()
    heartbeat: Heard | None = None
    refusal: Refusal | None = None

    def latest(self) -> Any:
        """The last state heard, None before the first."""
        return self.states[-1].message if self.states else None

    def answer(self) -> Any:
        """The last state if it was heard after our first request, else None."""
        sent_at = self.first_sent_at
        if sent_at is None or not self.states or self.states[-1].at < sent_at:
            return None
        return self.states[-1].message

    def requesters(self, door: str) -> list[str] | None:
        """Who holds the door, by a heartbeat heard after our first request; None without one."""
        sent_at = self.first_sent_at
        if self.heartbeat is None or sent_at is None or self.heartbeat.at < sent_at:
            return None
        return [
            session.requester_id
            for sessions in self.heartbeat.message.all_sessions
            if sessions.door_name == door
            for session in sessions.sessions
        ]


@dataclass(frozen=True, slots=True)
class Done:
    """The request took effect."""

    text: str


@dataclass(frozen=True, slots=True)
class Failed:
    """The request had no effect; `text` says why."""

    text: str


class Obstacle(NamedTuple):
    """A possible reason why a request has no effect; `remedy`: the command that helps."""

    present: bool
    text: str
    remedy: str = ""


@dataclass(frozen=True, slots=True)
class Request:
    """A request about the device of this `name`: to its daemon if `direct`, else to the supervisor.

    `answers`: topics that are heard beside the states.
    """

    name: str
    direct: bool = field(default=False, kw_only=True)
    line: CommandLine = field(default=CommandLine(), kw_only=True)

    kind: ClassVar[str]
    states: ClassVar[AnyTopic]
    own: ClassVar[AnyTopic]
    adapter: ClassVar[AnyTopic | None] = None
    listener: ClassVar[str] = ""
    answers: ClassVar[tuple[AnyTopic, ...]] = ()

    @property
    def topic(self) -> AnyTopic:
        """The daemon's own topic, or the one that fleet adapters use."""
        return self.own if self.direct or self.adapter is None else self.adapter

    def message(self, seen: Seen) -> words.Requested | None:
        """The message to send, without its stamp; None while it cannot be made yet."""
        raise NotImplementedError

    def outcome(self, seen: Seen) -> Done | Failed | None:
        """The outcome, if the states show one."""
        raise NotImplementedError

    def obstacles(self, seen: Seen) -> Iterable[Obstacle]:
        """Why there is no effect, judged by the last state; the first `present` one counts."""
        raise NotImplementedError

    def about(self, state: words.Stated) -> bool:
        """Whether the state is of this device."""
        return words.device(state) == self.name

    def refused_by(self, refusal: Refusal) -> bool:
        """Whether this answers our request."""
        return False

    def ready(self, seen: Seen) -> bool:
        """Whether the device has been heard."""
        return bool(seen.states)

    def nobody(self) -> Obstacle:
        """No supervisor or daemon listens to the request."""
        silence = f"no node subscribes to {self.topic.name}"
        if self.topic == self.own:
            listener = self.listener or f"{self.kind} daemon"
            return Obstacle(True, f"no {listener} runs in this domain: {silence}", self._loopback())
        there = self.line.again_with("--direct")
        return Obstacle(
            True,
            f"no {self.kind} supervisor runs in this domain: {silence}",
            f"to ask the {self.kind}'s own daemon: {there}",
        )

    def unheard(self, names: frozenset[str]) -> Obstacle:
        """The device has not been heard; perhaps another has a similar name."""
        topic = self.states.name
        if not names:
            here = f"no {self.kind} daemon runs in this domain and network"
            return Obstacle(True, f"nothing is heard on {topic}: {here}", self._loopback())
        there = ", ".join(sorted(names))
        near = nearest(self.name, names)
        return Obstacle(True, f"no '{self.name}' on {topic}; there: {there}{near}")

    def _loopback(self) -> str:
        if "--localhost" in self.line.options:
            return ""
        there = self.line.again_with("--localhost")
        return f"for a simulation on the loopback interface: {there}"


def nearest(name: str, names: Iterable[str]) -> str:
    """`; did you mean 'Lift1'?`, or "" when no name is similar."""
    folded = {n.lower(): n for n in names}
    near = get_close_matches(name.lower(), folded, n=1, cutoff=0.6)
    return f"; did you mean '{folded[near[0]]}'?" if near else ""
