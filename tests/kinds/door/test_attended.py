"""DOOR-2: if the door supervisor disappears, the core goes on holding the door open. A site may limit
how long."""

from bridges.kinds.shared.decision import Attended
from tests.kinds.door.virtual import OBSTRUCTION, CoreAlone, Door


def held(**limits: float) -> Door:
    """Return a door that the core holds open from 1 s on. Its door supervisor disappears at 20 s."""
    door = Door(limits=limits, inputs={"obstruction": OBSTRUCTION})
    door.scan(Attended(True))
    door.run(1.0)
    door.opens()
    door.run(20.0)
    door.scan(Attended(False))
    return door


def test_by_default_a_door_stays_held_without_supervisor_and_robots() -> None:
    door = held()
    door.run(4000.0)
    assert [on for _, on in door.relay] == [True]
    assert door.faults == [(0.0, ())]


def test_with_supervisor_lost_s_a_door_stays_held_beside_its_supervisor() -> None:
    door = Door(limits={"supervisor_lost_s": 60.0})
    door.scan(Attended(True))
    door.run(1.0)
    door.opens()
    door.run(200.0)
    assert [on for _, on in door.relay] == [True]


def test_with_supervisor_lost_s_the_hold_ends_after_that_time_and_a_fault_says_why() -> None:
    door = held(supervisor_lost_s=60.0)
    door.run(200.0)
    assert [(round(at), on) for at, on in door.relay] == [(1, True), (80, False)]
    assert [(round(at), codes) for at, codes in door.faults] == [
        (0, ()),
        (80, ("SUPERVISOR_LOST",)),
    ]
    said = [fault for fault in door.report.faults if fault.code == "SUPERVISOR_LOST"]
    assert [one.detail for one in said] == [
        "no node has published door_requests for 60.0 s, so the hold has ended"
    ]
    door.scan(Attended(True))
    assert door.faults[-1][1] == ()


def test_no_word_about_the_supervisor_is_refused() -> None:
    assert {CoreAlone().hears(Attended(yes)).refused for yes in (True, False)} == {""}


def test_a_supervisor_that_returns_in_time_changes_nothing() -> None:
    door = held(supervisor_lost_s=60.0)
    door.run(75.0)
    door.scan(Attended(True))
    door.run(300.0)
    assert [on for _, on in door.relay] == [True]


def test_a_request_proves_a_live_supervisor_before_its_node_is_seen_on_the_graph() -> None:
    door = held(supervisor_lost_s=60.0)
    door.run(200.0)
    door.opens()
    door.run(250.0)
    assert [(round(at), on) for at, on in door.relay][2:] == [(200, True)]
    door.run(300.0)
    assert [(round(at), on) for at, on in door.relay][3:] == [(260, False)]


def test_the_hold_does_not_end_while_somebody_is_in_the_doorway() -> None:
    door = held(supervisor_lost_s=60.0)
    door.plant.press("obstruction", True, door.now)
    door.run(100.0)
    assert [on for _, on in door.relay] == [True]
