"""LIFT-2: RMF's supervisor has forgotten the robot in the car.

RMF's supervisor (rmf_ros2, lift_supervisor/Node.cpp) has one slot for each lift. The first session that
requests the lift gets the slot. The supervisor drops all requests of other sessions, even END.

The first tests use stand-ins that follow RMF's rules. The other tests check our rules one by one.
"""

from collections.abc import Sequence

import pytest

from bridges.kinds.lift.messages import OWN_REQUESTS
from bridges.kinds.lift.signals import LiftOutputs
from bridges.messages.definitions import LiftRequest
from bridges.messages.stamps import stamp
from tests.kinds.lift.rmf_world import World
from tests.kinds.lift.story import AGV, END, WALL, Building, Controller, Story
from tests.kinds.lift.test_with_rmf import A, B, ons, sessions, world
from workbench.rmf_model.robot import RobotContext


def one_inside_one_waiting(
    adapters_first: bool = False,
) -> tuple[World, RobotContext, RobotContext]:
    a, b = RobotContext(A), RobotContext(B)
    rmf = world(a, b, adapters_first=adapters_first)
    rmf.asks(a, "L2")
    rmf.until_done(a)
    a.in_car = True
    rmf.asks(b, "L1")
    rmf.run(rmf.story.now + 3.0)
    return rmf, a, b


@pytest.mark.parametrize("adapters_first", [False, True])
def test_a_restarted_supervisor_that_takes_the_waiting_robot_locks_nobody_in(
    adapters_first: bool,
) -> None:
    rmf, a, b = one_inside_one_waiting(adapters_first)
    rmf.restart_supervisor(first=b)
    rmf.run(rmf.story.now + 5.0)
    assert rmf.supervisor.slots["Lift1"].session_id == B
    assert rmf.story.faults == ["FORGOTTEN_BY_SUPERVISOR"]
    rmf.asks(a, "L4", inside=True)
    rmf.until_done(a)
    assert rmf.story.state == "AGV, open at L4, fleet/a to L4"
    a.in_car = False
    rmf.releases(a)
    rmf.until_done(a)
    rmf.until_done(b)
    assert sessions(rmf.story) == ["", A, "", B]
    assert rmf.story.faults == []


def test_a_forgotten_robot_outside_is_served_before_the_other_robot() -> None:
    a, b = RobotContext(A), RobotContext(B)
    rmf = world(a, b)
    rmf.asks(a, "L4")
    rmf.run(3.0)
    rmf.asks(b, "L1")
    rmf.restart_supervisor(first=b)
    rmf.until_done(a)
    rmf.rides(a, "L4", "L2")
    rmf.until_done(b)
    assert sessions(rmf.story) == ["", A, "", B]


def test_a_lost_end_is_heard_from_its_adapter_although_another_robot_waits() -> None:
    rmf, a, b = one_inside_one_waiting()
    lost: list[LiftRequest] = []

    def fate(request: LiftRequest) -> Sequence[float]:
        if request.request_type == END and not lost:
            lost.append(request)
            return ()
        return (0.0,)

    rmf.fate = fate
    a.in_car = False
    rmf.releases(a)
    rmf.until_done(a)
    rmf.until_done(b)
    assert (len(lost), sessions(rmf.story)) == (1, ["", A, "", B])


class Overheard:
    """A lift that stands at L2 with an open door, and that robot A holds.

    `adapter` sends the requests of A's adapter directly to the node.
    """

    def __init__(self, building: Building | None = None) -> None:
        self.story = Story(building or Controller())
        self.story.run(1.0)
        self.story.asks(A, "L2")
        self.story.run(12.0)
        self.sent = 0

    def adapter(self, kind: int, floor: str = "", *, at: float | None = None, who: str = A) -> None:
        self.says(self.word(kind, floor, at=at, who=who))

    def word(
        self,
        kind: int,
        floor: str = "",
        *,
        at: float | None = None,
        who: str = A,
        by_person: bool = False,
    ) -> LiftRequest:
        """Return a request as an adapter sends it, or an END as a person sends it."""
        now = WALL + self.story.now + self.sent * 1e-3
        self.sent += 1
        door = 2 if kind != END or by_person else 0
        return LiftRequest("Lift1", stamp(now if at is None else at), who, int(kind), floor, door)

    def says(self, *requests: LiftRequest) -> None:
        """Let these requests of adapters arrive in one scan."""
        self.story.receive(*((OWN_REQUESTS, request) for request in requests))
        self.story.run(self.story.now + 0.2)

    def supervisor_ends(self, *, by_person: bool = False, at: float | None = None) -> None:
        sent = stamp(WALL + self.story.now if at is None else at)
        self.story.request(LiftRequest("Lift1", sent, A, int(END), "L2", 2 if by_person else 0))
        self.story.run(self.story.now + 0.2)


def test_messages_of_an_adapter_count_only_if_the_supervisor_asks_for_another_robot() -> None:
    lift = Overheard()
    lift.adapter(AGV, "L4")
    lift.adapter(END)
    lift.adapter(END)
    assert lift.story.state == "AGV, open at L2, fleet/a to L2"
    lift.story.asks(B, "L1")
    lift.adapter(AGV, "L3")
    assert lift.story.state.endswith("fleet/a to L3")
    lift.story.asks(A, "L4")
    lift.adapter(AGV, "L1")
    assert lift.story.state.endswith("fleet/a to L4")
    assert sessions(lift.story) == ["", A]


