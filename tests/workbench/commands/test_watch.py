"""The rows of `rmf-bridge watch` in virtual time."""

import argparse
import json

import pytest
from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.runtime.diagnostics import diagnosis
from bridges.system.columns import width
from workbench.commands import watch
from workbench.graph.board import (
    MOST_PLACES,
    Board,
    BoardRow,
    change_line,
    changes,
    fitting,
    json_line,
    repaint,
    table,
)

WALL = 1_700_000_000.0
LIFT = d.LiftState(
    lift_time=stamp(WALL),
    lift_name="Lift1",
    current_floor="L1",
    door_state=2,
    current_mode=2,
    session_id="fleet/robot",
)
DOOR = d.DoorState(stamp(WALL), "ward", d.DoorMode(0))
CHARGER = d.ChargerState(stamp(WALL), 1, "a")


def board(*messages: d.Message, at: float = 100.0) -> Board:
    made = Board()
    for message in messages:
        made.take(Heard(at, WALL, "", message))
    return made


def test_there_is_one_row_for_each_device_lifts_first_then_by_name() -> None:
    other = replace(LIFT, lift_name="A", session_id="")
    rows = board(CHARGER, DOOR, LIFT, other, LIFT).rows(100.2, WALL + 0.2)
    assert rows == [
        BoardRow("lift", "A", "car at L1, door open, mode AGV", age="0.2 s"),
        BoardRow("lift", "Lift1", "car at L1, door open, mode AGV", "fleet/robot", age="0.2 s"),
        BoardRow("door", "ward", "closed", age="0.2 s"),
        BoardRow("charger", "a", "idle", age="0.2 s"),
    ]


@pytest.mark.parametrize(
    ("age_s", "shown", "mark"),
    [
        (0.5, "0.5 s", ""),
        (3.5, "3.5 s", "STALE"),
        (119.0, "2 min", "STALE"),
        (7200.0, "2 h", "STALE"),
        (-10.0, "-10.0 s", "CLOCK AHEAD"),
    ],
)
def test_the_age_is_that_of_the_reading_and_an_old_one_is_marked(
    age_s: float, shown: str, mark: str
) -> None:
    message = replace(DOOR, door_time=stamp(WALL - age_s))
    (row,) = board(message).rows(100.0, WALL)
    assert (row.age, row.mark) == (shown, mark)


def test_a_device_that_was_never_read_has_no_age_and_is_stale() -> None:
    (row,) = board(replace(DOOR, door_time=d.Time())).rows(100.0, WALL)
    assert (row.age, row.mark) == ("never read", "STALE")


def test_a_device_that_falls_silent_is_marked_silent_and_not_stale() -> None:
    (row,) = board(DOOR, at=100.0).rows(104.2, WALL + 4.2)
    assert (row.age, row.mark) == ("4.2 s", "SILENT 4 s")


def test_a_door_shows_who_the_supervisor_says_holds_it() -> None:
    sessions = (d.Session(d.Time(), "fleet/a"), d.Session(d.Time(), "fleet/b"))
    heartbeat = d.SupervisorHeartbeat((d.DoorSessions("ward", sessions),))
    (row,) = board(DOOR, heartbeat).rows(100.0, WALL)
    assert row.held_by == "fleet/a fleet/b"
    (row,) = board(DOOR, heartbeat, d.SupervisorHeartbeat()).rows(100.0, WALL)
    assert row.held_by == "-"


def told(kind: str, name: str, *codes: str, node: str = "node") -> d.DiagnosticArray:
    """Return the diagnostics that one of our daemons publishes about a device."""
    faults = [{"code": code, "detail": ""} for code in codes]
    status = {"faults": faults, "input_age_s": 0.1}
    return diagnosis(node, kind, {}, {name: status}, d.Time())


def test_a_row_names_the_faults_that_its_daemon_and_its_supervisor_report() -> None:
    heard = board(
        LIFT,
        told("lift", "Lift1", "RMF_SILENT", "OVERLOAD"),
        told("lift_supervisor", "Lift1", "HOLDER_SILENT", node="supervisor"),
        told("lift", "Lift2", "OVERLOAD"),
        told("door", "Lift1", "DOOR_SILENT"),
    )
    (row,) = heard.rows(100.0, WALL)
    assert row.faults == "RMF_SILENT; OVERLOAD; HOLDER_SILENT"
    heard.take(Heard(101.0, WALL, "", told("lift", "Lift1")))
    assert [row.faults for row in heard.rows(101.0, WALL)] == ["HOLDER_SILENT"]
    (silent,) = heard.rows(104.0, WALL)
    assert (silent.mark, silent.faults) == ("SILENT 4 s", "HOLDER_SILENT")
    heard.take(Heard(104.0, WALL, "", LIFT))
    assert [row.faults for row in heard.rows(104.0, WALL)] == [""]


