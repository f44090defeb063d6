"""A lift in HUMAN mode. Its session has asked for this mode, or waits for AGV mode."""

import pytest

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from tests.site.timeline import EPOCH
from tests.workbench.explain.heard_lift import (
    ASKS_AGV,
    ASKS_HUMAN,
    BLUE,
    HUMAN,
    RED,
    asks,
    each_second,
    explained,
    shows,
)
from tests.workbench.explain.story import Scene
from workbench.explain.explanation import Explanation
from workbench.explain.heard_devices import HeardDevices

WEB = "rmf_web"


def held(who: str, kind: int, until: float = 40.0, *, passed: bool = True) -> Explanation:
    """Explain a lift that stays in HUMAN mode. `who` asks until `until`, and has the lift from 6 s on.
    BLUE waits."""
    to_lift = until if passed else 5.0
    return explained(
        [
            *each_second(0, 6, shows),
            *each_second(5, until, lambda s: asks(s + 0.1, "L2", who, kind)),
            *each_second(5, to_lift, lambda s: asks(s + 0.2, "L2", who, kind, passed=True)),
            *each_second(6, 40, lambda s: shows(s, who, mode=HUMAN)),
            *each_second(8, 40, lambda s: asks(s + 0.1, "L3", BLUE)),
        ]
    )


@pytest.mark.parametrize("until", [7.0, 40.0])
@pytest.mark.parametrize("passed", [True, False])
def test_a_dashboard_that_has_asked_for_human_mode_has_to_send_end(
    until: float, passed: bool
) -> None:
    found = held(WEB, ASKS_HUMAN, until, passed=passed)
    assert found.now[0].startswith(f"{BLUE} has waited")
    assert [(step.who, step.what.split(";")[0]) for step in found.next] == [
        ("a person", f"let {WEB} send END")
    ]
    assert "AGV_MODE" not in " ".join(found.now)


def test_a_robot_that_has_asked_for_human_mode_may_have_the_wrong_number() -> None:
    found = held(RED, ASKS_HUMAN)
    assert "AGV_MODE, which is 1 in a request" in " ".join(found.now)


def test_a_robot_that_has_asked_for_agv_mode_still_waits_for_the_controller() -> None:
    found = held(RED, ASKS_AGV)
    assert found.now[0].startswith(f"{RED} has waited")
    assert [step.who for step in found.next] == ["the controller"]


@pytest.mark.parametrize("unrecorded", ["", "adapter_lift_requests"])
def test_our_daemon_with_a_session_in_human_mode_is_not_accused(unrecorded: str) -> None:
    scene = Scene("Lift1")
    for _ in range(10):
        now = stamp(EPOCH + scene.timeline.now)
        request = d.LiftRequest("Lift1", now, WEB, ASKS_HUMAN, "L2", 2)
        scene.says(topics.ADAPTER_LIFT_REQUESTS, request)
        scene.run(1.0)
    site = HeardDevices("Lift1")
    for one in scene.heard:
        if not isinstance(one, Heard) or one.topic != unrecorded:
            site.take(one)
    found = site.explain("lift", "Lift1", None)
    assert [step.what.split(";")[0] for step in found.next] == [f"let {WEB} send END"]
    assert found.fields == ()
