"""Debounce: a reading is believed when it has been seen unchanged for long enough.

Pure and in samples: no vendor option does this for us (gpiozero's own drops edges and its mock has
none), and the same rule serves GPIO pins and polled Modbus inputs.
"""

from dataclasses import dataclass, replace
from typing import Generic, TypeVar, cast

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


@dataclass(frozen=True, slots=True)
class Settled(Generic[T_co]):
    """`value` is believed; `candidate` has been seen since `since` (s).

    `steady_at`: when `value` was last seen with its time behind it; None: nothing is believed yet.
    """

    value: T_co | None
    candidate: T_co
    since: float
    steady_at: float | None = None

    def due_at(self, hold_s: float) -> float:
        """When what is seen will have lasted for `hold_s` if it stays; inf when it has."""
        at = self.since + hold_s
        return float("inf") if self.steady_at is not None and self.steady_at >= at else at


def settle(before: "Settled[T] | None", seen: T, now: float, hold_s: float) -> "Settled[T]":
    """Take one sample. A value must be seen for `hold_s` seconds before it counts; 0: at once."""
    if before is None:
        before = Settled(None, seen, now)
    elif seen != before.candidate:
        before = replace(before, candidate=seen, since=now)
    if now < before.since + hold_s:
        return before
    return Settled(seen, seen, before.since, now)


def forget(before: "Settled[T] | None") -> "Settled[T] | None":
    """After a gap in the readings the value stands, but a half-seen candidate starts again."""
    if before is None or before.steady_at is None:
        return None
    return replace(before, candidate=cast(T, before.value))