def test_an_adapters_request_is_never_a_grant() -> None:
    lift = Overheard()
    lift.adapter(AGV, "L1", who=B)
    lift.story.asks(B, "L1")
    lift.adapter(AGV, "L1", who=B)
    lift.adapter(END, who=B)
    lift.adapter(END, who=B)
    assert sessions(lift.story) == ["", A]
    lift.story.ends(A)
    lift.adapter(AGV, "L1", who=A)
    lift.adapter(AGV, "L1", who=B)
    lift.story.run(lift.story.now + 5.0)
    assert sessions(lift.story) == ["", A, ""]
    assert lift.story.outputs == LiftOutputs()


def test_an_end_counts_when_it_is_heard_twice_without_a_newer_request() -> None:
    lift = Overheard()
    lift.story.asks(B, "L1")
    lift.adapter(END)
    lift.adapter(AGV, "L2")
    lift.adapter(END)
    assert sessions(lift.story) == ["", A]
    lift.adapter(END)
    assert sessions(lift.story) == ["", A, ""]


def test_an_old_request_does_not_count_but_an_end_without_a_stamp_counts() -> None:
    """Jazzy's fleet adapter sends an END without a stamp (RobotContext.cpp, _check_lift_state)."""
    lift = Overheard()
    lift.story.asks(B, "L1")
    lift.adapter(AGV, "L2")
    lift.adapter(AGV, "L4", at=WALL)
    lift.adapter(END, at=WALL)
    lift.adapter(END, at=WALL + 0.1)
    assert lift.story.state == "AGV, open at L2, fleet/a to L2"
    lift.adapter(END, at=0.0)
    lift.adapter(END, at=0.0)
    assert sessions(lift.story) == ["", A, ""]


def test_a_robot_whose_adapters_clock_was_set_back_still_goes_on_asking() -> None:
    lift = Overheard()
    lift.adapter(AGV, "L2")
    for _ in range(10):
        lift.adapter(AGV, "L2", at=WALL - 60.0 + lift.story.now)
        lift.story.run(lift.story.now + 0.8)
    lift.supervisor_ends()
    for _ in range(10):
        lift.adapter(AGV, "L2", at=WALL - 60.0 + lift.story.now)
        lift.story.run(lift.story.now + 0.8)
    assert sessions(lift.story) == ["", A]
    assert lift.story.outputs.hold_door is not None


def test_an_older_stamp_that_does_not_rise_is_no_sign_of_a_clock_that_was_set_back() -> None:
    lift = Overheard()
    lift.adapter(AGV, "L2")
    for _ in range(10):
        lift.adapter(AGV, "L2", at=WALL - 60.0)
        lift.story.run(lift.story.now + 0.8)
    lift.supervisor_ends()
    assert sessions(lift.story) == ["", A, ""]


def test_the_fault_names_the_other_robot_and_no_time_of_silence() -> None:
    lift = Overheard()
    lift.story.asks(B, "L1")
    at = lift.story.now
    shown = []
    for _ in range(45):
        shown += [(round(lift.story.now - at), lift.story.faults)]
        lift.story.run(lift.story.now + 1.0)
    changes = [
        s for s, before in zip(shown, [(0, None), *shown], strict=False) if s[1] != before[1]
    ]
    assert changes == [(0, []), (3, ["FORGOTTEN_BY_SUPERVISOR"])]
    assert lift.story.node.status()["faults"][0]["detail"] == (
        "lift_requests asks for fleet/b while fleet/a has the lift"
    )
    assert lift.story.outputs.hold_door is not None


def test_the_end_of_the_other_robot_ends_the_fault() -> None:
    lift = Overheard()
    lift.story.asks(B, "L1")
    lift.story.run(lift.story.now + 4.0)
    assert lift.story.faults == ["FORGOTTEN_BY_SUPERVISOR"]
    lift.story.ends(B)
    lift.adapter(AGV, "L4")
    assert (lift.story.faults, lift.story.state) == ([], "AGV, open at L2, fleet/a to L2")
    assert ons(lift.story, "call") == 1


def test_neither_the_end_of_a_third_robot_nor_an_earlier_end_ends_the_fault() -> None:
    lift = Overheard()
    lift.story.ends(B)
    assert (lift.story.faults, sessions(lift.story)) == ([], ["", A])
    lift.story.asks(B, "L1")
    lift.story.run(lift.story.now + 4.0)
    lift.story.ends("fleet/c")
    lift.adapter(AGV, "L4")
    assert lift.story.faults == ["FORGOTTEN_BY_SUPERVISOR"]
    assert lift.story.state.endswith("fleet/a to L4")


def test_a_message_that_is_delivered_twice_counts_once() -> None:
    lift = Overheard()
    lift.story.asks(B, "L1")
    at = WALL + lift.story.now
    lift.adapter(END, at=at)
    lift.adapter(END, at=at)
    assert sessions(lift.story) == ["", A]
    lift.adapter(END, at=at + 1.0)
    assert sessions(lift.story) == ["", A, ""]


def test_the_session_for_which_the_supervisor_asked_last_is_named_and_its_end_ends_the_fault() -> (
    None
):
    lift = Overheard()
    lift.story.asks(B, "L1")
    lift.story.asks("fleet/c", "L3")
    lift.story.run(lift.story.now + 4.0)
    lift.story.ends(B)
    detail = lift.story.node.status()["faults"][0]["detail"]
    assert detail == "lift_requests asks for fleet/c while fleet/a has the lift"
    lift.story.ends("fleet/c")
    assert lift.story.faults == []
