"""Every request that `send` can make. A request has a message, a condition for success, and obstacles,
which are possible reasons for failure.

The messages and conditions are the same as in RMF's fleet adapters (rmf_ros2 9dedd0f). Each kind of
device has a file. This file has the part that all kinds share. `obstacles` returns the most specific
obstacle first. The last obstacle always applies.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import ClassVar, Final, NamedTuple, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from bridges.kinds.charger.refusals import ChargerRefusal, read
from bridges.messages import words
from bridges.messages.definitions import DiagnosticStatus, SupervisorHeartbeat
from bridges.messages.heard import Heard
from bridges.messages.topics import AnyTopic
from bridges.observe.door import listed
from workbench.graph.join import CommandLine

State = TypeVar("State", bound=words.Stated)
NEVER_AT: Final = float("-inf")


class RequestProgress(Struct, frozen=True):
    """Everything that happened after the command began. Times are monotonic (s).

    - `listeners`: number of matched subscriptions on the request's topic.
    - `states`: the states that concern the request, in order. The last state came at `stated_at`.
    - `there`: kind and name of every device heard.
    - `graph`: the name of our graph, in words for people.
    - `hinted`: the hints printed.
    - `heartbeat`: the door supervisor's latest heartbeat, which came at `heartbeat_at`.
    - `told`: the values in the device's own diagnostics, which last came at `told_at`.
    - `refusals`: the chargers' refusals after our first request.
    - `results`: the workcells' results, with their times.
    """

    began_at: float
    timeout_s: float
    listeners: int = 0
    first_sent_at: float | None = None
    last_sent_at: float | None = None
    states: tuple[words.Stated, ...] = ()
    stated_at: float = NEVER_AT
    there: frozenset[tuple[str, str]] = frozenset()
    graph: str = ""
    hinted: frozenset[str] = frozenset()
    heartbeat: SupervisorHeartbeat | None = None
    heartbeat_at: float = NEVER_AT
    told: Mapping[str, str] = {}
    told_at: float = NEVER_AT
    refusals: tuple[ChargerRefusal, ...] = ()
    results: tuple[tuple[float, words.WorkcellResulted], ...] = ()

    def hears(self, heard: Heard, about: Callable[[words.Stated], bool]) -> "RequestProgress":
        """Return the progress after this message. `about(state)` tells whether the state concerns the
        request."""
        message = heard.message
        if isinstance(message, SupervisorHeartbeat):
            return replace(self, heartbeat=message, heartbeat_at=heard.at)
        if isinstance(message, DiagnosticStatus):
            refusal = read(message) if self.first_sent_at is not None else None
            return replace(self, refusals=(*self.refusals, refusal)) if refusal else self
        if isinstance(message, words.WorkcellResulted):
            return replace(self, results=(*self.results[-9:], (heard.at, message)))
        if not isinstance(message, words.Stated):
            return self
        there = self.there | {(words.kind(message), words.device(message))}
        if not about(message):
            return replace(self, there=there)
        return replace(self, there=there, states=(*self.states, message), stated_at=heard.at)

    def names(self, kind: str) -> list[str]:
        """Return every device heard of this kind, sorted."""
        return sorted(name for one, name in self.there if one == kind)

    def sends(self, now: float) -> "RequestProgress":
        """Return the progress after the request is sent now."""
        first = now if self.first_sent_at is None else self.first_sent_at
        return replace(self, first_sent_at=first, last_sent_at=now)

    def states_of(self, kind: type[State]) -> list[State]:
        """Return all states of this type that were heard, in order."""
        return [state for state in self.states if isinstance(state, kind)]

    def answer(self, kind: type[State]) -> State | None:
        """Return the last state if the state came after our first request. Otherwise return None."""
        sent_at = self.first_sent_at
        if sent_at is None or not self.states or self.stated_at < sent_at:
            return None
        return self.states_of(kind)[-1]

    def requesters(self, door: str) -> list[str] | None:
        """Return the door's holders from a heartbeat after our first request. Return None before such a
        heartbeat."""
        sent_at = self.first_sent_at
        if self.heartbeat is None or sent_at is None or self.heartbeat_at < sent_at:
            return None
        return listed(self.heartbeat, door)


WHERE: Final = (
    "is the device in another domain (--domain-id), on another transport (--transport), or on another"
    " machine (without --localhost)? rmf-bridge status on the daemon's machine shows domain and"
    " transport"
)


class Fulfilled(Struct, frozen=True):
    """The request took effect."""

    text: str


class Failed(Struct, frozen=True):
    """The request had no effect. `text` gives the reason."""

    text: str


class Obstacle(NamedTuple):
    """A possible reason why a request has no effect. `present` tells whether this is the reason now.
    `remedy` is the command that helps."""

    present: bool
    text: str
    remedy: str = ""


@dataclass(frozen=True, slots=True)
class Request(ABC):
    """A request about the device `name`. With `direct`, the request goes to the device's daemon, and
    otherwise to the supervisor.

    `answers` lists topics to hear besides the states.
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
        """The request's topic. With `direct`, this is the daemon's own topic, and otherwise the fleet
        adapters' topic."""
        return self.own if self.direct or self.adapter is None else self.adapter

    @property
    def watched_s(self) -> float:
        """Time (s) to watch the device after the outcome."""
        return 0.0

    @abstractmethod
    def message(self, seen: RequestProgress) -> words.Requested | None:
        """Return the message to send. The sender adds the time stamp. Return None if there is not yet
        enough information for the message."""

    @abstractmethod
    def outcome(self, seen: RequestProgress) -> Fulfilled | Failed | None:
        """Return the outcome. Return None as long as the states show no outcome."""

    @abstractmethod
    def obstacles(self, seen: RequestProgress) -> Iterable[Obstacle]:
        """Return the possible reasons why the request has no effect. The first reason that is `present`
        is the true one."""

    @property
    def supervisor(self) -> AnyTopic | None:
        """A topic that only a supervisor publishes, or None if the request needs no supervisor."""
        return None

    def goes_direct(self, seen: RequestProgress, now: float) -> bool:
        """Return whether to ask the device's own daemon now, because the supervisor does nothing."""
        return False

    def about(self, state: words.Stated) -> bool:
        """Return whether the state comes from this device."""
        return (words.kind(state), words.device(state)) == (self.kind, self.name)

    def ready(self, seen: RequestProgress) -> bool:
        """Return whether the device has been heard."""
        return bool(seen.states)

    def misnamed(self, seen: RequestProgress) -> str:
        """Return the other kind of device that has this name. Return "" if no such device was heard."""
        if self.ready(seen):
            return ""
        kinds = sorted(kind for kind, name in seen.there if name == self.name and kind != self.kind)
        if not kinds:
            return ""
        there = f"rmf-bridge send {kinds[0]} --help"
        return f"{self.name} is a {' and a '.join(kinds)}, not a {self.kind}; {there}"

    def nobody(self, seen: RequestProgress) -> Obstacle:
        """Return the obstacle that no supervisor or daemon subscribes to the request."""
        silence = f"no node subscribes to {self.topic.name}"
        if self.supervisor is not None:
            silence = f"no node publishes {self.supervisor.name}"
        who = f"{self.kind} supervisor"
        if self.topic == self.own:
            who = self.listener or f"{self.kind} daemon"
        text = f"no {who} runs in this domain: {silence}; {self._hears(seen)}"
        if self.topic == self.own or self.name not in seen.names(self.kind):
            return Obstacle(True, text, self._elsewhere(seen))
        there = self.line.again_with("--direct")
        return Obstacle(True, text, f"to ask the {self.kind}'s own daemon: {there}")

    def unheard(self, seen: RequestProgress) -> Obstacle:
        """Return the obstacle that the device has not been heard. Suggest a similar name."""
        topic, names = self.states.name, seen.names(self.kind)
        if not names:
            text = f"no {self.kind} is heard on {topic}; {self._hears(seen)}"
            return Obstacle(True, text, self._elsewhere(seen))
        return Obstacle(True, f"no '{self.name}' on {topic}; {self._hears(seen)}")

    def _hears(self, seen: RequestProgress) -> str:
        """Name the heard devices of this kind. If there are none, name all heard devices. If no device
        was heard, name the graph."""
        if names := seen.names(self.kind):
            near = "" if self.name in names else nearest(self.name, names)
            return f"{self.kind}s heard: {', '.join(names)}{near}"
        if seen.there:
            return f"heard: {', '.join(map(' '.join, sorted(seen.there)))}"
        return f"nothing is heard{seen.graph and f' by {seen.graph}'}"

    def _elsewhere(self, seen: RequestProgress) -> str:
        """Suggest other places to look for the device: loopback, another domain, another transport."""
        if self._loopback():
            return self._loopback()
        return "" if seen.there else WHERE

    def _loopback(self) -> str:
        if "--localhost" in self.line.options:
            return ""
        there = self.line.again_with("--localhost")
        return f"for a simulation on the loopback interface: {there}"


def nearest(name: str, names: Iterable[str]) -> str:
    """Return a text such as `; did you mean 'Lift1'?`. Return "" if no name is similar."""
    folded = {n.lower(): n for n in names}
    near = get_close_matches(name.lower(), folded, n=1, cutoff=0.6)
    return f"; did you mean '{folded[near[0]]}'?" if near else ""
