"""Docking, wrong stations, and robots that are out of service (FLEET-8, FLEET-9, FLEET-10)."""

from typing import Any

import pytest

from bridges.kinds.fleet.signals import Navigate, PadHeard
from bridges.kinds.shared.decision import Fault
from tests.kinds.fleet.story import DOCK_A, PANTRY, Story, at, driving, goal

CHARGES = PadHeard("charger_a", charging=True)
DOCK_B = goal(10.0, name="charger_b", dock="dock_b")


def docking(**sample: Any) -> Story:
    """Return a story in which RMF has just ordered a robot at the pantry to dock at charger_a."""
    story = Story().see(at=at(5.0), moving=True, **sample)
    return story.order(Navigate(7, DOCK_A))


def test_docking_is_done_when_the_robot_charges() -> None:  # FLEET-8
    story = docking(charging=False).see(5.0, at=at(0.0), moving=False)
    assert (story.report.finished, story.faults) == (0, ["ROBOT_NOT_CHARGING"])
    story.see(charging=True)
    assert (story.report.finished, story.faults) == (7, [])


def test_docking_is_done_when_the_charger_reports_a_charge_of_this_robot() -> None:  # FLEET-8
    story = docking().take(PadHeard("charger_a", charging=False))
    story.see(5.0, at=at(0.0), moving=False)
    assert story.report.finished == 0
    assert story.take(CHARGES).report.finished == 7


def test_the_state_of_a_silent_charger_does_not_count() -> None:  # FLEET-8
    story = docking().take(CHARGES).see(4.0)
    assert story.see(at=at(0.0), moving=False).report.finished == 0


def test_without_readings_of_a_charge_docking_is_done_at_the_dock() -> None:  # FLEET-8
    assert docking().see(at=at(0.0), moving=False).report.finished == 7


def test_a_dock_that_is_no_charger_needs_no_charge() -> None:
    story = Story().see(at=at(0.0), charging=False)
    story.order(Navigate(7, goal(5.0, name="pantry", dock="shelf")))
    assert story.see(at=at(5.0), moving=False).report.finished == 7


def test_without_a_charge_the_robot_docks_again() -> None:  # FLEET-8
    story = docking(charging=False).see(121.0, at=at(0.0), moving=False)
    assert story.commands == [
        (0.0, "dock 7, attempt 1"),
        (60.0, "dock 7, attempt 2"),
        (120.125, "dock 7, attempt 3"),
    ]


def test_a_robot_that_charges_at_another_charger_is_at_the_wrong_station() -> None:  # FLEET-9
    story = Story().see(at=at(5.0), moving=True).order(Navigate(7, DOCK_B))
    story.see(at=at(0.0), moving=False, charging=True)
    assert story.report.finished == 0
    text = "it charges at charger_a, and was sent to charger_b"
    assert story.report.faults == (Fault("ROBOT_AT_WRONG_STATION", text),)


def test_before_the_first_dock_no_station_is_wrong() -> None:
    assert Story().see(at=at(10.0), charging=True).faults == []


def test_the_error_of_a_charger_is_reported_at_the_robot_that_was_sent_there() -> None:
    story = docking().take(PadHeard("charger_a", charging=False, error="foreign object"))
    assert story.report.faults == (Fault("CHARGER_REPORTS_ERROR", "charger_a: foreign object"),)
    assert story.see(4.0).faults == []


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"fault": "wheel motor too hot"}, "ROBOT_FAULT"),
        ({"taken_out": "manual"}, "ROBOT_TAKEN_OUT"),
    ],
)
def test_a_robot_that_cannot_serve_gets_no_new_task_until_it_can(
    changes: dict[str, Any], code: str
) -> None:  # FLEET-10
    story = driving(7, moving=True, to=PANTRY).see(**changes)
    assert (story.faults, story.report.fit, story.report.at) == ([code], False, at(0.0))
    story.see(fault="", taken_out="")
    assert (story.faults, story.report.fit) == ([], True)


def test_a_robot_that_was_never_read_gets_no_task() -> None:  # FLEET-10
    assert not Story().silence(0.1).report.fit
