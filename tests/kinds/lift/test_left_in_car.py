"""LIFT-2: RMF's supervisor ends the session of a robot that is in the car.

The first stories follow RMF's own rules (rmf_ros2, lift_supervisor/Node.cpp). After its start a
supervisor sends END for the session that the lift shows. Then it serves the first session that requests
the lift. A fleet adapter that starts sends END for its robot's session (RobotContext.cpp,
_check_lift_state).
"""

import pytest

from bridges.kinds.lift.signals import Hazard, LiftOutputs
from bridges.messages.definitions import LiftRequest
from bridges.messages.stamps import stamp
from tests.kinds.lift.rmf_world import World
from tests.kinds.lift.story import AGV, END, WALL
from tests.kinds.lift.test_forgotten import Overheard
from tests.kinds.lift.test_with_rmf import A, B, ons, sessions, world
from workbench.rmf_model.robot import RobotContext
from workbench.rmf_model.supervisors import LiftSupervisor

SILENT_S = 5.0
LEFT_S = 60.0


def riding(
    jazzy: bool = False, adapters_first: bool = False
) -> tuple[World, RobotContext, RobotContext]:
    """Return the stand-ins of RMF, robot A and robot B. A rides from L2 to L4, and B waits at L1."""
    a, b = RobotContext(A, jazzy), RobotContext(B, jazzy)
    rmf = world(a, b, adapters_first=adapters_first)
    rmf.supervisor = LiftSupervisor(jazzy)
    rmf.asks(a, "L2")
    rmf.until_done(a)
    a.in_car = True
    rmf.asks(b, "L1")
    rmf.run(rmf.story.now + 3.0)
    rmf.asks(a, "L4", inside=True)
    rmf.run(rmf.story.now + 2.0)
    return rmf, a, b


@pytest.mark.parametrize("jazzy", [False, True])
@pytest.mark.parametrize("adapters_first", [False, True])
@pytest.mark.parametrize("after_s", [0.0, 0.3, 0.6, 1.1, 2.0, 3.0])
def test_a_restarted_supervisor_takes_no_lift_from_a_robot_in_the_car(
    jazzy: bool, adapters_first: bool, after_s: float
) -> None:
    """Restart the supervisor at different moments of the ride. Robot A must keep the lift each time."""
    rmf, a, b = riding(jazzy, adapters_first)
    rmf.run(rmf.story.now + after_s)
    edges = list(rmf.story.edges)
    rmf.supervisor = LiftSupervisor(jazzy)
    rmf._hear(rmf.story.told[-1][1])
    rmf.robots.reverse()
    rmf._arrive()
    assert any(request.request_type == END for request in rmf.requested)
    rmf.until_done(a)
    assert [e for e in rmf.story.edges if e not in edges] == [
        e for e in rmf.story.edges[len(edges) :] if e[1:] in CALLED_AND_HELD
    ]
    assert sessions(rmf.story) == ["", A]
    a.in_car = False
    released_at = rmf.story.now
    rmf.releases(a)
    rmf.until_done(a)
    rmf.until_done(b)
    assert sessions(rmf.story) == ["", A, "", B]
    granted_at = next(at for at, state in rmf.story.told if state.session_id == B)
    assert granted_at - released_at < 6.0  # 3 s of grace after END, and then B's next request


CALLED_AND_HELD = [("call", None), ("hold_door", "front")]


class InMidRide(Overheard):
    """A lift that robot A entered at L2 and that is on its way to L4. A's adapter has just repeated the
    request."""

    def __init__(self) -> None:
        super().__init__()
        self.adapter(AGV, "L2")
        self.story.run(self.story.now + 1.0)
        self.story.asks(A, "L4")
        self.adapter(AGV, "L4")

    def asks_for(self, seconds: float) -> None:
        """Let A's adapter repeat its request once a second."""
        for _ in range(int(seconds)):
            self.adapter(AGV, "L4")
            self.story.run(self.story.now + 0.8)


def test_an_ended_session_lasts_until_its_robot_has_been_silent_for_five_seconds() -> None:
    lift = InMidRide()
    lift.supervisor_ends()
    lift.asks_for(20.0)
    assert lift.story.state == "AGV, open at L4, fleet/a to L4"
    assert lift.story.faults == ["FORGOTTEN_BY_SUPERVISOR"]
    detail = lift.story.node.status()["faults"][0]["detail"]
    assert detail == "lift_requests sends END while fleet/a has the lift"
    silent_since = lift.story.now - 1.0
    ended_at = lift.story.until(lambda: not lift.story.told[-1][1].session_id)
    assert ended_at == pytest.approx(silent_since + SILENT_S, abs=0.3)


