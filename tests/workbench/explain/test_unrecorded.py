"""A recording without `lift_requests`. Nobody can tell what the supervisor has passed on."""

import pytest

from tests.workbench.explain.heard_lift import (
    BLUE,
    END,
    OPEN,
    RED,
    asks,
    each_second,
    explained,
    shows,
)
from workbench.explain.explanation import Explanation

RIDE = [
    *each_second(0, 5, shows),
    *each_second(4.1, 15, lambda s: asks(s, "L1")),
    *each_second(5, 16, lambda s: shows(s, RED, "L1", OPEN)),
]


def said(found: Explanation) -> str:
    return " ".join([*found.now, *(step.what for step in found.next)])


def assert_unknown(found: Explanation) -> None:
    assert "not known whether" in said(found)
    assert "supervisor is not running" not in said(found)
    assert {step.who for step in found.next} == {"a person"}


def waits_for_a_free_lift() -> Explanation:
    free = each_second(16, 60, shows)
    blue = each_second(20.1, 60, lambda s: asks(s, "L3", BLUE))
    return explained([*RIDE, asks(15.2, kind=END), *free, *blue])


def test_a_robot_at_a_free_lift_does_not_accuse_the_supervisor() -> None:
    assert_unknown(waits_for_a_free_lift())


def test_an_end_without_effect_accuses_neither_the_supervisor_nor_the_lift() -> None:
    kept = each_second(16, 40, lambda s: shows(s, RED, "L1", OPEN))
    assert_unknown(explained([*RIDE, *kept, *each_second(15.1, 40, lambda s: asks(s, kind=END))]))


@pytest.mark.parametrize(("passed", "blamed"), [(True, "the device's node"), (False, "a person")])
def test_with_lift_requests_the_party_at_fault_is_still_named(passed: bool, blamed: str) -> None:
    """The supervisor passes the request on, and the lift ignores it; or no supervisor runs."""
    lines = [*each_second(0, 30, shows), *each_second(4.1, 30, lambda s: asks(s, "L3"))]
    if passed:
        lines += each_second(4.2, 30, lambda s: asks(s, "L3", passed=True))
    found = explained(lines)
    assert [step.who for step in found.next] == [blamed]
    assert ("supervisor is not running" in said(found)) == (not passed)
