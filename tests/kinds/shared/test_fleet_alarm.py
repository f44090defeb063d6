"""Stories of the fleets' alarm on one graph with two daemons, a stranger's node, and robots."""

from typing import Any

from msgspec.structs import replace

from bridges.kinds.shared import alarming, fleet_alarm, kept_alarm
from bridges.kinds.shared.decision import DrillOrdered, OperatorReset
from bridges.kinds.shared.fleet_alarm_memory import (
    AlarmHeard,
    AlarmNamed,
    AlarmStated,
    FleetAlarmLimits,
    FleetAlarmMemory,
    FleetAlarmReport,
)
from bridges.messages.definitions import (
    Bool,
    DiagnosticArray,
    DiagnosticStatus,
    EmergencySignal,
    Header,
    KeyValue,
    Time,
)
from bridges.messages.topics import FIRE_ALARM_TRIGGER
from tests.kinds.shared.fleets import AlarmGraph, graph

LIMITS = FleetAlarmLimits(FIRE_ALARM_TRIGGER, devices=frozenset({"Panel"}))


def said(g: AlarmGraph) -> list[tuple[float, str, bool]]:
    return [(at, who, on) for at, who, on, _ in g.said]


def test_an_alarm_is_published_once_and_ends_by_a_reset_after_its_cause() -> None:
    """FLEET-ALARM-1, FLEET-ALARM-2 and FLEET-ALARM-3."""
    g = graph(a=())
    g = g.tells("a", "fire").until(20.0)
    g = g.tells("a", "fire", "code_blue").until(30.0)
    g = g.resets("a").until(40.0)  # refused, because the fire still burns
    g = g.tells("a").until(50.0)
    assert said(g) == [(5.0, "a", True)]
    assert g.daemons["a"].faults == ("ALARM_RAISED",)
    g = g.tells("a", seen=False).resets("a").until(60.0)  # refused, because it is not read
    assert g.daemons["a"].state == "alarm"
    g = g.tells("a").resets("a").until(70.0)
    assert said(g) == [(5.0, "a", True), (60.0, "a", False)]
    g = g.resets("a").until(80.0)
    assert len(g.said) == 2


def test_a_reset_ends_the_causes_that_are_over_and_leaves_the_other_causes() -> None:
    """FLEET-ALARM-1."""
    g = graph(a=()).tells("a", "fire", "code_blue").tells("a", "code_blue").resets("a")
    memory = g.daemons["a"].memory
    assert memory is not None
    assert [str(cause) for cause in memory.latched] == ["code_blue of Panel"]


def test_a_cause_of_a_device_that_was_taken_out_of_the_file_can_be_reset() -> None:
    """FLEET-ALARM-1."""
    disk = graph(a=()).tells("a", "fire").daemons["a"].disk
    assert disk is not None
    memory = kept_alarm.restore(disk)
    gone = replace(LIMITS, devices=frozenset({"Other panel"}))
    made = fleet_alarm.decide(memory, OperatorReset(), 9.0, gone)
    assert made.memory.latched == ()


def test_a_refused_reset_names_the_causes() -> None:
    """FLEET-ALARM-1."""
    memory = graph(a=()).tells("a", "fire").daemons["a"].memory
    assert memory is not None
    made = fleet_alarm.decide(memory, OperatorReset(), 9.0, LIMITS)
    assert made.refused == "the alarm is not over: fire of Panel"


def test_two_sources_make_one_alarm_and_each_withdraws_its_retained_true() -> None:
    """FLEET-ALARM-3."""
    g = graph(a=(), b=()).tells("a", "fire").until(8.0).tells("b", "fire").until(10.0)
    g = g.tells("a").resets("a").until(20.0)
    assert said(g) == [(5.0, "a", True), (8.0, "b", True)]
    assert (g.daemons["a"].state, g.daemons["a"].faults) == ("reset", ("ALARM_WAITS",))
    assert g.stands == {"tiny": True}
    g = g.tells("b").until(30.0)
    g = g.resets("b").until(31.5)
    assert [(who, on) for _, who, on in said(g)[2:]] == [("b", False), ("a", False)]
    assert g.stands == {"tiny": False}
    assert g.until(40.0).daemons["a"].retained == ()


def test_a_source_that_dies_in_its_alarm_still_holds_the_robots() -> None:
    """FLEET-ALARM-4 and FLEET-ALARM-6: daemon a keeps the alarm of daemon b on its own disk, too."""
    g = graph(a=(), b=()).tells("a", "fire").tells("b", "fire").until(8.0)
    g = g.kill("b").until(30.0).tells("a").resets("a").until(40.0)
    assert g.stands == {"tiny": True}
    g = g.kill("a").start("a").until(60.0)
    assert (g.daemons["a"].state, g.stands) == ("reset", {"tiny": True})
    g = g.tells("b", "fire").start("b").until(70.0)
    assert said(g)[-1] == (60.0, "b", True)  # again, for adapters that have started since b died
    g = g.tells("b").resets("b").until(80.0)
    assert g.stands == {"tiny": False}
    assert {d.state for d in g.daemons.values()} == {"quiet"}


