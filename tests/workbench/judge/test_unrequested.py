"""A charge that nobody requested. The charge has the id `unrequested/…`, which no request has.

The id changes when the robot's request comes. The next charge without a request has the id
`unrequested/…` again. No law counts either change as a fault.
"""

import pytest
from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from workbench.judge.judge import Judge
from workbench.judge.law import Verdict

IDLE, ASSIGNED, CHARGING, RELEASED = 1, 2, 3, 4
NOBODYS = "unrequested/bay1"
TOPICS = {
    d.ChargerState: topics.CHARGER_STATES.name,
    d.ChargerRequest: topics.CHARGER_REQUESTS.name,
    d.ChargerCancel: topics.CHARGER_CANCELS.name,
}


def shows(state: int, request_id: str = "", robot: str = "") -> d.ChargerState:
    fleet = "fleet" if robot else ""
    return d.ChargerState(d.Time(), state, "bay1", "", request_id, fleet, robot)


def asks(robot: str, request_id: str) -> d.ChargerRequest:
    return d.ChargerRequest("bay1", "fleet", robot, d.Duration(2), request_id)


def cancels(request_id: str) -> d.ChargerCancel:
    return d.ChargerCancel("bay1", request_id)


def broken(*said: d.ChargerState | d.ChargerRequest | d.ChargerCancel) -> set[str]:
    """Return the laws that these messages break. One message comes each second."""
    judge, at = Judge("charger", "bay1"), 100.0
    for message in said:
        at += 1.0
        if isinstance(message, d.ChargerState):
            message = replace(message, charger_time=stamp(at))
        judge.hear(Heard(at, at, TOPICS[type(message)], message))
    judge.hear(Heard(at + 2.0, at, topics.FLEET_STATES.name, d.FleetState("other")))
    return {j.law.id for j in judge.end(at + 2.0, at) if j.verdict is Verdict.BROKEN}


@pytest.mark.parametrize(
    ("before", "after", "laws"),
    [
        ((NOBODYS, "red"), ("r1", "red"), set()),
        ((NOBODYS, "red"), ("r2", "blue"), {"C1.keeps"}),
        ((NOBODYS, ""), ("r1", "red"), {"C1.keeps"}),
        (("r3", "red"), ("r1", "red"), {"C1.keeps"}),
        (("r1", "red"), (NOBODYS, "red"), set()),
    ],
)
def test_a_charge_that_nobody_requested_becomes_that_of_the_robot_that_stands_there(
    before: tuple[str, str], after: tuple[str, str], laws: set[str]
) -> None:
    requests = asks("red", "r1"), asks("blue", "r2")
    assert broken(shows(CHARGING, *before), *requests, shows(CHARGING, *after)) == laws


@pytest.mark.parametrize("state", [ASSIGNED, CHARGING])
@pytest.mark.parametrize("over", [shows(IDLE), shows(RELEASED, NOBODYS, "red")])
def test_a_cancel_ends_the_charge_that_nobody_requested_and_not_the_next_one(
    state: int, over: d.ChargerState
) -> None:
    charge = [shows(state, NOBODYS, "red")]
    again = [shows(state, NOBODYS, "blue")] * 130
    assert broken(*charge, cancels(NOBODYS), over, *again) == set()
    assert broken(shows(IDLE), cancels(NOBODYS), *again) == set()
    assert broken(*charge, cancels(NOBODYS), *charge * 130) == {"C3.cancel"}


def test_a_robot_that_nobody_sent_may_leave_when_another_request_is_cancelled() -> None:
    leaves = shows(ASSIGNED, NOBODYS, "red"), cancels("r9"), shows(IDLE), shows(IDLE)
    assert broken(*leaves) == set()


@pytest.mark.parametrize("state", [ASSIGNED, CHARGING])
def test_whoever_requests_that_id_has_no_request(state: int) -> None:
    served = [shows(state, NOBODYS, "red")] * 20
    assert broken(*served[:1], asks("blue", NOBODYS), *served) == set()