def test_diagnostics_of_others_and_of_the_daemon_itself_name_no_fault_of_a_device() -> None:
    stranger = d.DiagnosticStatus(2, "camera: lens", "DIRTY", "Lift1")
    heard = board(LIFT, d.DiagnosticArray(d.Header(), (stranger,)))
    heard.take(
        Heard(100.0, WALL, "", diagnosis("Lift1", "lift", {"simulated": True}, {}, d.Time()))
    )
    assert [row.faults for row in heard.rows(100.0, WALL)] == [""]


def test_faults_have_a_column_when_there_are_any_and_are_a_change() -> None:
    first = board(LIFT, DOOR).rows(100.0, WALL)
    faulty = board(LIFT, DOOR, told("door", "ward", "DOOR_SILENT")).rows(100.0, WALL)
    assert table(faulty) == [
        "kind  name   state                           held by      age    faults",
        "lift  Lift1  car at L1, door open, mode AGV  fleet/robot  0.0 s",
        "door  ward   closed                          -            0.0 s  DOOR_SILENT",
    ]
    (row,) = changes(first, faulty)
    assert change_line(row, WALL).endswith("age 0.0 s  DOOR_SILENT")
    assert repaint(faulty, 0, columns=80, lines=24)[0].count("\x1b[31m") == 1
    assert "\x1b[31m" not in repaint(faulty, 0, columns=80, lines=24, coloured=False)[0]
    line = json.loads(json_line(row, WALL))
    assert (line["at"], line["name"], line["faults"]) == (WALL, "ward", "DOOR_SILENT")


def test_a_device_is_shown_once_it_is_known_whether_it_is_simulated() -> None:
    """`watch` waits briefly for diagnostics, which say whether a device is simulated. The node of a
    real device may never publish diagnostics."""
    young = board(LIFT)
    assert watch.settled(young, 100.0, WALL) == []
    assert [row.simulated for row in watch.settled(young, 101.5, WALL)] == [False]
    young.take(Heard(100.0, WALL, "", told("lift_supervisor", "Lift1")))
    assert watch.settled(young, 100.0, WALL) == []
    young.take(Heard(100.0, WALL, "", told("lift", "Lift1")))
    assert [row.name for row in watch.settled(young, 100.0, WALL)] == ["Lift1"]


def test_text_that_a_narrow_terminal_would_cut_off_follows_on_its_own_line() -> None:
    faulty = board(LIFT, DOOR, told("door", "ward", "DOOR_SILENT")).rows(100.0, WALL)
    text, lines = repaint(faulty, 0, columns=40, lines=24, coloured=False)
    assert (lines, text.replace("\r\x1b[K", "").replace("\x1b[J", "").splitlines()) == (
        4,
        [
            "kind  name   state                     ",
            "lift  Lift1  car at L1, door open, mode",
            "door  ward   closed                    ",
            "  DOOR_SILENT",
        ],
    )


def test_at_80_columns_no_line_is_wider_and_simulated_is_not_torn() -> None:
    faults = "RUNTIME_LIMIT_EXCEEDED (not at L3 after 120 s)", "INPUTS_FAILED (no reply in 0.3 s)"
    (row,) = board(LIFT).rows(100.0, WALL)
    long = replace(row, simulated=True, mark="STALE", faults="; ".join(faults))
    lines = [line for line, _ in fitting([long], 79)]
    assert max(map(width, lines)) <= 79
    assert lines == [
        "kind  name   state                           held by      age",
        "lift  Lift1  car at L1, door open, mode AGV  fleet/robot  0.0 s",
        "  SIMULATED STALE RUNTIME_LIMIT_EXCEEDED (not at L3 after 120 s); INPUTS_FAILED",
        "    (no reply in 0.3 s)",
    ]


def test_a_pipe_gets_a_line_for_each_change_and_none_for_an_age() -> None:
    opened = replace(DOOR, current_mode=d.DoorMode(2))
    first = board(DOOR, LIFT).rows(100.0, WALL)
    older = board(DOOR, LIFT).rows(102.0, WALL + 2)
    silent = board(DOOR, LIFT).rows(104.0, WALL + 4)
    silent_longer = board(DOOR, LIFT).rows(114.0, WALL + 14)
    moved = board(LIFT, opened).rows(100.0, WALL)
    assert changes([], first) == first
    assert changes(first, older) == []
    assert [row.mark for row in changes(older, silent)] == ["SILENT 4 s", "SILENT 4 s"]
    assert changes(silent, silent_longer) == []
    assert [row.state for row in changes(first, moved)] == ["open"]


