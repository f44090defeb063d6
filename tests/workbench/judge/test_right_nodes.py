"""The verdicts of the judge on correct nodes. The judge must accuse no such node, however much the node
differs from ours."""

import pytest

from tests.workbench.judge.nodes.different import (
    ChargerInError,
    DoorOnChange,
    EagerLift,
    LeasedDoor,
    LiftInFire,
    LiftWithoutModes,
    SimulatedLift,
    SlowLift,
)
from tests.workbench.judge.nodes.right_charger import RightCharger
from tests.workbench.judge.nodes.right_door import RightDoor
from tests.workbench.judge.nodes.right_lift import RightLift
from tests.workbench.judge.world import charges, passes, rides

NOT_RIDDEN = {"L10.board", "L10.grant", "L12.false", "L12.retained"}


@pytest.mark.parametrize(("robots", "restarts"), [(1, False), (1, True), (2, False), (2, True)])
@pytest.mark.parametrize(
    "node", [RightLift, SimulatedLift, SlowLift, EagerLift, LiftWithoutModes, LiftInFire]
)
def test_a_right_lift_is_not_accused(node: type[RightLift], robots: int, restarts: bool) -> None:
    found, why = rides(node(), robots=robots, restarts=restarts)
    assert found["broken"] == set()
    assert why == "" or node is LiftInFire


def test_a_ride_sees_every_law_but_those_of_fire_kept() -> None:
    found, _ = rides(RightLift())
    assert found["not seen"] == NOT_RIDDEN


@pytest.mark.parametrize("restarts", [False, True])
@pytest.mark.parametrize("node", [RightDoor, DoorOnChange, LeasedDoor])
def test_a_right_door_is_not_accused(node: type[RightDoor], restarts: bool) -> None:
    found, why = passes(node(), restarts=restarts)
    assert (found["broken"], why) == (set(), "")


@pytest.mark.parametrize("node", [RightCharger(), RightCharger(2.0), ChargerInError()])
def test_a_right_charger_is_not_accused(node: RightCharger) -> None:
    found, why = charges(node)
    assert found["broken"] == set()
    assert why == ("not assigned in 20 s" if isinstance(node, ChargerInError) else "")
