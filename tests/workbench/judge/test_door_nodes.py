"""The verdicts of the judge on door nodes with a defect. Only the law that the node breaks may convict
the node."""

import pytest

from bridges.messages import topics
from tests.workbench.judge.nodes.right_door import RightDoor
from tests.workbench.judge.nodes.wrong_door import (
    CloseDrivesShut,
    DoorAnswers,
    DoorFallsSilent,
    DoorFlaps,
    DoorHearsAdapters,
    DoorNumbersMixed,
    DoorStaleOpen,
    DoorVendorCodes,
    DoorWithoutStamps,
    OpenAsAsked,
    SilenceCloses,
)
from tests.workbench.judge.script import Script, door
from tests.workbench.judge.world import passes, watched
from workbench.rmf_model import Party
from workbench.rmf_model.supervisors import DoorSupervisor

RED, BLUE = "fleet/red", "fleet/blue"


@pytest.mark.parametrize(
    ("node", "law"),
    [
        (SilenceCloses, "D2.stays"),
        (DoorStaleOpen, "D3.fresh"),
        (DoorAnswers, "D1.answer"),
        (DoorNumbersMixed, "D2.opens"),
        (DoorFlaps, "D2.holds"),
        (OpenAsAsked, "D3.travel"),
        (DoorVendorCodes, "T1.numbers"),
        (DoorWithoutStamps, "D3.stamp"),
        (DoorFallsSilent, "D1.rate"),
    ],
)
def test_passages_find_the_defect(node: type[RightDoor], law: str) -> None:
    found, _ = passes(node())
    assert found["broken"] == {law}


PUSHES = (5.0, 20.0, 35.0)


@pytest.mark.parametrize(("node", "broken"), [(CloseDrivesShut, {"D2.people"}), (RightDoor, set())])
def test_a_door_that_people_opened_is_closed_by_rmf_and_shut_by_nobody(
    node: type[RightDoor], broken: set[str]
) -> None:
    """If no robot has requested the door, RMF's supervisor answers each state of the open door with
    CLOSE."""
    found = watched("door", "ward", node(PUSHES), DoorSupervisor())
    assert found["broken"] == broken
    assert ("D2.people" in found["kept"]) == (not broken)


def test_one_robots_close_closes_the_door_on_another() -> None:
    """The door obeys the adapter's CLOSE, which bypasses the supervisor. Only the supervisor knows that
    the other robot needs the door."""
    adapters: Party = Script(
        (5.4, topics.ADAPTER_DOOR_REQUESTS, door(2, RED)),
        (8.4, topics.ADAPTER_DOOR_REQUESTS, door(2, BLUE)),
        (10.4, topics.ADAPTER_DOOR_REQUESTS, door(0, RED)),
    )
    found = watched("door", "ward", DoorHearsAdapters(), DoorSupervisor(), adapters, for_s=20.0)
    assert found["broken"] == {"D1.bypass"}