def test_a_request_of_the_supervisor_renews_the_session_it_has_ended() -> None:
    lift = InMidRide()
    lift.supervisor_ends()
    lift.story.asks(A, "L4")
    lift.story.run(lift.story.now + 20.0)
    assert lift.story.state == "AGV, open at L4, fleet/a to L4"
    assert lift.story.faults == []


def test_the_end_of_another_session_does_not_end_the_session_of_a_silent_robot() -> None:
    lift = InMidRide()
    lift.supervisor_ends()
    assert lift.story.node.refused == {}
    lift.story.asks(B, "L1")
    lift.story.ends(B)
    assert sessions(lift.story) == ["", A]
    lift.story.run(lift.story.now + SILENT_S - 1.0)
    detail = lift.story.node.status()["faults"][0]["detail"]
    assert detail == "lift_requests sends END while fleet/a has the lift"
    lift.story.run(lift.story.now + 1.0)
    assert sessions(lift.story) == ["", A, ""]


def test_the_own_end_of_the_robot_ends_its_session_in_any_order_of_arrival() -> None:
    for own_first in (True, False):
        lift = InMidRide()
        lift.asks_for(20.0)
        if own_first:
            lift.adapter(END)
        lift.supervisor_ends()
        assert sessions(lift.story)[-1] == ("" if own_first else A)
        if not own_first:
            lift.adapter(END)
        assert sessions(lift.story) == ["", A, ""]
        lift.story.run(lift.story.now + 3.0)
        lift.story.asks(B, "L1")
        assert sessions(lift.story)[-1] == B


def test_an_end_that_is_passed_on_late_counts_even_if_the_robot_asks_again() -> None:
    lift = InMidRide()
    lift.adapter(END)
    lift.adapter(AGV, "L4")
    lift.supervisor_ends()
    assert sessions(lift.story) == ["", A, ""]


def test_a_person_ends_the_session_of_a_robot_that_repeats_its_request() -> None:
    lift = InMidRide()
    lift.supervisor_ends()
    lift.supervisor_ends(by_person=True)
    assert sessions(lift.story) == ["", A, ""]
    for _ in range(5):
        lift.adapter(AGV, "L4")
        lift.story.asks(B, "L1")
        lift.story.run(lift.story.now + 0.8)
    assert sessions(lift.story) == ["", A, "", B]


def test_a_fire_takes_the_outputs_of_a_session_that_the_supervisor_has_ended() -> None:
    lift = InMidRide()
    lift.supervisor_ends()
    lift.story.building.hazard(Hazard.FIRE)
    lift.asks_for(1.0)
    assert lift.story.outputs == LiftOutputs()
    assert lift.story.state.startswith("FIRE")


@pytest.mark.parametrize("heard_s", [4.5, 5.5])
def test_a_request_of_a_robot_counts_for_five_seconds(heard_s: float) -> None:
    lift = InMidRide()
    lift.story.run(lift.story.now + heard_s - 0.2)
    lift.supervisor_ends()
    assert sessions(lift.story)[-1] == (A if heard_s < SILENT_S else "")


def test_the_session_of_a_robot_outside_or_without_adapter_ends_at_once() -> None:
    unheard = Overheard()
    unheard.story.ends(A)
    assert sessions(unheard.story) == ["", A, ""]
    outside = world(RobotContext(A))
    outside.asks(outside.robots[0], "L4")
    outside.run(outside.story.now + 2.0)
    outside.robots.clear()
    outside.story.ends(A)
    assert sessions(outside.story) == ["", A, ""]


# ---- LIFT-2: a fleet adapter that was killed


