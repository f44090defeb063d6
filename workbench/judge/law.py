"""Laws, and what a judge finds about each law. A law is kept, broken, or not seen."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Generic, TypeVar

from bridges.messages import words

S_contra = TypeVar("S_contra", contravariant=True)

LEEWAY_S: Final = 1.0
"""Maximum difference (s) between the arrival times of related messages on two topics."""
LONGEST: Final = 60
"""Maximum length (characters) of a network name in a text."""


class Verdict(StrEnum):
    """The verdict on one law."""

    KEPT = "kept"
    BROKEN = "broken"
    NOT_SEEN = "not seen"


@dataclass(frozen=True, slots=True)
class Doubt:
    """A possible breach of a law. A message that is still on its way may show that there was no breach.

    Topics have no common order on a wire. For example, a lift's state may be heard before the END that
    caused the state. Therefore the judge calls `excused()` after each message, until `leeway_s` has
    passed.
    """

    text: str
    excused: Callable[[], bool]
    leeway_s: float = LEEWAY_S


Finding = str | Doubt | None
"""The result of a law's check of the latest message: a breach as text, a doubt, KEPT, or None. None
means that the message tells nothing about this law."""
KEPT: Final = ""


@dataclass(frozen=True, slots=True)
class Law(Generic[S_contra]):
    """One sentence of RMF's contract, and a check after each message.

    - `occasion`: the event at which a faulty node would break the law. Without such an event, the
      verdict is "not seen".
    - `source`: the reference.
    - `check(history)`: a pure function of the messages heard.
    - `sensed`: whether a correct node may seem to break the law, because an input wire is stuck or
      noisy.
    """

    id: str
    sentence: str
    occasion: str
    reason: str
    source: str
    check: Callable[[S_contra], Finding]
    sensed: bool = False


@dataclass(frozen=True, slots=True)
class Evidence:
    """Evidence of a breach. `at` is in seconds on the messages' clock. `wall` is in seconds since the
    epoch."""

    at: float
    wall: float
    text: str


@dataclass(frozen=True, slots=True)
class JudgedLaw:
    """A law and its verdict. `times` counts how often the law was kept or broken. `evidence` has the
    first few breaches."""

    law: Law[object]
    verdict: Verdict
    times: int = 0
    evidence: tuple[Evidence, ...] = ()


def shown(name: str) -> str:
    """Return a name from the network on one line, in quotes, and cut to LONGEST characters."""
    text = words.printable(name[: LONGEST + 1])
    return f"'{text}'" if len(text) <= LONGEST else f"'{text[:LONGEST]}…'"
