"""An open door in a hazard. RMF ignores the mode, so it lets a robot in that is still outside."""

import pytest

from tests.workbench.explain.heard_lift import (
    CLOSED,
    EMERGENCY,
    FIRE,
    OFFLINE,
    OPEN,
    RED,
    asks,
    each_second,
    explained,
    shows,
)

OUTSIDE = ("a person", f"keep {RED} out of the car, and look whether it has driven in")
UNKNOWN = ("a person", f"look where {RED} is: keep it out of the car, or let it drive out")
INSIDE = ("the robot", f"{RED} has to drive out")


def first_step(mode: int, *, boards: bool = False, from_s: float = 0.0) -> tuple[str, str]:
    """Return who has to act first, and how. RED asks for L1. The hazard comes at 20 s, and the door is
    open at L1 from 25 s on. If RED boards, the door was open there before the hazard."""
    before = OPEN if boards else CLOSED
    lines = [
        *each_second(0, 5, lambda s: shows(s, floor="L3")),
        *each_second(4.1, 40, lambda s: asks(s, "L1")),
        *each_second(5, 15, lambda s: shows(s, RED, "L3")),
        *each_second(15, 20, lambda s: shows(s, RED, "L1", before)),
        *each_second(20, 25, lambda s: shows(s, RED, "L1", CLOSED, mode)),
        *each_second(25, 40, lambda s: shows(s, RED, "L1", OPEN, mode)),
    ]
    step = explained(line for line in lines if line.at >= from_s).next[0]
    return step.who, step.what


@pytest.mark.parametrize("mode", [FIRE, EMERGENCY, OFFLINE])
def test_a_robot_that_was_not_let_in_before_the_hazard_is_kept_out(mode: int) -> None:
    assert first_step(mode) == OUTSIDE


def test_a_robot_that_boarded_before_the_fire_drives_out() -> None:
    assert first_step(FIRE, boards=True) == INSIDE


def test_a_listener_that_came_late_does_not_know_where_the_robot_is() -> None:
    assert first_step(FIRE, from_s=22.0) == UNKNOWN
    assert first_step(FIRE, boards=True, from_s=30.0) == UNKNOWN