@pytest.mark.parametrize("back_after_s", [1.0, 8.0, 30.0])
def test_a_robot_gets_its_lift_back_after_its_new_adapter_has_sent_end(
    back_after_s: float,
) -> None:
    rmf, a, b = riding()
    fresh = rmf.restart_adapter(a)
    fresh.in_car = True
    rmf.run(rmf.story.now + back_after_s)
    assert rmf.supervisor.slots["Lift1"].session_id == B
    assert (sessions(rmf.story)[-1], rmf.story.outputs.call) == ("", None)
    left = {"code": "ROBOT_LEFT_IN_CAR", "detail": f"{A} was ended in mid-ride"}
    assert rmf.story.node.status()["faults"] == [left]
    rmf.asks(fresh, "L4", inside=True)
    rmf.until_done(fresh)
    assert rmf.story.state == "AGV, open at L4, fleet/a to L4"
    fresh.in_car = False
    rmf.releases(fresh)
    rmf.until_done(b)
    assert sessions(rmf.story) == ["", A, "", A, "", B]
    assert ons(rmf.story, "call") >= 3


def test_a_lift_waits_a_minute_with_outputs_off_for_a_robot_left_in_the_car() -> None:
    lift = InMidRide()
    lift.adapter(END)
    ended_at = lift.story.now
    lift.supervisor_ends()
    lift.story.run(ended_at + 2.5)
    assert lift.story.outputs == LiftOutputs(agv_request=True)
    lift.story.run(ended_at + 3.1)
    assert lift.story.outputs == LiftOutputs()
    lift.story.run(ended_at + LEFT_S - 0.5)
    lift.story.asks(B, "L1")
    assert lift.story.node.refused == {"released in mid-ride": 1}
    lift.story.run(ended_at + LEFT_S)
    lift.story.asks(B, "L1")
    assert (sessions(lift.story)[-1], lift.story.faults) == (B, [])


def test_an_adapter_that_was_silent_before_its_end_may_have_left_its_robot_in_the_open_car() -> (
    None
):
    lift = InMidRide()
    lift.asks_for(20.0)
    assert lift.story.state == "AGV, open at L4, fleet/a to L4"
    lift.story.run(lift.story.now + 20.0)
    lift.adapter(END)
    lift.supervisor_ends()
    assert lift.story.faults == ["ROBOT_LEFT_IN_CAR"]
    before_the_last_end = WALL + lift.story.now
    lift.adapter(END)
    lift.story.run(lift.story.now + 30.0)
    lift.adapter(AGV, "L4", who=B)
    lift.adapter(AGV, "L4", at=before_the_last_end)
    assert sessions(lift.story)[-1] == ""
    lift.adapter(AGV, "L4")
    lift.story.run(lift.story.now + 1.0)
    assert sessions(lift.story)[-1] == A


@pytest.mark.parametrize("by_end", [True, False])
def test_a_robot_may_be_left_in_the_open_car_if_its_adapter_has_stopped_without_an_end(
    by_end: bool,
) -> None:
    """The supervisor ends the session after the adapter has stopped, or before that."""
    lift = InMidRide()
    lift.asks_for(20.0)
    if not by_end:
        lift.supervisor_ends()
    lift.story.run(lift.story.now + 20.0)
    if by_end:
        lift.supervisor_ends()
    lift.story.asks(B, "L1")
    assert (sessions(lift.story)[-1], lift.story.faults) == ("", ["ROBOT_LEFT_IN_CAR"])


@pytest.mark.parametrize("later_s", [4.0, 10.0])
def test_a_robot_whose_end_came_together_with_its_last_requests_is_not_left_in_the_car(
    later_s: float,
) -> None:
    lift = InMidRide()
    lift.asks_for(20.0)
    lift.says(lift.word(AGV, "L4"), lift.word(AGV, "L4"), lift.word(END))
    lift.story.run(lift.story.now + later_s)
    lift.supervisor_ends()
    assert (sessions(lift.story), lift.story.faults) == (["", A, ""], [])


def test_a_robot_that_repeats_its_end_until_the_supervisor_passes_it_on_is_not_left_in_the_car() -> (
    None
):
    lift = InMidRide()
    lift.asks_for(20.0)
    for _ in range(10):
        lift.adapter(END)
        lift.story.run(lift.story.now + 0.8)
    lift.supervisor_ends()
    assert (sessions(lift.story), lift.story.faults) == (["", A, ""], [])


def test_the_lift_does_not_wait_for_a_robot_that_was_heard_only_with_its_end() -> None:
    for asks_again in (False, True):
        lift = Overheard()
        lift.adapter(END)
        if asks_again:
            lift.adapter(AGV, "L2")
        lift.story.ends(A)
        assert sessions(lift.story) == ["", A, ""]
        assert lift.story.faults == (["ROBOT_LEFT_IN_CAR"] if asks_again else [])


