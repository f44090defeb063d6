"""The verdicts of the judge on charger nodes with a defect. Only the law that the node breaks may
convict the node."""

import pytest

from tests.workbench.judge.nodes.right_charger import RightCharger
from tests.workbench.judge.nodes.wrong_charger import (
    AnyCancelCancels,
    ChargerAnswers,
    ChargerFallsSilent,
    ChargerIdleFromMemory,
    ChargerIgnoresCancels,
    ChargerIsTakenOver,
    ChargerNamesAnotherRobot,
    ChargerTalksAlways,
    ChargerVendorCodes,
    ChargerWaitsForEver,
    ChargerWithoutIds,
    ChargerWithoutStamps,
)
from tests.workbench.judge.script import charge
from tests.workbench.judge.world import charges, watched


@pytest.mark.parametrize(
    ("node", "law"),
    [
        (ChargerVendorCodes(), "C1.numbers"),
        (ChargerWithoutIds(), "C5.id"),
        (ChargerTalksAlways(), "C5.text"),
        (ChargerNamesAnotherRobot(), "C5.robot"),
        (ChargerIgnoresCancels(), "C3.cancel"),
        (AnyCancelCancels(), "C3.foreign"),
        (ChargerWithoutStamps(), "C4.stamp"),
        (ChargerFallsSilent(), "C4.rate"),
    ],
)
def test_a_request_finds_the_defect(node: RightCharger, law: str) -> None:
    found, _ = charges(node)
    assert found["broken"] == {law}


def test_a_station_that_shows_idle_from_memory_is_found_by_watching() -> None:
    assert watched("charger", "bay1", ChargerIdleFromMemory())["broken"] == {"C4.fresh"}


def test_a_charge_that_the_next_request_takes_over_is_found_by_watching() -> None:
    robots = charge(2.0, "red", "r1"), charge(8.0, "blue", "r2")
    found = watched("charger", "bay1", ChargerIsTakenOver(2.0), *robots, for_s=12.0)
    assert found["broken"] == {"C1.keeps"}
    found = watched("charger", "bay1", RightCharger(2.0), *robots, for_s=12.0)
    assert found["broken"] == set()


def test_a_request_that_is_repeated_is_not_answered_by_a_state() -> None:
    asked = [charge(5.2 + n, "red", "r1") for n in range(16)]
    assert watched("charger", "bay1", ChargerAnswers(), *asked)["broken"] == {"C4.answer"}
    assert watched("charger", "bay1", RightCharger(), *asked)["broken"] == set()


def test_a_robot_that_never_comes_keeps_the_station_for_ever() -> None:
    asked = charge(2.0, "red", "r1", timeout_s=5)
    assert watched("charger", "bay1", ChargerWaitsForEver(), asked)["broken"] == {"C2.start"}
    assert watched("charger", "bay1", RightCharger(), asked)["broken"] == set()
