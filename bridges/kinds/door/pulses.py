"""The pulses of a held door, whose operator closes the door by itself after each pulse.

Rules:
DOOR-PULSES-1. The first pulse begins with the hold. A pulse lasts `on_s`, and the next one begins
   `every_s` after its start. Between two pulses the relay is off for REST_S or longer, even if a scan
   comes late. If the time between two pulses is shorter than REST_S, the relay is off for that time.
DOOR-PULSES-2. If a read or write fails during a pulse, the pulse may not have reached the operator. It
   then lasts until `on_s` after the last failure, and the next pulse comes after the shortest rest. So
   a module that ends its pulses by itself gets the next request when the lost pulse must be over,
   because a request within a pulse would prolong it. Failures prolong no pulse beyond `every_s`.
DOOR-PULSES-3. A door without a contact for `opened` is not estimated open before a pulse was written
   without failure. After a failure during a pulse the estimate begins again with the next pulse.
"""

from typing import Final

import msgspec
from msgspec.structs import replace

from bridges.kinds.door.settings import Pulse
from bridges.kinds.shared.durations import NEVER

REST_S: Final = 0.125
"""The least time (s) for which the relay is off before a pulse. The driver and the operator tell two
pulses apart by this rest."""


class DoorPulses(msgspec.Struct, frozen=True):
    """The last pulse of a hold. Times are monotonic seconds.

    `at`: the time when the pulse began. `off_at`: the time when the pulse ended; None during the pulse.
    `failed_at`: the time of the last failed read or write during the pulse; None without one.
    `good_since`: the start of the first pulse since which no pulse has failed; None after a failure.
    """

    at: float
    off_at: float | None = None
    failed_at: float | None = None
    good_since: float | None = None

    @property
    def is_on(self) -> bool:
        """Return whether the relay is on."""
        return self.off_at is None


def advance(pulses: DoorPulses | None, failed: bool, now: float, pulse: Pulse) -> DoorPulses:
    """Begin or end a pulse of a held door if it is due. `failed`: a read or write has failed now.
    `pulses` is None if the hold begins now."""
    pulses = _note(pulses, failed, now) if pulses else None
    if pulses and pulses.is_on and now >= changes_at(pulses, pulse):
        pulses = replace(pulses, off_at=now)
    if pulses and (pulses.is_on or now < changes_at(pulses, pulse)):
        return pulses
    good_since = pulses.good_since if pulses else None
    begun = DoorPulses(now, good_since=now if good_since is None else good_since)
    return _note(begun, failed, now)


def changes_at(pulses: DoorPulses, pulse: Pulse) -> float:
    """Return the time (s) when the pulse ends, or when the next pulse begins."""
    rest_s = min(REST_S, pulse.every_s - pulse.on_s)
    next_at = pulses.at + pulse.every_s
    if pulses.off_at is None:
        since = pulses.at if pulses.failed_at is None else pulses.failed_at
        return min(since + pulse.on_s, next_at - rest_s)
    rested_at = pulses.off_at + rest_s
    return rested_at if pulses.failed_at is not None else max(next_at, rested_at)


def good_since(pulses: DoorPulses | None) -> float:
    """Return the time (s) since which every pulse was written without failure; NEVER without such a
    pulse."""
    return NEVER if pulses is None or pulses.good_since is None else pulses.good_since


def _note(pulses: DoorPulses, failed: bool, now: float) -> DoorPulses:
    if not failed or not pulses.is_on:
        return pulses
    return replace(pulses, failed_at=now, good_since=None)
