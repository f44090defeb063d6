"""Robots of our fleet's daemon in `explain` and `watch`. The sentences say why a robot stands, and
repeat the words that the daemon publishes."""

from typing import Any

import pytest

from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.runtime.diagnostics import diagnosis
from workbench.explain.explanation import Explanation, NextStep
from workbench.explain.heard_devices import HeardDevices
from workbench.graph.board import Board, BoardRow

REMEDIES = {
    code: (f"the cause of {code}", f"mend {code}")
    for code in ("ROBOT_SILENT", "ROBOT_FAULT", "ROBOT_OFF_GRAPH", "ROBOT_PAUSED_BY_OTHERS")
}


def reported(at: float, *faults: tuple[str, str], joined: bool = True, **values: Any) -> Heard:
    """Return the fleet daemon's report on AMR01 and on itself."""
    said = {"at": "L1 pantry", "doing": "nothing", "battery": "80 %", "new_tasks": "yes"}
    robot = {
        **said,
        **values,
        "faults": [{"code": code, "detail": detail} for code, detail in faults],
        "input_age_s": 0.2,
    }
    missing = [] if joined else [{"code": "RMF_NOT_JOINED", "detail": "no schedule node"}]
    daemon = {"fleet": "tiny", "simulated": False, "faults": missing}
    message = diagnosis("robots", "fleet", daemon, {"AMR01": robot}, stamp(at))
    return Heard(at, 1_700_000_000.0 + at, "/diagnostics", message)


def explained(*heard: Heard, until: float = 11.0) -> Explanation:
    site = HeardDevices()
    for one in heard:
        site.take(one)
    site.pass_time(until, 1_700_000_000.0 + until)
    assert site.kinds("AMR01") == site.kinds("tiny/AMR01") == ["robot"]
    return site.explain("robot", "AMR01", None, REMEDIES)


def lift(at: float) -> list[Heard]:
    """Return a lift that another robot has, and AMR01's request for it."""
    wall = 1_700_000_000.0 + at
    state = d.LiftState(
        stamp(wall), "Lift1", ("L1", "L2"), "L1", "L2", d.LiftDoor.DOOR_CLOSED,
        session_id="tiny/AMR02", current_mode=d.LiftMode.MODE_AGV,
    )  # fmt: skip
    asks = d.LiftRequest("Lift1", stamp(wall), "tiny/AMR01", 1, "L2", 2)
    return [
        Heard(at, wall, "/lift_states", state),
        Heard(at, wall, "/adapter_lift_requests", asks),
        Heard(at, wall, "/lift_requests", asks),
    ]


@pytest.mark.parametrize(
    ("values", "sentence", "who"),
    [
        ({}, "tiny/AMR01 has no mission: RMF has given it nothing to do.", "nobody"),
        (
            {"doing": "navigate to L1 ward"},
            "tiny/AMR01 carries out RMF's command: navigate to L1 ward.",
            "the robot",
        ),
        (
            {"doing": "path to L1 ward, at checkpoint 1 of 3, RMF's light: stay, paused by us"},
            "tiny/AMR01 stands on its path to L1 ward, at checkpoint 1 of 3. RMF's traffic light makes"
            " it stand: another robot has the way ahead, or the robots still negotiate.",
            "the fleet adapter",
        ),
        (
            {"doing": "path to L1 ward, at checkpoint 1 of 3, RMF's light: continue"},
            "tiny/AMR01 is on its path to L1 ward, at checkpoint 1 of 3.",
            "the robot",
        ),
    ],
)
def test_a_robot_without_a_trouble_is_explained_by_its_mission(
    values: dict[str, Any], sentence: str, who: Any
) -> None:
    found = explained(reported(10.0, **values))
    assert (found.kind, found.device, found.now) == ("robot", "tiny/AMR01", (sentence,))
    assert [step.who for step in found.next] == [who]


@pytest.mark.parametrize(
    ("code", "detail", "sentence"),
    [
        ("ROBOT_SILENT", "no answer", "tiny/AMR01 is silent: no answer."),
        ("ROBOT_FAULT", "motor hot", "tiny/AMR01 reports a fault of its own: motor hot."),
        ("ROBOT_OFF_GRAPH", "9 m off", "tiny/AMR01 is off the graph: 9 m off."),
        ("ROBOT_PAUSED_BY_OTHERS", "so", "tiny/AMR01 was paused by somebody else: so."),
    ],
)
def test_a_fault_is_named_with_its_remedy(code: str, detail: str, sentence: str) -> None:
    found = explained(reported(10.0, (code, detail)))
    assert found.now == (sentence,)
    assert found.next == (NextStep("a person", f"mend {code}"),)
    (fault,) = found.faults
    assert (fault.code, fault.do) == (code, f"mend {code}")
    assert fault.since.startswith("since before"), "it was there when listening began"


def test_a_robot_that_waits_for_a_lift_is_explained_by_the_lift() -> None:
    found = explained(*lift(9.5), reported(10.0, doing="navigate to L1 lift1_L1"), *lift(10.5))
    assert found.now[0].startswith("tiny/AMR01 has waited since")
    assert any("tiny/AMR02" in text for text in found.now), "the lift's explanation says who has it"
    assert found.next


def test_a_silent_daemon_is_told_before_all_else() -> None:
    found = explained(reported(10.0, ("ROBOT_FAULT", "hot")), until=30.0)
    assert found.now[0].startswith("The last report on tiny/AMR01 came at ")
    assert "20 s ago: its daemon is not running, or is cut off." in found.now[0]


def test_a_fleet_without_rmf_is_told() -> None:
    found = explained(reported(10.0, joined=False))
    assert found.now == ("No RMF directs tiny/AMR01: no schedule node.",)


def test_all_devices_of_a_recording_list_the_robots_and_a_slip_names_the_robot() -> None:
    site = HeardDevices()
    site.take(reported(10.0))
    assert site.devices() == [("robot", "tiny/AMR01")]
    told = site.explain("lift", "tiny/AMR02", None)
    assert "these were heard: robots tiny/AMR01" in told.now[0]
    assert "did you mean tiny/AMR01?" in told.next[0].what


def test_watch_has_a_row_for_each_robot_of_the_fleets_own_daemon() -> None:
    board = Board()
    for one in (*lift(9.5), reported(10.0, ("ROBOT_FAULT", "hot")), *lift(10.5)):
        board.take(one)
    rows = board.rows(11.0, 1_700_000_011.0)
    assert rows[-1] == BoardRow(
        "robot",
        "tiny/AMR01",
        "at L1 pantry, nothing, 80 %",
        waiting="lift Lift1: L2",
        age="1.2 s",
        faults="ROBOT_FAULT (hot)",
    )
    late = board.rows(30.0, 1_700_000_030.0)[-1]
    assert (late.mark, late.wrong) == ("SILENT 20 s", True)


def test_a_robots_assigned_place_joins_its_row() -> None:
    board = Board()
    board.take(reported(10.0))
    assigned = d.ChargingAssignments("tiny", (d.ChargingAssignment("AMR01", "pad_a", 0),))
    other = d.ChargingAssignments("big", (d.ChargingAssignment("B1", "pad_b", 1),))
    for message in (assigned, other):
        board.take(Heard(10.0, 1_700_000_010.0, "/charging_assignments", message))
    rows = board.rows(11.0, 1_700_000_011.0)
    assert [(row.name, row.held_by, row.state) for row in rows] == [
        ("tiny/AMR01", "charge at pad_a", "at L1 pantry, nothing, 80 %"),
        ("big/B1", "-", "wait at pad_b"),
    ]
