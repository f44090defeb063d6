"""Known defects of RMF. `explain` names a defect only if the messages prove it."""

from datetime import UTC

import pytest

from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from tests.workbench.explain.situations import SCENES
from workbench.explain.heard_devices import HeardDevices

WALL, RED, BLUE = 1_800_000_000.0, "fleet/red", "fleet/blue"
END, AGV = 0, 1
Second = tuple[str, str, int, list[tuple[str, int, str]]]
"""One second of a story: (session, floor, door state, requests). The lift shows the first three values,
and the adapters send the requests."""


def notes(*seconds: Second) -> list[str]:
    site = HeardDevices("Lift1")
    for at, (session, floor, door, requests) in enumerate(seconds):
        time = stamp(WALL + at)
        state = d.LiftState(time, "Lift1", ("L1", "L2"), floor, "", door, 0, (), 2, session)
        site.take(Heard(float(at), WALL + at, "lift_states", state))
        for who, kind, wants in requests:
            asked = d.LiftRequest("Lift1", time, who, kind, wants, 2)
            site.take(Heard(float(at), WALL + at, "adapter_lift_requests", asked))
            site.take(Heard(float(at), WALL + at, "lift_requests", asked))
    return [note for note in site.explain("lift", "Lift1", UTC).notes if "rmf_ros2#" in note]


def shows(session: str, floor: str, door: int, *requests: tuple[str, int, str]) -> Second:
    return session, floor, door, [*requests]


BOARDS = [shows(RED, "L1", 2, (RED, AGV, "L1"))] * 3


def test_a_robot_that_calls_the_car_back_in_mid_ride_is_named() -> None:
    rides = [shows(RED, "", 0, (RED, AGV, "L2"))] * 3
    back = [shows(RED, "", 0, (RED, AGV, "L1"))] * 3
    (note,) = notes(*BOARDS, *rides, *back)
    assert note.startswith("In mid-ride fleet/red calls the car back")
    assert "rmf_ros2#555" in note


def test_a_ride_there_and_back_is_none() -> None:
    there = [shows(RED, "L2", 2, (RED, AGV, "L2"))] * 3
    assert not notes(*BOARDS, *there, *[shows(RED, "", 0, (RED, AGV, "L1"))] * 3)


def test_a_session_that_is_given_to_another_without_end_is_named() -> None:
    (note,) = notes(*BOARDS, *[shows(BLUE, "L1", 2, (RED, AGV, "L1"))] * 3)
    assert note.startswith("The lift's node has taken the session from fleet/red")
    assert "rmf_ros2#314" in note


@pytest.mark.parametrize("asks_again", [(), ((RED, AGV, "L2"),)])
def test_a_session_that_was_ended_is_not_taken_away(
    asks_again: tuple[tuple[str, int, str], ...],
) -> None:
    ends = shows(RED, "L1", 2, (RED, END, ""))
    assert not notes(*BOARDS, ends, *[shows(BLUE, "L1", 2, *asks_again)] * 3)


def test_end_without_end_is_named_and_a_few_are_not() -> None:
    spam = shows("", "L1", 0, (RED, END, ""))
    (note,) = notes(*[spam] * 12)
    assert note.startswith("fleet/red sends END again and again")
    assert "rmf_ros2#382" in note
    assert not notes(*[spam] * 4)
    assert not notes(*[spam] * 12, *[shows("", "L1", 0)] * 5)


@pytest.mark.parametrize("name", SCENES)
def test_no_situation_alarms_falsely(name: str) -> None:
    heard, kind, device = SCENES[name]()
    site = HeardDevices(device)
    for one in heard:
        site.take(one)
    known = [note for note in site.explain(kind, device, UTC).notes if "rmf_ros2#" in note]
    silent = name in ("nobody_publishes", "daemon_is_gone")
    assert ["#472" in note for note in known] == [True] * silent
