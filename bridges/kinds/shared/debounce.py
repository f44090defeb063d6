"""Debounce: a value is accepted (it counts) after it has stayed unchanged for long enough.

The functions are pure and work on readings. So GPIO pins and polled Modbus inputs use the same
functions. gpiozero's own debounce is not used, because it drops edges and gpiozero's mock pins lack it.
"""

from collections.abc import Iterable
from typing import Any, Final, Generic, TypeVar

import msgspec
from msgspec.structs import replace

from bridges.kinds.shared.durations import NEVER

RESTLESS_S: Final = 2.0
"""The longest time (s), on top of the debounce, that an input may take to settle. An input that takes
longer counts as restless, because of a loose wire, interference, or a bus that fails again and
again."""


def unsteady(names: Iterable[str]) -> str:
    """Return the detail of a fault about these restless inputs."""
    return f"{' and '.join(names)}: not steady within {RESTLESS_S:g} s"


T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


class Settled(msgspec.Struct, Generic[T_co], frozen=True):
    """A debounced input.

    `value`: the accepted value, which counts. `candidate`: the value that has been read since `since`
    (s). It becomes `value` if it lasts. `steady_at`: the time when `value` was last confirmed; None
    before the first confirmation. `torn_since`: the time since which readings have kept changing; None
    if they are steady. `value_since`: the time of the first reading of `value`. Other readings that did
    not last do not change this time. None before the first confirmation.
    """

    value: T_co | None
    candidate: T_co
    since: float
    steady_at: float | None = None
    torn_since: float | None = None
    value_since: float | None = None

    def due_at(self, hold_s: float) -> float:
        """Return the time when the candidate will count if it lasts; inf if it already counts."""
        return NEVER if self.torn_since is None else self.since + hold_s

    def restless_at(self, hold_s: float) -> float:
        """Return the time when the input counts as restless if it does not settle before; inf if it has
        settled."""
        return NEVER if self.torn_since is None else self.torn_since + hold_s + RESTLESS_S


def settle(before: "Settled[T] | None", seen: T, now: float, hold_s: float) -> "Settled[T]":
    """Add one reading. A value counts after it was read for `hold_s` seconds. With `hold_s` 0 every
    value counts at once."""
    if before is None:
        before = Settled(None, seen, now, torn_since=now)
    elif seen != before.candidate:
        torn_since = now if before.torn_since is None else before.torn_since
        before = replace(before, candidate=seen, since=now, torn_since=torn_since)
    if before.torn_since is None or now < before.since + hold_s:
        return before
    goes_on = seen == before.value and before.value_since is not None
    value_since = before.value_since if goes_on else before.since
    return Settled(seen, seen, before.since, steady_at=now, value_since=value_since)


def fear(seen: "Settled[T]", now: float, hold_s: float) -> "Settled[T]":
    """Accept a hazard whose input is restless at this reading. Otherwise a contact that changes faster
    than its debounce would hide the hazard.

    `hold_s`: the debounce (s) of the hazard's begin. An input that has neither settled nor shows the
    hazard is left alone: the bus may have failed again and again since the start.
    """
    shown = seen.value is False or seen.candidate is True
    if seen.value is True or not shown or now < seen.restless_at(hold_s):
        return seen
    return replace(seen, value=True, steady_at=now)


S = TypeVar("S", bound="Settled[Any] | None")


def forget(before: S, *, hazard: bool = False) -> S:
    """Keep the value after a gap in the readings, and restart the candidate's debounce. The time for
    which readings have kept changing goes on. An input that reads None is not wired, so its debounce
    need not restart.

    The debounce of a `hazard` that was read goes on. Otherwise a bus that fails again and again would
    hide the hazard for as long as it fails.
    """
    if before is None or (hazard and before.candidate is True):
        return before
    return replace(before, candidate=before.value)