def test_a_change_line_can_be_grepped() -> None:
    (row,) = board(LIFT).rows(100.0, WALL)
    assert change_line(row, WALL).split()[1:] == [
        *("lift", "Lift1", "car", "at", "L1,", "door", "open,", "mode", "AGV"),
        *("fleet/robot", "age", "0.0", "s"),
    ]


def test_the_table_is_aligned_under_its_heading() -> None:
    assert table(board(LIFT, DOOR).rows(100.0, WALL)) == [
        "kind  name   state                           held by      age",
        "lift  Lift1  car at L1, door open, mode AGV  fleet/robot  0.0 s",
        "door  ward   closed                          -            0.0 s",
    ]


def test_an_empty_graph_is_said_to_be_empty_until_the_first_row_comes() -> None:
    assert repaint([], 0, columns=80, lines=24) == ("\r\x1b[Knothing heard yet\n\x1b[J", 1)
    text, shown = repaint(board(DOOR).rows(100.0, WALL), 1, columns=80, lines=24)
    assert text.startswith("\x1b[1A\r\x1b[Kkind")
    assert shown == 2


def test_a_repaint_goes_back_over_its_own_lines_and_wraps_no_line() -> None:
    rows = board(LIFT, DOOR).rows(100.0, WALL)
    text, shown = repaint(rows, 0, columns=20, lines=24)
    assert shown == 3
    assert text.startswith("\r\x1b[Kkind  name   state \n")
    again, shown = repaint(rows, shown, columns=80, lines=24)
    assert again.startswith("\x1b[3A\r")
    assert shown == 3


def test_a_line_of_wide_letters_wraps_no_more_than_another() -> None:
    wide = replace(DOOR, door_name="北翼病房自动门")
    text, _ = repaint(board(wide).rows(100.0, WALL), 0, columns=20, lines=24, coloured=False)
    lines = text.replace("\r\x1b[K", "").replace("\x1b[J", "").splitlines()
    assert lines[1] == "door  北翼病房自动"
    assert max(map(width, lines)) <= 19


def test_a_repaint_that_does_not_fit_says_how_much_is_left_out() -> None:
    doors = [replace(DOOR, door_name=f"door{n}") for n in range(10)]
    text, shown = repaint(board(*doors).rows(100.0, WALL), 0, columns=80, lines=6)
    assert shown == 5
    assert "… and 7 more" in text
    assert "door4" not in text


def test_a_marked_row_is_red_on_a_terminal() -> None:
    text, _ = repaint(board(LIFT, DOOR).rows(104.0, WALL), 0, columns=80, lines=24)
    assert text.count("\x1b[31m") == 2


@pytest.mark.parametrize(
    ("line", "seconds"), [([], None), (["--once"], 3.0), (["--once", "0.5"], 0.5)]
)
def test_once_listens_for_three_seconds_unless_told_otherwise(
    line: list[str], seconds: float | None
) -> None:
    parser = argparse.ArgumentParser()
    watch.add_arguments(parser)
    assert parser.parse_args(line).once == seconds


@pytest.mark.parametrize("seconds", ["0", "-1", "nan", "inf", "x"])
def test_a_time_in_which_nothing_can_be_heard_is_a_usage_error(
    seconds: str, capsys: pytest.CaptureFixture[str]
) -> None:
    parser = argparse.ArgumentParser()
    watch.add_arguments(parser)
    with pytest.raises(SystemExit, match="2"):
        parser.parse_args([f"--once={seconds}"])
    assert f"--once: '{seconds}': write 0.1 to 86400 seconds" in capsys.readouterr().err


@pytest.mark.parametrize("domain", ["-1", "233", "x", "1.5"])
def test_an_impossible_domain_is_a_usage_error(domain: str) -> None:
    parser = argparse.ArgumentParser()
    watch.add_arguments(parser)
    with pytest.raises(SystemExit) as left:
        parser.parse_args(["--domain-id", domain])
    assert left.value.code == 2


def test_robots_are_shown_with_the_place_that_they_are_assigned_to_charge_or_to_wait() -> None:
    fleet = d.ChargingAssignments(
        "tiny",
        (d.ChargingAssignment("AMR02", "wait_2", 1), d.ChargingAssignment("AMR01", "charger_a", 0)),
    )
    assert board(fleet).rows(100.0, WALL) == [
        BoardRow("robot", "tiny/AMR01", "charge at charger_a"),
        BoardRow("robot", "tiny/AMR02", "wait at wait_2"),
    ]


def daemon(node: str, kind: str, **status: object) -> d.DiagnosticArray:
    """Return the diagnostics of a daemon. They contain the daemon's status and the device Lift1."""
    lift = {"faults": [{"code": "OVERLOAD", "detail": "since 3 s"}], "input_age_s": 0.1}
    return diagnosis(node, kind, status, {"Lift1": lift}, d.Time())


