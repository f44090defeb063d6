"""The verdicts of the judge on lift nodes with a defect. Only the law that the node breaks may convict
the node."""

import pytest

from bridges.messages import definitions as d
from bridges.messages import topics
from tests.workbench.judge.nodes.right_lift import RightLift
from tests.workbench.judge.nodes.wrong_lift import (
    ALARM,
    AnyEndEnds,
    EndNeedsAFloor,
    FireBoards,
    FireFrees,
    FireGrants,
    FireIsVolatile,
    FireSaysFalse,
    FloorByLastCharacter,
    FloorFlickers,
    GoesToTheDefaultFloor,
    HearsAdapters,
    LastOneWins,
    LiftAnswers,
    LiftBlocks,
    LiftFlaps,
    LiftModeMixed,
    LiftNumbersMixed,
    LiftStaleOpen,
    LiftVendorCodes,
    LiftWithoutStamps,
    OpenNowhere,
    OpenWhileMoving,
    OtherLiftsRequest,
    OwnSessionName,
    SessionTimesOut,
    ShowsWhatItWasAsked,
)
from tests.workbench.judge.script import Script, asks, lift
from tests.workbench.judge.world import rides, watched
from workbench.rmf_model import Party
from workbench.rmf_model.supervisors import LiftSupervisor

RED, BLUE = "fleet/red", "fleet/blue"


@pytest.mark.parametrize(
    ("node", "law"),
    [
        (EndNeedsAFloor, "L5.ends"),
        (LiftFlaps, "L7.holds"),
        (LiftAnswers, "L2.answer"),
        (LiftNumbersMixed, "L4.grants"),
        (LiftModeMixed, "L7.agv"),
        (LiftStaleOpen, "L7.fresh"),
        (LiftBlocks, "L2.rate"),
        (AnyEndEnds, "L5.foreign"),
        (SessionTimesOut, "L4.ends"),
        (OwnSessionName, "L4.own"),
        (FireFrees, "L4.ends"),
        (FireBoards, "L10.board"),
        (FireIsVolatile, "L12.retained"),
        (FireSaysFalse, "L12.false"),
        (OpenWhileMoving, "L7.stopped"),
        (OpenNowhere, "L7.floor"),
        (FloorFlickers, "L7.jump"),
        (LiftVendorCodes, "T1.numbers"),
        (LiftWithoutStamps, "L3.stamp"),
    ],
)
def test_a_ride_finds_the_defect(node: type[RightLift], law: str) -> None:
    found, _ = rides(node())
    assert found["broken"] == {law}


@pytest.mark.parametrize(
    ("node", "parties", "law"),
    [
        (
            OtherLiftsRequest,
            [Script((5.0, topics.LIFT_REQUESTS, lift(RED, "L3", "Lift2")))],
            "L1.other",
        ),
        (LastOneWins, [asks(6.0, RED, "L3", 3), asks(12.5, BLUE, "L1")], "L4.ends"),
        (FireGrants, [asks(5.0, RED, "L3")], "L10.grant"),
        (FloorByLastCharacter, [asks(5.0, RED, "L10", 5)], "L8.floor"),
        (GoesToTheDefaultFloor, [asks(6.0, RED, "L9", 5)], "L8.destination"),
        (ShowsWhatItWasAsked, [asks(6.0, RED, "L9", 5)], "L9.unserved"),
        (
            HearsAdapters,
            [
                Script((8.0, topics.ADAPTER_LIFT_REQUESTS, lift(BLUE, "L1"))),
                asks(7.0, RED, "L3", 5),
            ],
            "L1.bypass",
        ),
    ],
)
def test_watching_finds_the_defect(node: type[RightLift], parties: list[Party], law: str) -> None:
    found = watched("lift", "Lift1", node(), *parties)
    assert found["broken"] == {law}


def test_a_lift_whose_supervisor_has_died_owes_nobody_a_session() -> None:
    """The robot repeats its request on adapter_lift_requests only, and a lift need not obey this
    topic."""

    class Taken(RightLift):
        def serves(self, request: d.LiftRequest) -> bool:
            return False

    adapter = [(20.0 + n, topics.ADAPTER_LIFT_REQUESTS, lift(RED, "L3")) for n in range(60)]
    parties = asks(5.0, RED, "L3", 15), Script(*adapter)
    assert watched("lift", "Lift1", Taken(), *parties, for_s=90.0)["broken"] == set()


def test_a_false_of_another_node_is_not_the_lifts() -> None:
    falses = [(5.0 + n, topics.FIRE_ALARM_TRIGGER, d.Bool(False)) for n in range(9)]
    assert watched("lift", "Lift1", RightLift(), Script(*falses))["broken"] == set()


def test_with_two_lifts_nobody_knows_whose_alarm_it_is() -> None:
    class Other(RightLift):
        name = "Lift2"

    assert watched("lift", "Lift1", FireSaysFalse(), Other())["broken"] == set()


@pytest.mark.parametrize(
    ("node", "broken"), [(RightLift, set()), (FireIsVolatile, {"L12.retained"})]
)
def test_the_volatile_publisher_of_jazzys_supervisor_is_not_the_lifts(
    node: type[RightLift], broken: set[str]
) -> None:
    jazzys = Script(
        (1.0, ALARM, d.Bool(True)), (1.0, topics.LIFT_REQUESTS, lift(RED, "L1", "Lift2"))
    )
    assert watched("lift", "Lift1", node(), jazzys)["broken"] == broken


def test_an_end_without_a_floor_that_is_refused_is_found_by_watching_three_rides() -> None:
    """RMF's supervisor sends a second END, with a floor. The lift obeys the second END, so one ride
    does not prove that the lift refused the first END."""
    rides = [
        line
        for n in range(3)
        for line in (
            (10.0 + 20 * n, topics.ADAPTER_LIFT_REQUESTS, lift(RED, "L2")),
            (20.4 + 20 * n, topics.ADAPTER_LIFT_REQUESTS, lift(RED, "", kind=0)),
        )
    ]
    parties = [LiftSupervisor(), Script(*rides)]
    assert watched("lift", "Lift1", EndNeedsAFloor(), *parties, for_s=80.0)["broken"] == {"L5.ends"}
    parties = [LiftSupervisor(), Script(*rides)]
    assert watched("lift", "Lift1", RightLift(), *parties, for_s=80.0)["broken"] == set()


def test_two_robots_stand_before_a_lift_that_refuses_an_end_without_a_floor() -> None:
    """The supervisor already serves the second robot, so the supervisor sends no END for the first
    robot. No other node can release the first robot."""
    found, why = rides(EndNeedsAFloor(), robots=2)
    assert found["broken"] == {"L5.ends"}
    assert why == "RequestLift of rmf_bridge_judge/robot2 has not ended in 120 s"
