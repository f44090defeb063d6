"""An explanation as values, for one screen of text, and for JSON through `dataclasses.asdict`.

Every text is one printable line. Texts from the network are escaped.
"""

from dataclasses import dataclass
from typing import Literal

from bridges.messages.words import Kind

Explained = Kind | Literal["robot"]
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
"""The party that has to act next.

`the device's node` is the daemon of the device. This daemon may be ours or another program. `the
controller` is the controller that the manufacturer built into the lift, door or charger.
"""


@dataclass(frozen=True, slots=True)
class CheckedField:
    """One of the fields that RMF checks.

    - `wanted`: the value that the requester waits for.
    - `met`: whether the present value satisfies RMF.
    - `since`: the beginning of the present value, in words.
    """

    name: str
    shown: str
    wanted: str
    met: bool
    since: str


@dataclass(frozen=True, slots=True)
class NextStep:
    """The next step, and the party that has to take the step."""

    who: Who
    what: str


@dataclass(frozen=True, slots=True)
class StoryLine:
    """One event of the story. `at` is in seconds on the recording's steady clock. `wall` is in seconds
    since the epoch."""

    at: float
    wall: float
    text: str


@dataclass(frozen=True, slots=True)
class FaultTold:
    """A present fault. If `faults.yaml` has the fault, the fault has a remedy."""

    code: str
    detail: str
    since: str
    cause: str = ""
    do: str = ""


@dataclass(frozen=True, slots=True)
class Explanation:
    """The explanation of one device or robot, at the time of the last message.

    - `kind`: "device" for a name from which nothing was heard.
    - `now`: sentences, the most important first.
    - `asks`: the requester who waits for `fields`.
    - `story`: the events of the explained ride.
    - `left_out`: the number of story lines that were dropped.
    - `before`: a summary of the earlier events.
    """

    kind: Explained | Literal["device"]
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
