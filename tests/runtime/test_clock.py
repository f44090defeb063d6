import math

import pytest

from bridges.messages.definitions import Time
from bridges.messages.stamps import ClockError
from bridges.runtime.clock import Clock, PublishPace


def test_a_stamp_is_the_wall_clock_now_less_the_age_of_the_reading_and_0_for_never() -> None:
    clock = Clock(lambda: 100.0, lambda: 1000.0)
    assert clock.stamp(97.5) == Time(997, 500_000_000)
    assert clock.stamp(None) == Time(0, 0)


@pytest.mark.parametrize("wall", [2.0**31, 2.0**40, math.inf, math.nan])
def test_a_clock_past_2038_is_an_error_by_name(wall: float) -> None:
    assert Clock(lambda: 0.0, lambda: 2.0**31 - 1).stamp(0.0) == Time(2**31 - 1, 0)
    with pytest.raises(ClockError, match=r"past 2038-01-19.*set the clock"):
        Clock(lambda: 0.0, lambda: wall).stamp(0.0)


def test_a_state_is_due_each_second_and_at_once_when_it_changes_but_10_times_a_second_at_most() -> (
    None
):
    pace = PublishPace()
    assert pace.due_at("IDLE") < 0.0
    pace.published("IDLE", 5.0)
    assert (pace.due_at("IDLE"), pace.due_at("CHARGING")) == (6.0, 5.1)