def test_a_simulation_is_marked_and_a_simulated_supervisor_does_not_make_its_lift_one() -> None:
    simulated = board(LIFT, daemon("node", "lift", simulated=True))
    (row,) = simulated.rows(100.0, WALL)
    assert row.cells()[-2:] == ("SIMULATED", "OVERLOAD (since 3 s)")
    (row,) = simulated.rows(200.0, WALL)
    assert row.cells()[-2:] == ("SIMULATED SILENT 100 s", "OVERLOAD (since 3 s)")
    (row,) = board(LIFT, daemon("node", "lift_supervisor", simulated=True)).rows(100.0, WALL)
    assert not row.simulated


def test_counting_seconds_are_not_a_change_and_a_new_word_is_one() -> None:
    def said(detail: str) -> list[BoardRow]:
        status = {"faults": [{"code": "OVERLOAD", "detail": detail}], "waiting": "fleet/b (3 s)"}
        told = diagnosis("node", "lift_supervisor", {}, {"Lift1": status}, d.Time())
        return board(LIFT, told).rows(100.0, WALL)

    assert changes(said("since 3 s"), said("since 4.5 s")) == []
    assert changes(said("since 3 s"), said("gone")) == said("gone")


def test_a_lift_shows_who_waits_for_it() -> None:
    status = {"session": "fleet/robot", "waiting": "fleet/b (12 s)"}
    supervisor = diagnosis("lift_supervisor", "lift_supervisor", {}, {"Lift1": status}, d.Time())
    rows = board(LIFT, supervisor).rows(100.0, WALL)
    assert table(rows) == [
        "kind  name   state                           held by      waiting         age",
        "lift  Lift1  car at L1, door open, mode AGV  fleet/robot  fleet/b (12 s)  0.0 s",
    ]
    assert "  waiting: fleet/b (12 s)  " in change_line(rows[0], WALL)


def test_the_coordinator_has_a_row_with_its_queue_its_faults_and_whether_it_assigns() -> None:
    site = {
        "a": "CHARGING tiny/AMR01",
        "queue": "tiny/AMR02, tiny/AMR03",
        "faults": [{"code": "STATION_SILENT", "detail": "b: no ChargerState comes"}],
        "input_age_s": 0.2,
    }

    def told(passive: bool) -> d.DiagnosticArray:
        faults = [{"code": "PASSIVE", "detail": "/other publishes charger_requests"}]
        daemon = {"passive": True, "faults": faults} if passive else {}
        return diagnosis("coordinator", "charger_coordinator", daemon, {"": site}, d.Time())

    row = BoardRow(
        "coordinator",
        "coordinator",
        "assigns chargers",
        waiting="tiny/AMR02, tiny/AMR03",
        faults="STATION_SILENT (b: no ChargerState comes)",
    )
    assert board(told(passive=False)).rows(100.0, WALL) == [row]
    passive = replace(row, state="passive: /other publishes charger_requests")
    assert board(told(passive=True)).rows(100.0, WALL) == [passive]
    site["assigns"] = "no: another node publishes charging_assignments"
    site["schedule"] = "22:00-05:00 tiny to 98 %: under way"
    beside = (
        "requests chargers that another node assigns, schedule 22:00-05:00 tiny to 98 %: under way"
    )
    assert board(told(passive=False)).rows(100.0, WALL) == [replace(row, state=beside)]
    silent = replace(row, state=beside, mark="SILENT 4 s")
    assert board(told(passive=False)).rows(104.0, WALL) == [silent]


def test_made_up_daemons_and_robots_are_bounded_and_give_way_when_they_fall_silent() -> None:
    made = board(LIFT)
    for number in range(5000):
        flood = diagnosis(f"made_up{number}", "lift", {}, {}, stamp(WALL))
        made.take(Heard(100.0, WALL, "", flood))
        place = d.ChargingAssignment(f"robot{number}", "pad", d.ChargingMode(1))
        made.take(Heard(100.0, WALL, "", d.ChargingAssignments("fleet", (place,))))
    told = diagnosis("node", "lift", {"simulated": True}, {"Lift1": {}}, stamp(WALL))
    made.take(Heard(100.1, WALL, "", told))
    assert [row.simulated for row in made.rows(100.2, WALL) if row.kind == "lift"] == [False]
    made.take(Heard(104.0, WALL, "", told))
    rows = made.rows(104.1, WALL)
    assert [row.simulated for row in rows if row.kind == "lift"] == [True]
    assert len([row for row in rows if row.kind == "robot"]) == MOST_PLACES
