"""Robots of our fleet's daemon in `explain` and `watch`. The sentences say why a robot stands, and
repeat the words that the daemon publishes."""

from typing import Any

import pytest
from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.runtime.diagnostics import diagnosis
from workbench.explain.explanation import Explanation, NextStep
from workbench.explain.heard_devices import HeardDevices
from workbench.explain.robot import OF_OTHERS
from workbench.graph.board import Board, BoardRow

REMEDIES = {
    code: (f"the cause of {code}", f"mend {code}")
    for code in (
        "ROBOT_NOT_READ",
        "CHARGER_REPORTS_ERROR",
        "ROBOT_SILENT",
        "ROBOT_FAULT",
        "ROBOT_OFF_GRAPH",
        "ROBOT_PAUSED_BY_OTHERS",
    )
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
        ("ROBOT_NOT_READ", "old", "tiny/AMR01 cannot be read: old."),
        (
            "CHARGER_REPORTS_ERROR",
            "E1",
            "tiny/AMR01 is at a charger in error, or was sent there: E1.",
        ),
        ("ROBOT_FAULT", "motor hot", "tiny/AMR01 reports a fault of its own: motor hot."),
        ("ROBOT_OFF_GRAPH", "9 m off", "tiny/AMR01 is off the graph: 9 m off."),
        ("ROBOT_PAUSED_BY_OTHERS", "so", "tiny/AMR01 is paused, and not by RMF: so."),
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


def test_a_robot_whose_daemon_is_silent_is_also_explained_by_the_lift_that_it_waits_for() -> None:
    heard = [one for at in range(12, 30) for one in lift(float(at))]
    found = explained(reported(10.0, doing="navigate to L1 lift1_L1"), *heard, until=29.5)
    assert found.now[0].startswith("The last report on tiny/AMR01 came at ")
    assert found.now[1].startswith("tiny/AMR01 has waited since")
    assert found.next[0].what == "run `rmf-bridge status` on the machine of the fleet's daemon"


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


# ---- robots of another node's fleet


def coordinated(at: float, queue: str) -> Heard:
    """Return the coordinator's report with this queue."""
    site = {"queue": queue, "faults": [], "input_age_s": 0.2}
    message = diagnosis("coordinator", "charger_coordinator", {}, {"site": site}, stamp(at))
    return Heard(at, 1_700_000_000.0 + at, "/diagnostics", message)


def of_others(name: str, *heard: Heard) -> Explanation:
    site = HeardDevices()
    for one in heard:
        site.take(one)
    assert site.kinds(name) == ["robot"]
    return site.explain("robot", name, None, REMEDIES)


def test_a_robot_of_another_fleet_is_explained_by_the_lift_that_it_waits_for_or_has() -> None:
    heard = [one for at in range(9) for one in lift(float(at))]
    told = of_others("AMR01", *heard)
    assert told.device == "tiny/AMR01"
    assert told.now[0].startswith("tiny/AMR01 has waited since before 22:13:20")
    assert any("tiny/AMR02" in text for text in told.now)
    assert told.notes == (OF_OTHERS,)
    assert "tiny/AMR02" in of_others("tiny/AMR02", *heard).now[0]


def test_a_robot_that_was_heard_without_a_wish_waits_for_nothing_that_was_heard() -> None:
    fleet = d.FleetState("tiny", (d.RobotState("AMR04"),))
    told = of_others("AMR04", Heard(0.0, 1_700_000_000.0, "/fleet_states", fleet))
    assert told.now == (
        "tiny/AMR04 waits for no lift, door or charger that was heard, and has none.",
    )
    assert [step.who for step in told.next] == ["a person"]


@pytest.mark.parametrize("ours", [True, False])
def test_a_robot_that_asks_for_a_device_without_states_waits_for_that_device(ours: bool) -> None:
    known = d.LiftState(stamp(0.0), "Lift1", ("L1",), "L1", "", 0, session_id="other/x")
    asks = d.LiftRequest("lift1", stamp(0.0), "tiny/AMR01", 1, "L2", 2)
    heard = [
        Heard(0.0, 1_700_000_000.0, "/lift_states", known),
        Heard(0.2, 1_700_000_000.2, "/adapter_lift_requests", asks),
    ]
    if ours:
        heard.append(reported(2.0))
    told = of_others("tiny/AMR01", *heard)
    assert told.now[0].startswith("tiny/AMR01 has asked for lift lift1 since ")
    assert told.now[1].startswith("Nobody publishes a state of lift1")
    assert "did you mean Lift1?" in told.next[0].what


def test_an_alarm_is_said_first_and_its_end_is_the_next_step_of_a_robot() -> None:
    for fleets, stands in (("-", True), ('["tiny"]', True), ('["big"]', False)):
        stated = {"alarm state": "alarm", "alarm causes": "fire_panel", "alarm fleets": fleets}
        message = diagnosis("panel", "alarm", stated, {}, stamp(9.0))
        panel = Heard(9.0, 1_700_000_009.0, "/diagnostics", message)
        told = explained(panel, reported(10.0, doing="navigate to L1 ward"))
        assert ("must stand still because fire_panel" in told.now[0]) == stands
        assert [step.who for step in told.next] == ["a person" if stands else "the robot"]


def test_a_robot_of_our_fleet_that_has_a_lift_is_explained_by_that_lift_too() -> None:
    heard = [one for at in range(20) for one in lift(float(at))]
    report = reported(19.5)
    mine = [
        replace(one, message=replace(one.message, session_id="tiny/AMR01"))
        if isinstance(one.message, d.LiftState)
        else replace(one, message=replace(one.message, session_id="tiny/AMR02"))
        for one in heard
        if isinstance(one.message, d.LiftState | d.LiftRequest)
    ]
    told = explained(*mine, report, until=19.6)
    assert told.now[:2] == (
        "tiny/AMR01 has no mission: RMF has given it nothing to do.",
        "tiny/AMR01 has lift Lift1.",
    )
    assert "tiny/AMR02 has waited" in told.now[2]
    assert [step.who for step in told.next] == ["a person"]


def test_a_fault_of_the_robot_that_has_a_lift_is_told_of_the_lift() -> None:
    site = HeardDevices()
    for at in range(8):
        for one in lift(float(at)):
            if isinstance(one.message, d.LiftState):
                site.take(replace(one, message=replace(one.message, session_id="tiny/AMR01")))
            elif isinstance(one.message, d.LiftRequest):
                site.take(one)
    site.take(reported(7.5, ("ROBOT_FAULT", "motor hot")))
    told = site.explain("lift", "Lift1", None, REMEDIES)
    assert "tiny/AMR01 reports a fault of its own: motor hot." in told.now
    assert NextStep("a person", "mend ROBOT_FAULT") in told.next
    assert not any(step.what.startswith("tiny/AMR01 has to") for step in told.next)
    own = site.explain("robot", "AMR01", None, REMEDIES).now
    assert len(set(own)) == len(own), "the lift's sentences do not repeat the robot's"
    site.take(reported(7.6, ("ROBOT_ON_OTHER_MAP", "normal in a lift")))
    assert not any("map" in text for text in site.explain("lift", "Lift1", None).now)


@pytest.mark.parametrize(
    ("code", "detail", "sentence"),
    [
        ("RMF_TAKES_NO_ROBOT", "AMR02: x; y", ""),
        ("RMF_TAKES_NO_ROBOT", "AMR01: off the graph", "RMF's adapter does not take tiny/AMR01"),
        ("NO_ROUTER", "no answer", "The daemon of tiny/AMR01 has the fault NO_ROUTER: no answer."),
        ("PASSIVE", "so", "The daemon of tiny/AMR01 has the fault PASSIVE: so."),
    ],
)
def test_a_fault_of_the_fleets_daemon_says_why_a_robot_has_no_mission(
    code: str, detail: str, sentence: str
) -> None:
    other = {"code": code, "detail": "AMR09: y"}
    daemon = {"fleet": "tiny", "faults": [{"code": code, "detail": detail}, other]}
    robot = {"doing": "nothing", "faults": [], "input_age_s": 0.2}
    message = diagnosis("robots", "fleet", daemon, {"AMR01": robot}, stamp(10.0))
    told = explained(Heard(10.0, 1_700_000_010.0, "/diagnostics", message))
    assert told.now[0].startswith(sentence or "tiny/AMR01 has no mission")
    assert told.next[0].what == (f"mend {code}" if sentence else "there is nothing to do")


def test_a_robot_in_the_coordinators_queue_is_explained_by_the_reason_in_the_queue() -> None:
    queue = "tiny/AMR03 by the robot: charger_a charges tiny/AMR01; porter/P 1 by the schedule: x"
    told = of_others("AMR03", coordinated(9.0, queue))
    assert told.now == (
        "tiny/AMR03 waits in the coordinator's queue, by the robot: charger_a charges tiny/AMR01.",
    )
    assert told.next == (NextStep("nobody", "wait until tiny/AMR01 leaves charger_a"),)
    assert of_others("porter/P 1", coordinated(9.0, queue)).device == "porter/P 1"
    ours = explained(
        reported(9.0), coordinated(9.5, "tiny/AMR01 by the robot: charger_a is silent")
    )
    assert ours.now == (
        "tiny/AMR01 waits in the coordinator's queue, by the robot: charger_a is silent.",
    )


def test_nothing_is_said_of_new_tasks_of_a_robot_that_rmf_can_only_pause() -> None:
    before = explained(reported(10.0, new_tasks="-")).before
    assert before.endswith("doing nothing, battery 80 %.")
