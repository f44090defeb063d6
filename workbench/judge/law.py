"""What a law is, and what a judge finds: kept, broken, or not seen."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Generic, TypeVar

from bridges.messages import words

S_contra = TypeVar("S_contra", contravariant=True)

LONGEST: Final = 60
"""A name from the network is shown no longer than this."""


class Verdict(StrEnum):
    """The verdict on one law."""

    KEPT = "kept"
    BROKEN = "broken"
    NOT_SEEN = "not seen"


@dataclass(frozen=True, slots=True)
class Doubt:
    """It looks broken, unless a message that is on its way still explains it.

    Topics have no common order on a wire: a lift's state may be heard before the END that caused it.
    `excused()` is called again at each message, for `LEEWAY_S`.
    """

    text: str
    excused: Callable[[], bool]


Finding = str | Doubt | None
"""What a law finds in the latest message: how it breaks the law, KEPT, or None if it does not apply."""
KEPT: Final = ""


@dataclass(frozen=True, slots=True)
class Law(Generic[S_contra]):
    """One sentence of RMF's contract, and how it is checked after each message.

    `source`: where it can be read. `check(history)`: a pure function of what has been heard.
    `sensed`: a stuck or noisy wire below a correct node can break it too.
    """

    id: str
    sentence: str
    reason: str
    source: str
    check: Callable[[S_contra], Finding]
    sensed: bool = False


@dataclass(frozen=True, slots=True)
class Evidence:
    """What breaks a law. `at`: s on the clock of what was heard; `wall`: s since the epoch."""

    at: float
    wall: float
    text: str


@dataclass(frozen=True, slots=True)
class JudgedLaw:
    """A law and what was found. `times`: how often it was kept or broken; `evidence`: the first few."""

    law: Law[object]
    verdict: Verdict
    times: int = 0
    evidence: tuple[Evidence, ...] = ()


def shown(name: str) -> str:
    """A name from the network: on one line, quoted, and never longer than a line."""
    text = words.printable(name[: LONGEST + 1])
    return f"'{text}'" if len(text) <= LONGEST else f"'{text[:LONGEST]}…'"
