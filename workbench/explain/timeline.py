"""A timeline as values, for `plot`, the web page, and JSON through `dataclasses.asdict`.

Times are seconds on `Heard.at`'s clock. Every text is printable and has a limited length. Never use a
text as markup, because the text may come from the network.
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
"""Names of the lanes, in the order of drawing."""
Tone = Literal["calm", "works", "open", "held", "asks", "wrong", "unknown"]
"""The meaning of a span's colour and pattern.

- calm: the device rests.
- works: the device moves, charges or is on.
- open: a robot may pass.
- held: a requester has a session.
- asks: a requester sends requests.
- wrong: there is a fault or hazard.
- unknown: nothing was heard.
"""


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
    """One row of a lane. The spans of a row never overlap.

    - `row`: name of a relay, input, requester or fault; "" if the lane has only one row.
    - `left_out`: number of old spans and marks that the row dropped, because there were too many.
    """

    name: LaneName
    row: str
    spans: tuple[LaneSpan, ...]
    marks: tuple[Mark, ...]
    left_out: int = 0


@dataclass(frozen=True, slots=True)
class Timeline:
    """One device between two times.

    - `wall`: the time at `from_s`, in seconds since the epoch, on the listener's clock.
    - `steps`: the steps of the listener's clock.
    - `lanes`: lanes with messages, in the order of LANES.
    - `left_out`: number of dropped rows.
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
    """A change that our daemon noted about its device. From `at` on, `name` has the value `value`. The
    value "" means off or over.

    `lane` is `relays`, `inputs` or `faults`. For a relay, `value` is the output's value. For a fault,
    `name` is the code and `value` is the detail.
    """

    at: float
    lane: Literal["relays", "inputs", "faults"]
    name: str
    value: str
