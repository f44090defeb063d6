"""The texts about alarms that `watch`, `explain` and the web page show. They are made from our daemons'
messages on `/diagnostics`."""

from datetime import UTC, datetime
from typing import Any

from bridges.kinds.shared import alarming
from bridges.kinds.shared.fleet_alarm_memory import (
    AlarmCause,
    FleetAlarmReport,
)
from bridges.messages import definitions as d
from bridges.messages.heard import Heard, Sender
from bridges.messages.stamps import stamp
from bridges.observe.alarms import ObservedAlarm, alarms
from bridges.observe.all_devices import PlainGraph
from bridges.runtime.diagnostics import diagnosis
from workbench.explain.explanation import NextStep
from workbench.explain.heard_devices import HeardDevices
from workbench.graph.board import Board, BoardRow

WALL = 1_700_000_000.0
CAUSE = (AlarmCause("Panel", "fire"),)


BEGAN = "2023-11-14T22:10:00Z"


def told(
    at: float, state: str, *fleets: str, panel: Any = None, since: str = BEGAN, **daemon: Any
) -> Heard:
    """Return a message on `/diagnostics` that has a panel's daemon with this state of its alarm."""
    report = FleetAlarmReport(state, CAUSE if state == "alarm" else ())
    statement = alarming.statement(report, frozenset(fleets))
    status = {**daemon, "alarm": {**statement, "since": since}}
    devices = {} if panel is None else {"Panel": panel}
    array = diagnosis("bridge", "alarm", status, devices, stamp(WALL + at))
    return Heard(at, WALL + at, "diagnostics", array)


def observed(*heard: Heard, now: float | None = None) -> list[ObservedAlarm]:
    graph = PlainGraph()
    for one in heard:
        graph.hear(one)
    return [*alarms(graph.nodes, graph.published, heard[-1].at if now is None else now)]


def utc(wall: float) -> str:
    return f"{datetime.fromtimestamp(wall, UTC):%H:%M}"


def test_each_state_of_an_alarm_is_one_sentence() -> None:
    def because(*heard: Heard, now: float | None = None) -> str:
        [found] = observed(*heard, now=now)
        assert found.stands
        return found.because(utc)

    alarm = (
        "Every robot must stand still because fire of Panel raised an alarm at 22:10 and nobody has"
        " reset bridge"
    )
    assert because(told(0.0, "alarm")) == f"{alarm}."
    silent = f"{alarm}, and has been silent since its last statement."
    assert because(told(0.0, "alarm"), now=60.0) == silent
    assert because(told(0.0, "drill", "y", "x")) == (
        "Every robot of x, y must stand still for a drill of bridge, which began at 22:10 and ends"
        " by itself."
    )
    assert because(told(0.0, "alarm"), told(1.0, "reset")) == (
        "Every robot must stand still until another alarm ends, although bridge was reset at 22:10."
    )
    for unknown in ("-", "soon"):
        assert "raised an alarm at an unknown time and" in because(
            told(0.0, "alarm", since=unknown)
        )


def published(at: float, on: bool, node: str = "", *fleets: str) -> Heard:
    """Return a message that begins (`on`) or ends an alarm.

    If `node` is "", the transport does not tell the sender.
    """
    sender = Sender(f"/{node}") if node else None
    if fleets:
        message = d.EmergencySignal(fleets, on)
        return Heard(at, WALL + at, "/emergency_signal", message, sender)
    return Heard(at, WALL + at, "fire_alarm_trigger", d.Bool(on), sender)


def test_an_alarm_of_another_node_stands_until_any_node_ends_it_for_its_fleets() -> None:
    """RMF's fleet adapters obey the last message, from whichever node it comes."""

    def told_of(*heard: Heard) -> list[str]:
        began = told(-9.0, "quiet")
        return [one.because(utc) for one in observed(began, *heard) if one.stands]

    desk = (
        "Every robot must stand still because desk published an alarm on fire_alarm_trigger at"
        " 22:13."
    )
    assert told_of(published(0.0, True, "desk")) == [desk]
    assert told_of(published(0.0, True, "desk"), published(9.0, False, "nurse")) == []
    of_x = published(0.0, True, "desk", "x")
    [two] = told_of(of_x, published(1.0, False, "desk", "y"))
    assert two.startswith(
        "Every robot of x must stand still because desk published an alarm on emergency"
    )
    assert told_of(of_x, published(1.0, False)) == []


