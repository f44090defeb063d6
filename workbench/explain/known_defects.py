"""Known defects of RMF, each with its issue. A note appears only if the messages leave no doubt.

Three other defects never appear in a note, because messages of lifts and doors cannot prove them:

- #389: a robot enters without a session.
- PR#490: a defect of mutex groups.
- Jazzy: RequestLift accepts a matching state although the lift has not arrived.
"""

from collections.abc import Callable, Iterator
from typing import Final

from bridges.observe.lift import NOBODY, ObservedLift
from bridges.observe.limits import REQUESTER_SILENT_S
from bridges.observe.requesters import Moment
from workbench.explain.device import Device

SPAM: Final = 10
"""Number of END requests that shows a defect. A correct adapter sends one END, or repeats END a few
times until the next state."""


def _calls_back(lift: ObservedLift, now: Moment) -> str:
    one = lift.requesters.get(lift.session.value)
    if one is None or one.boarded is None or one.met is not None or lift.mode.value != "AGV":
        return ""
    back = one.wants == one.boarded_at and one.given_up not in ("", one.wants)
    return one.who if back and one.asks(now) else ""


def _taken_away(lift: ObservedLift, now: Moment) -> str:
    one = lift.requesters.get(lift.taken_from)
    return one.who if one is not None and one.asks(now) and lift.session.value != NOBODY else ""


def _ends_for_ever(lift: ObservedLift, now: Moment) -> str:
    count, who, last = lift.idle_ends
    return who if count >= SPAM and now.at - last.at <= REQUESTER_SILENT_S else ""


PATTERNS: Final[tuple[tuple[Callable[[ObservedLift, Moment], str], str], ...]] = (
    (
        _calls_back,
        "In mid-ride {who} calls the car back to the floor where the robot got in: a known defect of"
        " fleet adapters that replan (rmf_ros2#555, mended by PR#556).",
    ),
    (
        _taken_away,
        "The lift's node has taken the session from {who} without END. After that, RMF's robots wait"
        " for ever: a known defect (rmf_ros2#314).",
    ),
    (
        _ends_for_ever,
        "{who} sends END again and again for a session that the lift does not show: a known defect of"
        " fleet adapters (rmf_ros2#382, #415).",
    ),
)
"""Pairs of a function and a sentence, one pair for each defect. The function returns the affected
requester, or ""."""


def notes(device: Device, now: Moment) -> Iterator[str]:
    """Yield a note for each known defect that this device's messages show."""
    waits = any(one.ended is None and not one.gone for one in device.requesters)
    if device.kind != "charger" and waits and (device.state is None or device.is_silent(now)):
        yield (
            "RMF has no timeout: robots wait for ever for a silent lift or door (rmf_ros2#472, #248)."
        )
    if isinstance(device, ObservedLift):
        found = ((pattern(device, now), text) for pattern, text in PATTERNS)
        yield from (text.format(who=who) for who, text in found if who)