def test_the_false_of_a_stranger_frees_the_daemon_that_waits_for_a_dead_one() -> None:
    """FLEET-ALARM-4: if a daemon has been removed for ever, a person must end its alarm like this."""
    g = graph(a=(), b=()).tells("a", "fire").tells("b", "fire").until(8.0).kill("b").until(20.0)
    g = g.tells("a").resets("a").until(30.0).stranger_says(False).until(31.0)
    assert g.daemons["a"].state == "quiet"
    assert said(g)[-1] == (30.0, "a", False)


def test_an_old_false_that_is_heard_in_the_quiet_start_ends_no_other_alarm() -> None:
    """FLEET-ALARM-4 and FLEET-ALARM-6."""
    g = graph(a=(), b=()).stranger_says(False).until(6.0)
    g = g.tells("b", "fire").until(8.0).kill("b").tells("a", drill=True).tells("a").until(12.0)
    g = g.kill("a").until(20.0).start("a").until(40.0)
    assert (g.daemons["a"].state, g.stands) == ("reset", {"tiny": True})


def test_a_stranger_that_calls_the_alarm_off_is_contradicted_but_not_flooded() -> None:
    """FLEET-ALARM-5."""
    g = graph(a=()).tells("a", "fire").until(10.0).stranger_says(False)
    assert said(g) == [(5.0, "a", True), (10.0, "a", True)]
    assert g.daemons["a"].faults == ("ALARM_CONTRADICTED", "ALARM_RAISED")
    for _ in range(100):
        g = g.stranger_says(False)
    g = g.until(10.4)
    assert len(g.said) == 3
    assert g.stands == {"tiny": True}
    assert g.until(20.0).daemons["a"].faults == ("ALARM_RAISED",)


def test_a_cause_after_a_false_for_some_of_our_fleets_is_said_again() -> None:
    """FLEET-ALARM-5: daemon a waits for daemon b. The stranger has freed fleet x, but not b's fleet
    y."""
    g = graph(a=("x", "y"), b=("y",)).tells("a", "fire").tells("b", "fire").until(8.0)
    g = g.tells("a").resets("a").until(12.0).stranger_says(False, "x").until(14.0)
    assert g.stands == {"x": False, "y": True}
    g = g.tells("a", "fire").until(15.0)
    assert g.stands == {"x": True, "y": True}


def test_a_drill_ends_by_itself_and_a_cause_during_a_drill_is_an_alarm() -> None:
    """FLEET-ALARM-7."""
    g = graph(a=()).tells("a", drill=True).until(10.0)
    assert (g.daemons["a"].state, g.daemons["a"].faults) == ("drill", ("ALARM_DRILL",))
    g = g.tells("a").until(20.0)
    assert said(g) == [(5.0, "a", True), (10.0, "a", False)]
    g = g.tells("a", drill=True).tells("a", "fire", drill=True).tells("a").until(30.0)
    assert (g.daemons["a"].state, g.stands) == ("alarm", {"tiny": True})


def test_an_ordered_drill_ends_at_its_time_or_by_order() -> None:
    """FLEET-ALARM-7."""
    g = graph(a=()).drills("a", 3.95)
    assert (g.daemons["a"].state, g.daemons["a"].faults) == ("drill", ("ALARM_DRILL",))
    g = g.until(20.0).drills("a", 600.0).until(24.0).drills("a", 0.0).until(30.0)
    assert said(g) == [(5.0, "a", True), (9.0, "a", False), (20.0, "a", True), (24.0, "a", False)]
    assert g.daemons["a"].state == "quiet"


def test_an_alarm_in_an_ordered_drill_is_an_alarm_and_its_reset_lets_the_robots_drive() -> None:
    """FLEET-ALARM-7."""
    g = graph(a=()).drills("a", 600.0).tells("a", "fire").until(10.0)
    assert (g.daemons["a"].state, g.daemons["a"].faults) == ("alarm", ("ALARM_RAISED",))
    g = g.tells("a").until(20.0)
    assert g.stands == {"tiny": True}
    g = g.resets("a").until(30.0)
    assert (g.daemons["a"].state, g.stands) == ("quiet", {"tiny": False})


def test_the_death_of_the_daemon_ends_an_ordered_drill_with_its_next_start() -> None:
    """FLEET-ALARM-7."""
    g = graph(a=()).drills("a", 600.0).until(10.0).kill("a").until(20.0)
    assert g.stands == {"tiny": True}
    g = g.start("a").until(30.0)
    assert (g.daemons["a"].state, g.stands) == ("quiet", {"tiny": False})


def test_no_drill_is_ordered_in_an_alarm_or_before_other_alarms_can_be_heard() -> None:
    """FLEET-ALARM-7. An alarm of another building does not forbid a drill."""

    def refused(g: AlarmGraph, name: str) -> str:
        memory, fleets = g.daemons[name].memory, g.daemons[name].fleets
        assert memory is not None
        limits = FleetAlarmLimits(FIRE_ALARM_TRIGGER, fleets, frozenset({"Panel"}))
        return fleet_alarm.decide(memory, DrillOrdered(60.0), g.now, limits).refused

    g = graph(a=("x",), b=("x", "y"), c=("z",)).tells("b", "fire").until(8.0)
    assert refused(g, "a") == "no drill during an alarm: b"
    assert refused(g, "b") == "no drill during an alarm: fire of Panel"
    assert refused(g, "c") == ""
    started = "no drill yet: this daemon has just started, and listens for alarms"
    assert refused(g.kill("c").start("c"), "c") == started


