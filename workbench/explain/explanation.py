"""An explanation as values: for one screen of text, and for JSON by `dataclasses.asdict`.

Every text is one printable line; parts from the network are escaped.
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
"""The party that has to act next. `the device's node`: its daemon, ours or another maker's.
`the controller`: that of the lift, door or charger itself."""


@dataclass(frozen=True, slots=True)
class CheckedField:
    """One of RMF's conditions. `wanted`: the value the requester waits for. `met`: is it so?
    `since`: beginning of the present value, in words.
    """

    name: str
    shown: str
    wanted: str
    met: bool
    since: str


@dataclass(frozen=True, slots=True)
class NextStep:
    """The next step, and the party that has to act."""

    who: Who
    what: str


@dataclass(frozen=True, slots=True)
class StoryLine:
    """One event. `at`: s on the recording's steady clock; `wall`: s since the epoch."""

    at: float
    wall: float
    text: str


@dataclass(frozen=True, slots=True)
class FaultTold:
    """A present fault, with its remedy if our table has one."""

    code: str
    detail: str
    since: str
    cause: str = ""
    do: str = ""


@dataclass(frozen=True, slots=True)
class Explanation:
    """The explanation of one device, at the last message.

    `now`: sentences, the most important first. `asks`: the requester of `fields`. `story`: the
    ride in question; `left_out`: number of its lines missing. `before`: the events before it.
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
