"""LIFT-4, LIFT-DRIVE-5, LIFT-SENSING-3: the text of each fault."""

from typing import Any

import pytest
from msgspec.structs import replace

from bridges.kinds.lift.memory import Doubted
from bridges.kinds.lift.signals import (
    DoorReading,
    Hazard,
    LiftRequested,
    Motion,
)
from bridges.kinds.shared.decision import (
    Fault,
    MemoryNotKept,
    RivalSeen,
)
from tests.kinds.lift.alone import ASKED, AT_L1, CLOSED, Alone

UP = replace(AT_L1, motion=Motion.UP)

FAULTS: dict[str, tuple[list[tuple[float, Any]], Fault]] = {
    "a fire that was": (
        [(0.0, replace(AT_L1, hazards=frozenset({Hazard.FIRE}))), (0.5, AT_L1), (1.6, AT_L1)],
        Fault("FIRE_LATCHED", "run rmf-bridge reset when the lift is safe"),
    ),
    "a fire of which a restart would not know": (
        [(0.0, AT_L1), (0.1, MemoryNotKept("disk full"))],
        Fault(
            "NOT_KEPT",
            "a restart would not know whether the lift waits for a reset after a fire: disk full",
        ),
    ),
    "another node": (
        [(0.0, AT_L1), (0.1, RivalSeen())],
        Fault("TWO_NODES_FOR_ONE_DEVICE", "another node publishes this lift's states"),
    ),
    "a floor too far": (
        [(0.0, AT_L1), (0.1, replace(AT_L1, level="L3"))],
        Fault("POSITION_LOST", "the floor code shows L3, but no ride there from L1 was seen"),
    ),
    "a floor code that cannot be": (
        [(0.0, replace(AT_L1, level=None, code_fault="two lines at once"))],
        Fault("FLOOR_CODE_ILLEGAL", "two lines at once"),
    ),
    "a door that is both": (
        [(0.0, replace(AT_L1, door=DoorReading.BOTH))],
        Fault("DOOR_CONTACTS_CONTRADICT", "door reads open and closed"),
    ),
    "a rear door that is both": (
        [(0.0, replace(AT_L1, rear_door=DoorReading.BOTH))],
        Fault("DOOR_CONTACTS_CONTRADICT", "rear door reads open and closed"),
    ),
    "a door whose number means nothing": (
        [(0.0, replace(AT_L1, door=DoorReading.UNKNOWN))],
        Fault("DOOR_CODE_ILLEGAL", "the YAML does not list the number of the door's position"),
    ),
    "a rear door whose number means nothing": (
        [(0.0, replace(AT_L1, rear_door=DoorReading.UNKNOWN))],
        Fault("DOOR_CODE_ILLEGAL", "the YAML does not list the number of the rear door's position"),
    ),
    "up and down at once": (
        [(0.0, replace(AT_L1, motion=Motion.CONTRADICTORY))],
        Fault("MOTION_CONTRADICTORY", "the motion lines cannot all be true"),
    ),
    "AGV mode that ends": (
        [(0.0, AT_L1), (0.1, ASKED), (0.2, AT_L1), (0.3, replace(AT_L1, agv=False))],
        Fault("AGV_MODE_LOST", "AGV mode ended during the ride"),
    ),
    "AGV mode that does not come": (
        [(0.0, replace(AT_L1, agv=False)), (0.1, ASKED), (0.7, replace(AT_L1, agv=False))],
        Fault("AGV_MODE_NOT_GRANTED", "no AGV mode status after 0.5 s"),
    ),
    "a car that does not come": (
        [(0.0, AT_L1), (0.1, LiftRequested("A", True, "L3")), (0.8, AT_L1)],
        Fault("RUNTIME_LIMIT_EXCEEDED", "not at L3 after 0.6 s"),
    ),
    "a car that is not seen to stand": (
        [(0.0, UP), (0.1, LiftRequested("A", True, "L1")), (0.8, UP)],
        Fault("RUNTIME_LIMIT_EXCEEDED", "not seen to stand at L1 after 0.6 s"),
    ),
    "a door that does not open": (
        [(0.0, CLOSED), (0.1, ASKED), (0.9, CLOSED)],
        Fault("DOOR_OPENING_FAULT", "not open at L1 after 0.7 s"),
    ),
    "too much in the car": (
        [(0.0, replace(AT_L1, hazards=frozenset({Hazard.OVERLOAD})))],
        Fault("OVERLOAD", "waits until the car is lighter"),
    ),
    "RMF that is silent": (
        [(0.0, AT_L1), (0.1, ASKED), (30.2, AT_L1)],
        Fault("RMF_SILENT", "no request from A"),
    ),
    "nothing read yet": ([(0.0, ASKED)], Fault("INPUTS_NOT_FRESH", "not read yet")),
    "inputs that never keep still": (
        [(0.1 * i, replace(AT_L1, agv=bool(i % 2),
                           rear_door=(DoorReading.OPEN, DoorReading.CLOSED)[i % 2]))
         for i in range(2, 30)],
        Fault("INPUTS_NOT_FRESH", "not steady: rear_door, agv_mode"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", FAULTS)
def test_a_fault_says_what_is_wrong(what: str) -> None:
    happenings, fault = FAULTS[what]
    debounce = {"rear_door": 0.5, "agv_mode": 0.5} if "still" in what else {}
    alone = Alone(debounce, agv_timeout_s=0.5, floor_timeout_s=0.6, door_timeout_s=0.7)
    if debounce:
        settled = replace(AT_L1, rear_door=DoorReading.CLOSED)
        alone(-0.5, settled)(0.0, settled)
    for now, event in happenings:
        alone(now, event)
    assert alone.faults == (fault,)


def test_a_request_that_waits_is_explained_by_its_mode_or_by_the_faults_that_hinder_it() -> None:
    human = Alone()(0.0, AT_L1)(5.0, AT_L1, LiftRequested("A", False, "L3"))
    assert human.decision.report.waits == "for END: in HUMAN mode people call the lift"
    lift = Alone()(0.0, AT_L1)(5.0, AT_L1, ASKED)(5.2, LiftRequested("B", True, "L3"))
    unwell = replace(AT_L1, hazards=frozenset({Hazard.CODE_BLUE, Hazard.OUT_OF_SERVICE}))
    lift(5.3, unwell)(9.0, unwell)
    codes = [fault.code for fault in lift.faults]
    assert codes == ["CODE_BLUE", "OUT_OF_SERVICE", "FORGOTTEN_BY_SUPERVISOR"]
    assert lift.decision.report.waits == "for the end of CODE_BLUE, OUT_OF_SERVICE"


def test_a_request_that_was_not_repeated_or_may_be_old_says_for_which_request_it_waits() -> None:
    lift = Alone(request_timeout_s=10.0)(0.0, CLOSED)(5.0, CLOSED, LiftRequested("A", True, "L3"))
    assert lift(15.0, CLOSED).decision.report.waits == "for a request of A"
    lift = Alone()(0.0, AT_L1)(5.0, AT_L1, ASKED)(5.5, AT_L1)
    session = replace(lift.memory.session, doubted=Doubted("L3", 5.5))  # type: ignore[type-var]
    lift.memory = replace(lift.memory, session=session)
    why = "for the robot itself to ask for L3: the request may be from an earlier ride"
    assert lift(5.6, AT_L1).decision.report.waits == why


def test_a_request_waits_for_the_car_until_it_stands_and_for_nothing_once_it_is_open() -> None:
    lift = Alone()(0.0, CLOSED)(5.0, CLOSED, LiftRequested("A", True, "L3"))(5.5, CLOSED)
    away = replace(CLOSED, motion=Motion.UP)
    assert lift(6.0, away).decision.report.waits == "for the car at L3"
    near = replace(away, level="L3")
    assert (
        lift(6.5, near)(7.0, near).decision.report.waits == "for the car to be seen to stand at L3"
    )
    there = replace(CLOSED, level="L3")
    lift(7.5, there)(8.0, there)(8.6, there)
    assert lift.decision.report.waits == "for the door at L3"
    opened = replace(there, door=DoorReading.OPEN)
    lift(9.0, opened)(9.5, opened)
    assert (lift.decision.report.open_at, lift.decision.report.waits) == ("L3", "")
