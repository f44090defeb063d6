"""The senders of requests on the topic that a device obeys, such as `lift_requests`. A sender is the
supervisor, or a person with `send --direct`."""

from datetime import UTC

import pytest

from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from workbench.explain.heard_devices import HeardDevices

WALL = 1_800_000_000.0
EITHER = "the supervisor, or a person with `send --direct`,"


def lift(*said: tuple[str, d.LiftRequest]) -> str:
    """Return the explanation of Lift1, whose session belongs to fleet/red. The senders repeat their
    requests each second."""
    site = HeardDevices("Lift1")
    for n in range(20):
        state = d.LiftState(stamp(WALL + n), "Lift1", ("L1",), "L1", session_id="fleet/red")
        site.take(Heard(float(n), WALL + n, "lift_states", state))
        for topic, request in said if n > 5 else ():
            site.take(Heard(float(n), WALL + n, topic, request))
    told = site.explain("lift", "Lift1", UTC)
    return "\n".join((*told.now, *(line.text for line in told.story)))


def asks(who: str, kind: int = 1) -> d.LiftRequest:
    return d.LiftRequest("Lift1", stamp(WALL), who, kind, "L1", 2)


def test_a_robots_request_on_lift_requests_was_passed_on_by_the_supervisor() -> None:
    told = lift(
        ("adapter_lift_requests", asks("fleet/blue")), ("lift_requests", asks("fleet/blue"))
    )
    assert "The supervisor has requested the lift for fleet/blue since" in told
    assert "--direct" not in told


@pytest.mark.parametrize("others", [(), (("adapter_lift_requests", asks("fleet/blue")),)])
def test_who_asks_for_a_session_on_lift_requests_that_no_robot_asks_for_is_not_known(
    others: tuple[tuple[str, d.LiftRequest], ...],
) -> None:
    told = lift(*others, ("lift_requests", asks("me")))
    assert f"{EITHER.capitalize()} has requested the lift for me since" in told
    assert "The supervisor has requested the lift" not in told


def test_who_ends_a_session_on_lift_requests_alone_is_not_known() -> None:
    told = lift(("lift_requests", asks("fleet/red", 0)))
    assert f"{EITHER} ends the session of fleet/red, from whom no request was heard" in told


@pytest.mark.parametrize(
    ("requester", "sender"), [("door_supervisor", "the supervisor"), ("me", "me")]
)
def test_a_doors_sender_is_named_by_its_requester_id(requester: str, sender: str) -> None:
    site = HeardDevices("ward")
    for n in range(9):
        mode = 2 if n > 5 else 0
        state = d.DoorState(stamp(WALL + n), "ward", d.DoorMode(0))
        request = d.DoorRequest(stamp(WALL + n), requester, "ward", d.DoorMode(mode))
        site.take(Heard(float(n), WALL + n, "door_states", state))
        site.take(Heard(float(n), WALL + n, "door_requests", request))
    told = site.explain("door", "ward", UTC)
    assert any(f"On door_requests {sender} has asked for OPEN since" in one for one in told.now)
    assert [one.text for one in told.story if "asks for" in one.text] == [f"{sender} asks for open"]
