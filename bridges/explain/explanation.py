"""An explanation as values: what is asked on one screen, and JSON by `dataclasses.asdict`.

Every text is one printable line; what comes from the network in it is escaped.
"""

from dataclasses import dataclass
from typing import Literal

from bridges.explain.timeline import Kind

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
"""Who has to do the next thing. the device's node: its own daemon, ours or another maker's. the
controller: the lift's, door's or charger's own."""


@dataclass(frozen=True, slots=True)
class Field:
    """One of the things that RMF looks at. `wanted`: by who waits. `met`: it is so. `since`: when it
    became what it is, in words.
    """

    name: str
    shown: str
    wanted: str
    met: bool
    since: str


@dataclass(frozen=True, slots=True)
class Step:
    """The next thing that has to happen, and who has to do it."""

    who: Who
    what: str


@dataclass(frozen=True, slots=True)
class Line:
    """One thing that happened. `at`: s on the recording's steady clock; `wall`: s since the epoch."""

    at: float
    wall: float
    text: str


@dataclass(frozen=True, slots=True)
class FaultTold:
    """A fault that is there, with its remedy where our table knows it."""

    code: str
    detail: str
    since: str
    cause: str = ""
    do: str = ""


@dataclass(frozen=True, slots=True)
class Explanation:
    """One device, at the end of what was heard.

    `now`: sentences, the most important first. `asks`: whose eyes `fields` are seen with. `story`: the
    ride in question; `left_out`: so many of its lines are not in it. `before`: what came before it.
    """

    kind: Kind
    device: str
    heard: str
    now: tuple[str, ...]
    next: tuple[Step, ...]
    asks: str = ""
    fields: tuple[Field, ...] = ()
    faults: tuple[FaultTold, ...] = ()
    notes: tuple[str, ...] = ()
    story: tuple[Line, ...] = ()
    left_out: int = 0
    before: str = ""
