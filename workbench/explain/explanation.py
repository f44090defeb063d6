"""An explanation as values: for one screen of text, and for JSON by `dataclasses.asdict`.

Every text is one printable line; what comes from the network in it is escaped.
"""

from dataclasses import dataclass
from typing import Literal

from bridges.messages.words import Kind

Who = Literal[
    "nobody",
    "the robot",
    "the fleet adapter",
    "the supervisor",
    "the coordinator",
    "the device's node",
    "the controller",
    "a person",
]
"""Who has to act next. `the device's node`: its daemon, ours or another maker's. `the controller`: that
of the lift, door or charger itself."""


@dataclass(frozen=True, slots=True)
class CheckedField:
    """One of the things that RMF checks. `wanted`: what the requester waits for. `met`: it is so.
    `since`: when it became what it is, in words.
    """

    name: str
    shown: str
    wanted: str
    met: bool
    since: str


@dataclass(frozen=True, slots=True)
class NextStep:
    """What has to happen next, and who has to do it."""

    who: Who
    what: str


@dataclass(frozen=True, slots=True)
class StoryLine:
    """One thing that happened. `at`: s on the recording's steady clock; `wall`: s since the epoch."""

    at: float
    wall: float
    text: str


@dataclass(frozen=True, slots=True)
class FaultTold:
    """A present fault, with its remedy where our table has one."""

    code: str
    detail: str
    since: str
    cause: str = ""
    do: str = ""


@dataclass(frozen=True, slots=True)
class Explanation:
    """One device, at the end of what was heard.

    `now`: sentences, the most important first. `asks`: the requester that `fields` are about. `story`:
    the ride in question; `left_out`: how many of its lines are missing. `before`: what came before it.
    """

    kind: Kind
    device: str
    heard: str
    now: tuple[str, ...]
    next: tuple[NextStep, ...]
    asks: str = ""
    fields: tuple[CheckedField, ...] = ()
    faults: tuple[FaultTold, ...] = ()
    notes: tuple[str, ...] = ()
    story: tuple[StoryLine, ...] = ()
    left_out: int = 0
    before: str = ""
