"""The activity of a station on contacts, after the debounce of its contacts.

Only a driver on contacts has a debounce. The readings of every other station count at once.

CHARGER-SENSING-1. A change of the activity counts when it has been read for the debounce of the
   contacts behind it. So a bounce ends no request, frees no station, and puts no station out of
   service. After the start, and after a station was unreachable, the station counts as not read until
   its contacts have settled.
CHARGER-SENSING-2. The power does not wait for the debounce. It is off in each scan whose reading shows
   a fault, a pad below its height, or a robot out of range.
CHARGER-SENSING-3. If the pad leaves its height while the station charges, the power goes off, and this
   may end the charge before the debounce of `at_height` is over. The pad has then still left its height
   under power, unless `at_height` comes back within its debounce.
CHARGER-SENSING-4. If the contacts do not settle within their debounce and RESTLESS_S, the next reading
   that differs counts at once.
"""

from collections.abc import Mapping
from typing import Final

from msgspec.structs import replace

from bridges.kinds.charger import pad
from bridges.kinds.charger.memory import ChargerLimits, ChargerMemory
from bridges.kinds.charger.signals import AT_FAULT, Activity, ChargerSample, Measured
from bridges.kinds.shared.debounce import Settled, settle
from bridges.kinds.shared.durations import NEVER

Meaning = Settled[ChargerSample]
"""A debounced reading, without its measurements and its code."""
CONTACTS: Final[Mapping[Activity, str]] = {
    Activity.CHARGING: "charging",
    Activity.RELEASED: "ready",
    Activity.ERROR: "fault",
}
"""The contact that gives an activity. No contact of its own gives any other activity."""


def settled(
    before: Meaning | None, sample: ChargerSample, now: float, limits: ChargerLimits
) -> Meaning:
    """Add one reading, as `pad.judged` returns it."""
    seen = replace(sample, code="", measured=Measured())
    if before is not None and sample.measured.at_height is False and _height_in_doubt(before):
        seen = before.candidate
    hold_s = _hold_s(before, seen, limits)
    after = settle(before, seen, now, hold_s)
    if seen != after.value and now >= after.restless_at(hold_s):
        return Settled(seen, seen, now, steady_at=now)
    return after


def as_settled(sample: ChargerSample, accepted: ChargerSample) -> ChargerSample:
    """Return the reading with the accepted activity in place of its own."""
    return replace(accepted, code=sample.code, measured=sample.measured)


def shows_fault(memory: ChargerMemory) -> bool:
    """Return whether the newest reading shows a fault. The debounce of the fault does not matter."""
    return memory.contacts is not None and memory.contacts.candidate.activity in AT_FAULT


def settles_at(memory: ChargerMemory, limits: ChargerLimits) -> float:
    """Return the time (s) when the newest reading counts if it lasts; inf if it counts already."""
    contacts = memory.contacts
    if contacts is None:
        return NEVER
    return contacts.due_at(_hold_s(contacts, contacts.candidate, limits))


def _height_in_doubt(before: Meaning) -> bool:
    was_charging = before.value is not None and before.value.activity is Activity.CHARGING
    return was_charging and before.candidate.error_text == pad.HEIGHT_LOST_TEXT


def _hold_s(before: Meaning | None, seen: ChargerSample, limits: ChargerLimits) -> float:
    """Return the time (s) for which `seen` must last before it counts."""
    if before is None or before.value is None:
        return max(limits.debounce.values())
    return max(limits.debounce.get(_contact(one), 0.0) for one in (before.value, seen))


def _contact(meaning: ChargerSample) -> str:
    if meaning.error_text == pad.HEIGHT_LOST_TEXT:
        return "at_height"
    return CONTACTS.get(meaning.activity, "")
