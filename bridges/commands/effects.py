"""When `send` sends, when it is over, and what it says when nothing has come of it.

Pure: `step(wish, so_far, now)`. A request is repeated at 1 Hz until its effect is seen, as RMF does
it. Only a state heard after the first request counts: the one before may show the same for somebody
else's sake. What is wanted of each kind of device is in `wishes.py`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Final, Protocol

from bridges.commands.graph import SILENT_AFTER_S, Heard
from bridges.rmf import words
from bridges.rmf.topics import Topic

REPEAT_S: Final = 1.0
PATIENCE_S: Final = 2.0
"""States come at 1 Hz: whoever has not been heard for two periods is mentioned."""


@dataclass(frozen=True, slots=True)
class SoFar:
    """What has happened since the command began; times are monotonic s.

    `listeners`: subscriptions matched on the request's topic. `states`: our device's, in order.
    `names`: every device of the kind that was heard. `heartbeat`: the door supervisor's latest.
    """

    began_at: float
    timeout_s: float
    listeners: int = 0
    first_sent_at: float | None = None
    last_sent_at: float | None = None
    states: tuple[Heard, ...] = ()
    names: frozenset[str] = frozenset()
    heartbeat: Heard | None = None

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
        """Who holds the door by a heartbeat heard after our first request; None without one."""
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
    """The effect is there."""

    text: str


@dataclass(frozen=True, slots=True)
class Failed:
    """It is not, and this is why."""

    text: str


@dataclass(frozen=True, slots=True)
class Step:
    """One look: a request to send now, something worth saying once, or the end."""

    send: words.Requested | None = None
    hint: str = ""
    outcome: Done | Failed | None = None


class Wish(Protocol):
    """One command's purpose."""

    name: str
    topic: Topic[Any]
    states: Topic[Any]
    nobody: str

    def request(self, so_far: SoFar) -> words.Requested | None:
        """What to send, without its stamp; None while that is not known yet."""

    def outcome(self, so_far: SoFar) -> Done | Failed | None:
        """Whether it is over, as far as the states tell."""

    def reason(self, so_far: SoFar) -> str:
        """Why there is no effect, when the device was heard last a moment ago."""

    def about(self, state: words.Stated) -> bool:
        """Does this state tell anything of it?"""

    def met(self, so_far: SoFar) -> bool:
        """Has the graph been heard, so that a request will be?"""

    def unheard(self, names: frozenset[str]) -> str:
        """Why there is no such state, when these devices were heard."""


class ByName:
    """A wish about the device of this `name`."""

    name: str
    states: Topic[Any]

    def about(self, state: words.Stated) -> bool:
        """It is that device's."""
        return words.device(state) == self.name

    def met(self, so_far: SoFar) -> bool:
        """The device itself."""
        return bool(so_far.states)

    def unheard(self, names: frozenset[str]) -> str:
        """Another is spelt like it, or none is there at all."""
        if not names:
            topic = self.states.name
            return f"nothing is heard on {topic}: is the daemon running, in this domain?"
        there = words.printable(", ".join(sorted(names)))
        found = f"no {self.name!r} on {self.states.name}; there: {there}"
        return f"{found}{nearest(self.name, names)}"


def step(wish: Wish, so_far: SoFar, now: float) -> Step:
    """What to do now."""
    over = wish.outcome(so_far)
    if over is not None:
        return Step(outcome=over)
    if now >= so_far.began_at + so_far.timeout_s:
        return Step(outcome=Failed(reason(wish, so_far, now)))
    hint = _hint(wish, so_far, now)
    return Step(wish.request(so_far), hint) if _may_send(wish, so_far, now) else Step(hint=hint)


def _may_send(wish: Wish, so_far: SoFar, now: float) -> bool:
    if so_far.last_sent_at is not None:
        return now >= so_far.last_sent_at + REPEAT_S
    heard_or_late = wish.met(so_far) or now >= so_far.began_at + PATIENCE_S
    return so_far.listeners > 0 and heard_or_late


def _hint(wish: Wish, so_far: SoFar, now: float) -> str:
    if now < so_far.began_at + PATIENCE_S:
        return ""
    if so_far.first_sent_at is None and so_far.listeners == 0:
        return wish.nobody
    return "" if so_far.states else wish.unheard(so_far.names)


def reason(wish: Wish, so_far: SoFar, now: float) -> str:
    """Why the time ran out, and where to look next."""
    if so_far.first_sent_at is None and so_far.listeners == 0:
        return wish.nobody
    if not so_far.states:
        return wish.unheard(so_far.names)
    silent_s = now - so_far.states[-1].at
    if silent_s > SILENT_AFTER_S:
        return f"{wish.name} fell silent {silent_s:.0f} s ago: is its daemon still running?"
    return f"{wish.reason(so_far)} (last state: {described(so_far.latest())})"


def nearest(name: str, names: Sequence[str] | frozenset[str]) -> str:
    """`; did you mean 'Lift1'?`, or "" when none is spelt like it."""
    folded = {n.lower(): n for n in names}
    near = get_close_matches(name.lower(), folded, n=1, cutoff=0.6)
    return f"; did you mean {folded[near[0]]!r}?" if near else ""


def described(state: words.Stated) -> str:
    """`L1 OPEN AGV, held by fleet/robot`."""
    holder = words.holder(state)
    return words.condition(state) + (f", held by {holder}" if holder else "")


def nobody_listens(topic: Topic[Any], direct: Topic[Any] | None, who: str) -> str:
    """Why nothing was sent; `direct` is the node's own topic where that would be another."""
    hint = f"; --direct speaks to the node itself, on {direct.name}" if direct else ""
    return f"nobody subscribes to {topic.name}: no {who} runs in this domain{hint}"
