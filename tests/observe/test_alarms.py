"""The texts about alarms in `watch`, `explain` and the page. They come from our daemons'
diagnostics."""

from typing import Any

from bridges.kinds.shared import alarming
from bridges.kinds.shared.fleet_alarm import AlarmCause, FleetAlarmReport
from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.observe.alarms import ObservedAlarm, alarms
from bridges.observe.all_devices import PlainGraph
from bridges.runtime.diagnostics import diagnosis
from workbench.explain.heard_devices import HeardDevices
from workbench.graph.board import Board, BoardRow

WALL = 1_700_000_000.0
CAUSE = (AlarmCause("Panel", "fire"),)


def told(at: float, state: str, *fleets: str, panel: Any = None, **daemon: Any) -> Heard:
    """Return diagnostics in which a panel's daemon states its alarm."""
    report = FleetAlarmReport(state, CAUSE if state == "alarm" else ())
    status = {**daemon, "alarm": alarming.statement(report, frozenset(fleets))}
    devices = {} if panel is None else {"Panel": panel}
    array = diagnosis("bridge", "alarm", status, devices, stamp(WALL + at))
    return Heard(at, WALL + at, "diagnostics", array)


def observed(*heard: Heard, now: float | None = None) -> list[ObservedAlarm]:
    graph = PlainGraph()
    for one in heard:
        graph.hear(one)
    return [*alarms(graph.nodes, heard[-1].at if now is None else now)]


def test_each_state_of_an_alarm_is_one_sentence() -> None:
    def because(*heard: Heard, now: float | None = None) -> str:
        [found] = observed(*heard, now=now)
        assert found.stands
        return found.because

    alarm = (
        "Every robot is to stand because fire of Panel raised an alarm and nobody has reset bridge"
    )
    assert because(told(0.0, "alarm")) == f"{alarm}."
    silent = f"{alarm}, whose daemon has been silent since then."
    assert because(told(0.0, "alarm"), now=60.0) == silent
    assert because(told(0.0, "drill", "y", "x")) == (
        "Every robot of x, y is to stand for a drill of bridge, which ends by itself."
    )
    assert because(told(0.0, "alarm"), told(1.0, "reset")) == (
        "Every robot is to stand until another alarm ends: bridge was reset."
    )


def test_a_daemon_without_an_alarm_says_nothing() -> None:
    assert [one.stands for one in observed(told(0.0, "quiet"))] == [False]
    silent = Heard(0.0, WALL, "diagnostics", diagnosis("lift", "lift", {}, {}, d.Time()))
    assert observed(silent) == []


def test_watch_has_a_row_for_the_alarm_and_for_each_panel() -> None:
    fault = {"code": "ALARM_SOURCE_ACTIVE", "detail": "fire"}
    panel = {"state": "alarm", "active": "fire", "faults": [fault], "input_age_s": 0.1}
    board = Board()
    board.take(told(0.0, "alarm", panel=panel, simulated=True))
    stands = "ALARM: fire of Panel; every fleet is to stand"
    faults = "ALARM_SOURCE_ACTIVE (fire)"
    assert board.rows(1.0, WALL + 1) == [
        BoardRow("alarm", "bridge", stands, simulated=True),
        BoardRow("alarm", "Panel", "alarm: fire", simulated=True, faults=faults),
    ]
    assert board.rows(60.0, WALL + 60) == [BoardRow("alarm", "bridge", stands, mark="SILENT")]
    board.take(told(61.0, "drill"))
    [row, _] = [*board.rows(61.0, WALL + 61), None]
    assert row is not None
    assert row.state == "DRILL; every fleet is to stand"
    board.take(told(62.0, "quiet"))
    assert board.rows(62.0, WALL + 62) == [BoardRow("alarm", "bridge", "no alarm")]
    assert board.rows(99.0, WALL + 99) == []


def test_explain_begins_with_the_alarm_for_which_the_robots_stand() -> None:
    site = HeardDevices("Lift1")
    state = d.LiftState(lift_name="Lift1", lift_time=stamp(WALL), current_floor="L1")
    site.take(Heard(0.0, WALL, "lift_states", state))
    site.take(told(0.5, "quiet"))
    before = site.explain("lift", "Lift1", None).now
    site.take(told(1.0, "alarm"))
    alarm = (
        "Every robot is to stand because fire of Panel raised an alarm and nobody has reset bridge."
    )
    assert site.explain("lift", "Lift1", None).now[0] == alarm
    assert not any("stand" in text for text in before)
