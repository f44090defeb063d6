"""Laws, and a judge's findings: kept, broken, or not seen."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Generic, TypeVar

from bridges.messages import words

S_contra = TypeVar("S_contra", contravariant=True)

LEEWAY_S: Final = 1.0
"""Greatest difference (s) in the arrival of two topics."""
LONGEST: Final = 60
"""Limit of a network name's length when shown."""


class Verdict(StrEnum):
    """The verdict on one law."""

    KEPT = "kept"
    BROKEN = "broken"
    NOT_SEEN = "not seen"


@dataclass(frozen=True, slots=True)
class Doubt:
    """A law looks broken, unless a message still on its way explains it.

    Topics have no common order on a wire: a lift's state may be heard before the END that caused it.
    `excused()` is called again at each message, for `leeway_s`.
    """

    text: str
    excused: Callable[[], bool]
    leeway_s: float = LEEWAY_S


Finding = str | Doubt | None
"""A law's finding in the latest message: the breach, KEPT, or None without an occasion to break it."""
KEPT: Final = ""


@dataclass(frozen=True, slots=True)
class Law(Generic[S_contra]):
    """One sentence of RMF's contract, and its check after each message.

    `occasion`: the event in which a wrong node would break it; without that event it is not seen.
    `source`: its reference. `check(history)`: a pure function of the messages heard.
    `sensed`: a stuck or noisy wire below a correct node can break it too.
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
    """Evidence of a breach. `at`: s on the messages' clock; `wall`: s since the epoch."""

    at: float
    wall: float
    text: str


@dataclass(frozen=True, slots=True)
class JudgedLaw:
    """A law and its verdict. `times`: how often it was kept or broken; `evidence`: the first few."""

    law: Law[object]
    verdict: Verdict
    times: int = 0
    evidence: tuple[Evidence, ...] = ()


def shown(name: str) -> str:
    """A name from the network: on one line, quoted, and never longer than a line."""
    text = words.printable(name[: LONGEST + 1])
    return f"'{text}'" if len(text) <= LONGEST else f"'{text[:LONGEST]}…'"
