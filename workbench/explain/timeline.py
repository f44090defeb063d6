"""A timeline as values, for `plot`, the web page, and JSON by `dataclasses.asdict`.

Times are s on `Heard.at`'s clock. Every text is printable and not too long, and may come from the
network: it is text, never markup.
"""

from dataclasses import dataclass
from typing import Final, Literal

from bridges.messages.words import Kind

LaneName = Literal[
    "sessions", "floors", "door", "motion", "mode", "relays", "inputs", "requests", "faults"
]
LANES: Final[tuple[LaneName, ...]] = (
    "sessions",
    "floors",
    "door",
    "motion",
    "mode",
    "relays",
    "inputs",
    "requests",
    "faults",
)
"""In the order in which they are drawn."""
Tone = Literal["calm", "works", "open", "held", "asks", "wrong", "unknown"]
"""The look of a span, besides its label. calm: at rest. works: moves, charges, is on. open: a robot may
pass. held: somebody's session. asks: somebody requests something. wrong: a fault or hazard.
unknown: not heard."""


@dataclass(frozen=True, slots=True)
class LaneSpan:
    """A value that held from `from_s` to `to_s`."""

    from_s: float
    to_s: float
    label: str
    tone: Tone


@dataclass(frozen=True, slots=True)
class Mark:
    """An event at `at_s`."""

    at_s: float
    label: str
    tone: Tone


@dataclass(frozen=True, slots=True)
class Lane:
    """One row of a lane; its spans never overlap. `row`: a relay, input, requester or fault; "" in a
    lane of one row. `left_out`: the oldest spans and marks, dropped because there were too many.
    """

    name: LaneName
    row: str
    spans: tuple[LaneSpan, ...]
    marks: tuple[Mark, ...]
    left_out: int = 0


@dataclass(frozen=True, slots=True)
class Timeline:
    """One device between two times.

    `wall`: s since the epoch at `from_s`, by the listener's clock. `steps`: the steps of that
    clock. `lanes`: in the order of LANES, only those with messages. `left_out`:
    rows that were dropped.
    """

    kind: Kind
    device: str
    from_s: float
    to_s: float
    wall: float
    lanes: tuple[Lane, ...]
    steps: tuple[Mark, ...] = ()
    left_out: int = 0


@dataclass(frozen=True, slots=True)
class Level:
    """A note of our daemon about its device: from `at` on, `name` is `value` ("": off, or over).

    `lane`: relays (an output and its value), inputs, or faults (a code and its detail).
    """

    at: float
    lane: Literal["relays", "inputs", "faults"]
    name: str
    value: str
