"""DOOR-1: the grace (the delay between CLOSE and the release) limits how often the relay switches.

The grace may make a hold longer, but it never delays or refuses a hold.
"""

import pytest

from bridges.kinds.door.signals import DoorOutputs
from bridges.kinds.shared.decision import IoFailed, RivalSeen
from tests.kinds.door.virtual import CLOSED, CLOSES, OPEN, OPENS, CoreAlone, limits

HELD, OFF = DoorOutputs(hold_open=True), DoorOutputs(hold_open=False)


def held() -> CoreAlone:
    core = CoreAlone(limits(close_grace_s=2.0))
    core.sees(CLOSED, until=1.0)
    assert core.hears(OPENS).outputs == HELD
    return core


def test_open_and_close_at_any_rate_switch_the_relay_no_faster_than_the_grace() -> None:
    core = held()
    for scan in range(80):
        core.hears(CLOSES)
        core.sees(OPEN, until=1.0 + scan / 8)
        core.hears(OPENS)
    switched = [at for at, _, on in core.told if not on and at > 1.0]
    assert len(switched) <= 5


def test_a_close_is_obeyed_when_the_grace_is_over() -> None:
    core = held()
    assert core.hears(CLOSES).outputs == HELD
    core.sees(OPEN, until=6.0)
    assert [(at, on) for at, _, on in core.told][-1] == (3.0, False)


def test_no_open_request_waits_for_the_grace() -> None:
    core = held()
    core.hears(CLOSES)
    core.sees(OPEN, until=3.5)
    assert core.hears(OPENS).outputs == HELD


@pytest.mark.parametrize("event", [IoFailed("gone"), RivalSeen()])
def test_a_lost_reading_or_a_rival_ends_a_hold_within_the_grace(
    event: IoFailed | RivalSeen,
) -> None:
    core = held()
    core.now = 2.5
    assert core.hears(event).outputs == OFF
