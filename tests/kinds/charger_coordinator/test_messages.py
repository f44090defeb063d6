"""The coordinator accepts messages and settings, or refuses them with a reason."""

from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator import KIND, messages
from bridges.kinds.charger_coordinator.memory import CHARGING
from bridges.kinds.charger_coordinator.signals import ChargerStateHeard, Dedicated, Sighting
from bridges.kinds.shared.decision import RequestRefused
from bridges.messages import definitions as d
from bridges.settings.load import SettingsError, load
from tests.kinds.charger_coordinator.virtual_site import settings

SETTINGS = settings(near_m=2.5)
CONFIG = Path(__file__).parents[3] / "config" / "charger_coordinator.yaml"
ONE = RobotName("tiny", "AMR01")


def robot(x: float, y: float, level: str = "L1", mode: int = 1) -> Sighting:
    """Return AMR01 as the coordinator reads it from a FleetState that has the robot at this place."""
    at = d.Location(x=x, y=y, level_name=level)
    state = d.RobotState("AMR01", "", "task", 0, d.RobotMode(mode), 40.0, at)
    (seen,) = messages.accept_fleet(d.FleetState("tiny", (state,)), SETTINGS, 0.0).robots
    return seen


@pytest.mark.parametrize(
    ("x", "y", "level", "place"),
    [
        (10.0, 2.0, "L1", "charger_a"),
        (10.0, 3.9, "L1", "charger_a"),
        (10.0, 4.1, "L1", "dock_b"),
        (12.6, 2.0, "L1", None),
        (10.0, 2.0, "L2", None),
        (0.0, 4.0, "L1", "wait_2"),
        (float("nan"), 2.0, "L1", None),
    ],
)
def test_a_robot_stands_at_the_nearest_place_of_its_level(
    x: float, y: float, level: str, place: str | None
) -> None:
    assert robot(x, y, level) == Sighting(ONE, True, place, 40.0, "task")


@pytest.mark.parametrize("mode", range(12))
def test_two_robot_modes_mean_that_the_robot_charges(mode: int) -> None:
    assert robot(0.0, 2.0, mode=mode).charges == (mode in (1, 7))


def test_robots_outside_the_yaml_are_ignored() -> None:
    state = d.FleetState("tiny", (d.RobotState("stranger"),))
    assert messages.accept_fleet(state, SETTINGS, 0.0).robots == ()


STATE = d.ChargerState(d.Time(), 3, "charger_a", "", "id", "tiny", "AMR01")


def test_a_charger_state_is_read_field_by_field() -> None:
    shown = ChargerStateHeard("charger_a", CHARGING, "id", ONE)
    assert messages.accept_state(STATE, SETTINGS, 0.0) == shown


def test_assignments_of_other_nodes_count_if_they_name_one_of_our_chargers() -> None:
    message = d.ChargingAssignments(
        "tiny",
        (
            d.ChargingAssignment("AMR01", "dock_b", 0),
            d.ChargingAssignment("AMR02", "wait_2", 1),
            d.ChargingAssignment("AMR03", "nowhere", 0),
            d.ChargingAssignment("stranger", "dock_b", 0),
        ),
    )
    two, three = RobotName("tiny", "AMR02"), RobotName("tiny", "AMR03")
    dedicated = Dedicated(((ONE, "charger_b"), (two, ""), (three, "")))
    assert messages.accept_assignments(message, SETTINGS, 0.0) == dedicated


@pytest.mark.parametrize(
    ("accept", "message", "kind"),
    [
        (messages.accept_fleet, d.FleetState("other"), "fleet not ours"),
        (messages.accept_state, d.ChargerState(charger_name="x", state=1), "station not ours"),
        (messages.accept_state, d.ChargerState(charger_name="charger_a"), "unknown state"),
        (
            messages.accept_request,
            d.ChargerRequest("", "tiny", "AMR09", d.Duration(), "op"),
            "robot not ours",
        ),
        (
            messages.accept_request,
            d.ChargerRequest("", "tiny", "AMR01", d.Duration(), ""),
            "empty request_id",
        ),
        (messages.accept_withdrawal, d.ChargerCancel(), "empty request_id"),
    ],
)
def test_messages_about_other_chargers_and_robots_are_refused_with_their_name(
    accept: Any, message: Any, kind: str
) -> None:
    with pytest.raises(RequestRefused) as refused:
        accept(message, SETTINGS, 0.0)
    assert refused.value.kind == kind