@pytest.mark.parametrize("by_person", [False, True])
def test_after_a_persons_end_on_adapter_lift_requests_the_lift_does_not_wait(
    by_person: bool,
) -> None:
    lift = InMidRide()
    lift.supervisor_ends()
    lift.says(lift.word(END, by_person=by_person))
    assert sessions(lift.story) == ["", A, ""]
    assert lift.story.faults == ([] if by_person else ["ROBOT_LEFT_IN_CAR"])


def test_a_person_who_ends_the_wait_at_once_shortens_it_to_the_grace() -> None:
    lift = InMidRide()
    lift.adapter(END)
    lift.supervisor_ends()
    ended_at = lift.story.now
    assert lift.story.faults == ["ROBOT_LEFT_IN_CAR"]
    lift.supervisor_ends(by_person=True)
    lift.adapter(AGV, "L4")
    lift.story.run(ended_at + 2.5)
    lift.story.asks(B, "L1")
    assert (sessions(lift.story)[-1], lift.story.faults) == ("", [])
    assert lift.story.outputs == LiftOutputs(agv_request=True)
    assert lift.story.node.refused == {"released a moment ago": 1}
    lift.story.run(ended_at + 3.0)
    lift.story.asks(B, "L1")
    lift.story.run(lift.story.now + 0.2)
    assert sessions(lift.story)[-1] == B


def test_a_person_who_has_looked_into_the_car_gives_the_lift_to_the_next_robot() -> None:
    lift = InMidRide()
    lift.adapter(END)
    lift.supervisor_ends()
    lift.story.run(lift.story.now + 5.0)
    lift.supervisor_ends(by_person=True)
    lift.story.run(lift.story.now + 0.1)
    lift.story.asks(B, "L1")
    assert sessions(lift.story)[-1] == B


# ---- LIFT-2: an END that was sent before the session began


def test_an_end_from_before_the_session_counts_after_a_second_of_repeats() -> None:
    lift = Overheard()
    sent = stamp(WALL + lift.story.now)
    lift.story.ends(A)
    lift.story.run(lift.story.now + 5.0)
    lift.story.request(LiftRequest("Lift1", sent, A, int(AGV), "L2", 2))
    began = lift.story.now
    for old_s in (9.0, 8.0, 7.5):
        old = stamp(WALL + began - old_s - 5.0)
        lift.story.request(LiftRequest("Lift1", old, A, int(END), "", 0))
        assert sessions(lift.story)[-1] == (A if old_s > 7.5 else "")
        lift.story.run(lift.story.now + 0.6)
    assert lift.story.node.refused == {"END older than the session": 2}


def test_an_end_is_old_until_the_stamp_of_the_request_that_got_the_session_back() -> None:
    """The request comes within the grace. A later request for another floor does not change which END
    is old."""
    lift = Overheard()
    lift.story.ends(A)
    began = WALL + lift.story.now
    for later_s, floor in ((0.0, "L2"), (1.0, "L4")):
        request = LiftRequest("Lift1", stamp(began + later_s), A, int(AGV), floor, 2)
        lift.story.request(request)
    lift.supervisor_ends(at=began - 0.5)
    assert sessions(lift.story) == ["", A, "", A]
    lift.supervisor_ends(at=began)
    assert sessions(lift.story) == ["", A, "", A, ""]
    assert lift.story.node.refused == {"END older than the session": 1}


def test_an_end_counts_even_if_it_is_older_than_another_end_of_the_session() -> None:
    """The clocks of a person and of RMF's supervisor may differ."""
    lift = InMidRide()
    lift.supervisor_ends(at=WALL + lift.story.now + 30.0)
    assert sessions(lift.story) == ["", A]
    lift.supervisor_ends(by_person=True)
    assert sessions(lift.story) == ["", A, ""]


@pytest.mark.parametrize("sec", [0, -1])
def test_an_end_without_a_stamp_counts_at_once(sec: int) -> None:
    lift = InMidRide()
    lift.adapter(END)
    impossible = stamp(0.0)
    impossible = type(impossible)(sec, 0)
    lift.story.request(LiftRequest("Lift1", impossible, A, int(END), "", 0))
    assert sessions(lift.story)[-1] == ""