def test_a_message_of_our_own_daemon_or_of_a_hidden_node_beside_it_is_not_counted_twice() -> None:
    [one] = observed(told(0.0, "alarm"), published(9.0, True, "bridge"), published(9.0, True))
    assert one.node == "bridge"


def test_in_the_beginning_an_old_end_ends_only_its_senders_alarm() -> None:
    heard = (published(0.0, True, "desk"), published(0.1, False, "nurse"))
    [one] = observed(*heard)
    assert (one.node, one.since, one.condition) == (
        "desk",
        None,
        "ALARM on fire_alarm_trigger; every fleet must stand still",
    )
    assert observed(*heard, published(0.2, False, "desk")) == []
    [hidden] = observed(published(0.0, True))
    assert hidden.node == "an unknown node"


def test_a_daemon_without_an_alarm_says_nothing() -> None:
    assert [one.stands for one in observed(told(0.0, "quiet"))] == [False]
    silent = Heard(0.0, WALL, "diagnostics", diagnosis("lift", "lift", {}, {}, d.Time()))
    assert observed(silent) == []


def test_watch_has_a_row_for_the_alarm_and_for_each_panel() -> None:
    fault = {"code": "ALARM_SOURCE_ACTIVE", "detail": "fire"}
    panel = {"state": "alarm", "active": "fire", "faults": [fault], "input_age_s": 0.1}
    board = Board()
    board.take(told(0.0, "alarm", panel=panel, simulated=True))
    stands = "ALARM: fire of Panel; every fleet must stand still"
    faults = "ALARM_SOURCE_ACTIVE (fire)"
    assert board.rows(1.0, WALL + 1) == [
        BoardRow("alarm", "bridge", stands, simulated=True),
        BoardRow("alarm", "Panel", "alarm: fire", simulated=True, faults=faults),
    ]
    silent = "SILENT 60 s"
    assert board.rows(60.0, WALL + 60) == [
        BoardRow("alarm", "bridge", stands, mark=silent, simulated=True),
        BoardRow("alarm", "Panel", "alarm: fire", mark=silent, simulated=True, faults=faults),
    ]
    board.take(told(61.0, "drill"))
    row, _ = board.rows(61.0, WALL + 61)
    assert row.state == "DRILL; every fleet must stand still"
    board.take(told(62.0, "quiet"))
    assert board.rows(62.0, WALL + 62)[0] == BoardRow("alarm", "bridge", "no alarm")
    assert board.rows(99.0, WALL + 99)[0].mark == "SILENT 37 s"


def test_explain_begins_with_the_alarm_for_which_the_robots_stand() -> None:
    site = HeardDevices("Lift1")
    state = d.LiftState(lift_name="Lift1", lift_time=stamp(WALL), current_floor="L1")
    site.take(Heard(0.0, WALL, "lift_states", state))
    site.take(told(0.5, "quiet"))
    before = site.explain("lift", "Lift1", None).now
    site.take(told(1.0, "alarm"))
    alarm = (
        "Every robot must stand still because fire of Panel raised an alarm at 22:10:00 and nobody"
        " has reset bridge."
    )
    explained = site.explain("lift", "Lift1", UTC)
    assert explained.now[0] == alarm
    how = "when the cause is over and it is safe: `rmf-bridge reset FILE` for bridge"
    assert explained.next == (NextStep("a person", how),)
    site.take(told(2.0, "drill"))
    drill = (NextStep("nobody", "the drill ends by itself"),)
    assert site.explain("lift", "Lift1", UTC).next == drill
    assert not any("stand" in text for text in before)