@pytest.mark.parametrize(
    ("accept", "message", "kind"),
    [
        (messages.accept_state, replace(STATE, error_message="x" * 10_001), "error_message"),
        (messages.accept_state, replace(STATE, request_id="x" * 257), "request_id"),
        (messages.accept_state, replace(STATE, robot_name="x" * 257), "robot_name"),
        (
            messages.accept_fleet,
            d.FleetState("tiny", (d.RobotState("AMR01", task_id="x" * 257),)),
            "task_id",
        ),
    ],
)
def test_messages_with_texts_that_are_too_long_are_dropped(
    accept: Any, message: Any, kind: str
) -> None:
    with pytest.raises(RequestRefused) as refused:
        accept(message, SETTINGS, 0.0)
    assert refused.value.kind == f"impossible {kind}"


def test_an_alert_is_sent_once_with_its_id_and_its_time() -> None:
    stamped = messages.stamped(d.Alert(id="x"), d.Time(7, 0))
    assert stamped == d.Alert(id="x/7")


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("waits_at: wait_1", "waits_at: wait_9", "no waypoint 'wait_9' in this fleet's list"),
        ("waits_at: wait_1", "waits_at: wait_2", "'wait_2' already belongs to tiny/AMR01"),
        ("waits_at: wait_1", "waits_at: dock_b", "'dock_b' is a charger's place"),
        ("waypoint: dock_b", "waypoint: dock_x", "stands at 'dock_x', which is in no fleet's"),
        ("waypoint: dock_b", "waypoint: charger_a", "'charger_a' both stand at 'charger_a'"),
        ("[charger_b], waits", "[charger_c], waits", "no station 'charger_c'; there are"),
        ("[RX-0002]", "[RX-0001]", "'RX-0001' already belongs to tiny/AMR01"),
        ("full_percent: 100", "full_percent: 80", "is above full_percent"),
        ("coordinator:\n", "coordinator:\n  speed: 1\n", "speed"),
        (
            "waypoint: dock_b",
            "waypoints: {tiny: dock_x}",
            "'dock_x' is not in that fleet's waypoints",
        ),
        (
            "waypoint: dock_b",
            "waypoint: dock_b, waypoints: {big: x}",
            "no fleet 'big'; there are tiny",
        ),
        (
            "[RX-0002]",
            "[RX-0002], rcu: charger_a",
            "'charger_a' already belongs to the station 'charger_a'",
        ),
    ],
)
def test_a_file_that_would_mislead_robots_is_refused_at_the_wrong_place(
    tmp_path: Path, old: str, new: str, problem: str
) -> None:
    text = CONFIG.read_text()
    assert old in text
    file = tmp_path / "site.yaml"
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(SettingsError) as refused:
        load(file)
    assert problem in "\n".join(map(str, refused.value.problems))


def test_a_charger_outside_the_graph_of_a_fleet_suits_no_robot_of_that_fleet(
    tmp_path: Path,
) -> None:
    other = """    other:
      waypoints: {dock_x: {level: L1, x: 1, y: 1}, wait_9: {level: L1, x: 9, y: 9}}
      robots: {R1: {stations: [charger_b], waits_at: wait_9}}
"""
    text = CONFIG.read_text().replace("waypoint: dock_b", "waypoint: dock_x")
    file = tmp_path / "site.yaml"
    file.write_text(text.replace("  fleets:\n", "  fleets:\n" + other))
    with pytest.raises(SettingsError, match="'charger_b' is at 'dock_x', not in this fleet's list"):
        load(file)


def test_a_file_without_its_section_is_refused_with_the_missing_section(tmp_path: Path) -> None:
    file = tmp_path / "site.yaml"
    file.write_text("kind: charger_coordinator\n")
    with pytest.raises(SettingsError, match="needs 'coordinator'"):
        load(file)


def test_a_setting_that_works_badly_gives_a_warning() -> None:
    warnings = "\n".join(map(str, load(CONFIG).warnings))
    assert warnings.endswith(
        "tiny/AMR03 charges only at 'charger_b': if a charge fails there, nothing shows whether robot"
        " or charger is at fault"
    )
    assert KIND.warnings is not None
    near = [text for _, text in KIND.warnings(settings(near_m=5.0))]
    assert "'dock_b' is less than near_m (5 m) from 'charger_a'" in near