def test_each_state_has_its_beginning_unless_a_restart_has_hidden_it() -> None:
    def since(g: AlarmGraph) -> tuple[str, float | None]:
        memory = g.daemons["a"].memory
        assert memory is not None
        return memory.state, memory.since

    g = graph(a=()).drills("a", 60.0).until(7.0)
    assert since(g) == ("drill", 5.0)
    g = g.tells("a", "fire").until(9.0).tells("a", "fire", "code_blue").until(11.0)
    assert since(g) == ("alarm", 7.0)
    assert since(g.kill("a").start("a").until(20.0)) == ("alarm", None)


def test_an_alarm_of_one_building_does_not_hold_the_other_building() -> None:
    """FLEET-ALARM-4: two buildings of one RMF, each with its own fleets."""
    g = graph(a=("x",), b=("y",)).tells("a", "fire").tells("b", "fire").until(8.0)
    g = g.tells("a").resets("a").until(12.0)
    assert g.stands == {"x": False, "y": True}
    assert g.daemons["a"].state == "quiet"


def test_without_a_named_sender_a_stranger_among_the_publishers_is_believed() -> None:
    """FLEET-ALARM-8."""
    memory = graph(a=(), b=()).until(8.0).daemons["a"].memory
    assert memory is not None

    def others(*senders: str) -> set[str]:
        heard = AlarmHeard(frozenset(senders), True)
        return set(fleet_alarm.decide(memory, heard, 9.0, LIMITS).memory.others)

    assert others("b", "c", "desk") == {"c or desk"}
    assert others("b") == {"b"}
    assert (
        fleet_alarm.decide(
            replace(memory, ours={"b": 8.0, "c": 8.0}),
            AlarmHeard(frozenset({"b", "c"}), True),
            9.0,
            LIMITS,
        ).memory.others
        == {}
    )


def test_a_sender_that_discovery_names_later_is_one_of_ours_or_a_stranger() -> None:
    """FLEET-ALARM-8."""
    memory = graph(a=(), b=()).until(8.0).daemons["a"].memory
    assert memory is not None

    def hears(memory: FleetAlarmMemory, *events: Any) -> set[str]:
        for event in events:
            memory = fleet_alarm.decide(memory, event, 9.0, LIMITS).memory
        return set(memory.others)

    true = AlarmHeard(frozenset({"unknown node 1"}), True)
    assert hears(memory, true) == {"unknown node 1"}
    assert hears(memory, true, AlarmNamed("unknown node 1", frozenset({"desk"}))) == {"desk"}
    named = AlarmNamed("unknown node 1", frozenset({"b"}))
    assert hears(memory, true, named, AlarmStated("b", False)) == set()
    named = AlarmNamed("unknown node 1", frozenset({"b", "c"}))
    assert hears(memory, true, named) == {"c"}
    unstated = replace(memory, ours={})
    assert hears(unstated, true, named) == {"b or c"}
    assert hears(unstated, true, named, AlarmStated("b", False)) == {"b or c"}
    assert hears(unstated, true, named, *(AlarmStated(n, False) for n in "bc")) == set()
    assert hears(memory, named) == set()


def test_an_alarm_is_said_on_its_topic_to_its_fleets() -> None:
    g = graph(a=("y", "x")).tells("a", "fire").until(9.0)
    assert g.said == ((5.0, "a", True, ("x", "y")),)
    assert alarming.heard(Bool(True), ["/a"]) == AlarmHeard(frozenset({"a"}), True)
    ended = alarming.heard(EmergencySignal(("x",), False), [])
    assert ended == AlarmHeard(frozenset(), False, frozenset({"x"}))


def test_a_statement_comes_back_and_hostile_statements_mean_all_fleets() -> None:
    def stated(**alarm: str) -> list[AlarmStated]:
        values = tuple(KeyValue(f"alarm {key}", text) for key, text in alarm.items())
        status = DiagnosticStatus(0, "a: daemon", "OK", "/a", values)
        return [*alarming.stated(DiagnosticArray(Header(Time()), (status,)))]

    report = FleetAlarmReport("drill")
    told = frozenset({"x", 'y"'})
    assert stated(**alarming.statement(report, told)) == [AlarmStated("a", True, told)]
    assert stated(state="reset", fleets="[1]") == [AlarmStated("a", False)]
    assert stated(fleets="[]") == []


def test_memory_that_no_daemon_wrote_is_refused() -> None:
    for kept in (b"", b"{}", b'{"version":2,"latched":[],"told":null,"others":{}}'):
        try:
            kept_alarm.restore(kept)
        except ValueError:
            continue
        raise AssertionError(kept)
