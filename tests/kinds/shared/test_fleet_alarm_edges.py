"""Details of the fleets' alarm: restarts, alarms for some fleets only, times, and texts for people."""

from typing import Any

import pytest
from msgspec.structs import replace

from bridges.kinds.shared import alarming, fleet_alarm, kept_alarm
from bridges.kinds.shared.decision import (
    AlarmInputs,
    Decision,
    DrillOrdered,
    Fault,
    OperatorReset,
)
from bridges.kinds.shared.durations import NEVER, RIVAL_QUIET_S
from bridges.kinds.shared.fleet_alarm import MOST_OTHERS
from bridges.kinds.shared.fleet_alarm_memory import (
    AlarmCause,
    AlarmHeard,
    AlarmNamed,
    AlarmStated,
    DeviceTells,
    FleetAlarmLimits,
    FleetAlarmMemory,
    FleetAlarmReport,
)
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages.definitions import Bool, EmergencySignal
from bridges.messages.topics import EMERGENCY_SIGNAL, FIRE_ALARM_TRIGGER
from tests.kinds.shared.fleets import graph

EVERY = FleetAlarmLimits(FIRE_ALARM_TRIGGER, devices=frozenset({"Panel"}))
FIRE = DeviceTells("Panel", AlarmInputs(frozenset({"fire"}), True))
CALM = DeviceTells("Panel", AlarmInputs(frozenset(), True))
DRILL = DeviceTells("Panel", AlarmInputs(frozenset(), True, drill=True))

Made = Decision[FleetAlarmMemory, None, FleetAlarmReport]


def fleets(*names: str) -> frozenset[str]:
    return frozenset(names)


def to(*names: str) -> FleetAlarmLimits:
    """Return the limits of a daemon that publishes its alarms for these fleets."""
    return FleetAlarmLimits(EMERGENCY_SIGNAL, fleets(*names), frozenset({"Panel"}))


def after(
    *events: Any,
    limits: FleetAlarmLimits = EVERY,
    memory: FleetAlarmMemory | None = None,
    now: float = 10.0,
) -> Made:
    """Give these events to the core at the time `now`. Return the decision on the last event."""
    memory = memory or replace(fleet_alarm.initial(), may_end=True)
    made: Made | None = None
    for event in events:
        made = fleet_alarm.decide(memory, event, now, limits)
        memory = made.memory
    assert made is not None
    return made


def restarted(made: Made) -> FleetAlarmMemory:
    return kept_alarm.restore(kept_alarm.persist(made.memory))


# ---- restarts


def test_bytes_that_are_no_memory_are_refused() -> None:
    with pytest.raises(ValueError, match=r"^not an alarm's memory: "):
        kept_alarm.restore(b"[]")


def test_a_cause_that_is_over_but_was_not_reset_still_latches_after_a_restart() -> None:
    """FLEET-ALARM-1 and FLEET-ALARM-6."""
    g = graph(a=()).tells("a", "fire").tells("a").until(8.0).kill("a").start("a").until(20.0)
    assert (g.daemons["a"].state, g.stands) == ("alarm", {"tiny": True})
    g = g.resets("a").until(30.0)
    assert (g.daemons["a"].state, g.stands) == ("quiet", {"tiny": False})


def test_the_memory_of_a_restart_is_whole() -> None:
    """FLEET-ALARM-6."""
    made = after(FIRE, AlarmHeard(fleets("b"), True, fleets("y")), limits=to("x"))
    assert restarted(made) == FleetAlarmMemory(
        latched=(AlarmCause("Panel", "fire"),),
        told=fleets("x"),
        owed=True,
        others={"b": fleets("y")},
        shown="alarm",
    )
    assert restarted(after(CALM)) == FleetAlarmMemory(owed=True)


def test_a_reset_before_the_device_is_read_again_is_refused() -> None:
    """FLEET-ALARM-1: after a restart there may be a fire, but the device has not been read yet."""
    made = after(OperatorReset(), memory=restarted(after(FIRE)))
    assert made.refused == "the alarm is not over: fire of Panel"
    assert made.memory.latched == (AlarmCause("Panel", "fire"),)


def test_a_reset_names_every_cause_that_is_left_and_is_not_refused_without_one() -> None:
    """FLEET-ALARM-1."""
    both = DeviceTells("Panel", AlarmInputs(fleets("fire", "code_blue"), True))
    made = after(both, OperatorReset())
    assert made.refused == "the alarm is not over: code_blue of Panel, fire of Panel"
    for events in ((FIRE, CALM, OperatorReset()), (Woken(),), (FIRE,), (MaySpeak(True),)):
        assert after(*events).refused == ""
    for event in (AlarmHeard(fleets("b"), True), AlarmNamed("b", fleets("c"))):
        assert after(event).refused == ""
    assert after(AlarmStated("b", True)).refused == ""


def test_a_daemon_whose_file_names_other_fleets_after_a_restart_tells_both_and_ends_both() -> None:
    """FLEET-ALARM-3 and FLEET-ALARM-6: the end of the alarm must also reach the fleets of the old
    file."""
    memory = restarted(after(FIRE, limits=to("x")))
    made = after(FIRE, memory=memory, limits=to("y"))
    assert made.publish == ((EMERGENCY_SIGNAL, EmergencySignal(("x", "y"), True)),)
    ended = after(MaySpeak(True), CALM, OperatorReset(), memory=made.memory, limits=to("y"))
    assert ended.publish == ((EMERGENCY_SIGNAL, EmergencySignal(("x", "y"), False)),)
    every = after(FIRE, memory=memory, limits=to())
    assert every.publish == ((EMERGENCY_SIGNAL, EmergencySignal((), True)),)
    told_all = restarted(after(FIRE, limits=to()))
    still = after(FIRE, memory=told_all, limits=to("y"))
    assert still.publish == ((EMERGENCY_SIGNAL, EmergencySignal((), True)),)


# ---- other nodes' alarms, for some fleets


def test_an_alarm_that_was_heard_stands_for_its_fleets_only() -> None:
    """FLEET-ALARM-4."""
    made = after(AlarmHeard(fleets("desk"), True, fleets("y")))
    assert made.memory.others == {"desk": fleets("y")}
    grown = after(AlarmHeard(fleets("desk"), True, fleets("z")), memory=made.memory)
    assert grown.memory.others == {"desk": fleets("y", "z")}
    for one, other in (((), ("y",)), (("y",), ())):
        heard = [AlarmHeard(fleets("desk"), True, fleets(*told)) for told in (one, other)]
        assert after(*heard).memory.others == {"desk": fleets()}
    named = after(
        AlarmHeard(fleets("unknown node 1"), True, fleets("y")),
        AlarmNamed("unknown node 1", fleets("desk")),
    )
    assert named.memory.others == {"desk": fleets("y")}


def test_a_false_for_one_fleet_ends_no_alarm_of_another_fleet() -> None:
    """FLEET-ALARM-4 and FLEET-ALARM-5."""
    others = [
        AlarmHeard(fleets(name), True, fleets(fleet)) for name, fleet in (("b", "y"), ("c", "x"))
    ]
    made = after(FIRE, *others, AlarmHeard(fleets("desk"), False, fleets("x")), limits=to("y"))
    assert made.memory.others == {"b": fleets("y")}
    assert (made.memory.owed, made.report.faults[0].code) == (False, "ALARM_RAISED")
    freed = after(
        AlarmHeard(fleets("desk"), False, fleets("y")), memory=made.memory, limits=to("y")
    )
    assert freed.memory.others == {}
    assert (freed.memory.owed, freed.report.faults[0].code) == (True, "ALARM_CONTRADICTED")


def test_only_a_node_of_ours_that_lately_made_a_statement_outlasts_a_strangers_false() -> None:
    """FLEET-ALARM-4: five seconds after its last statement our other node counts as dead."""
    stated = after(AlarmStated("b", True), now=10.0).memory
    for now, stands in ((12.0, True), (13.0, True), (13.1, False)):
        made = after(AlarmHeard(fleets("desk"), False), memory=stated, now=now)
        assert ("b" in made.memory.others) is stands


def test_a_flood_of_invented_nodes_displaces_no_node_that_is_known() -> None:
    memory = FleetAlarmMemory(
        others={str(n): fleets("y") for n in range(MOST_OTHERS)},
        ours={str(n): 9.0 for n in range(MOST_OTHERS)},
    )
    for event in (AlarmHeard(fleets("new"), True), AlarmStated("new", True)):
        assert after(event, memory=memory).memory == memory
    assert after(AlarmHeard(fleets("7"), True, fleets("z")), memory=memory).memory.others["7"] == {
        "y",
        "z",
    }
    assert after(AlarmStated("7", False), memory=memory).memory.others.keys() == {
        str(n) for n in range(MOST_OTHERS) if n != 7
    }


# ---- times


def test_a_contradicted_alarm_wakes_for_its_next_word_and_for_the_end_of_its_fault() -> None:
    """FLEET-ALARM-5."""
    raised = after(FIRE)
    assert raised.wake_at == NEVER
    false = after(AlarmHeard(fleets("desk"), False), memory=raised.memory, now=10.125)
    assert (false.publish, false.memory.owed, false.wake_at) == (
        (),
        True,
        10.0 + fleet_alarm.AGAIN_S,
    )
    again = after(Woken(), memory=false.memory, now=false.wake_at)
    assert again.publish == raised.publish
    assert again.wake_at == 10.125 + RIVAL_QUIET_S
    over = after(Woken(), memory=again.memory, now=again.wake_at)
    assert ([fault.code for fault in over.report.faults], over.wake_at) == (["ALARM_RAISED"], NEVER)


def test_a_drill_ends_at_its_wake_up() -> None:
    """FLEET-ALARM-7."""
    drill = after(DrillOrdered(60.0))
    over = after(Woken(), memory=drill.memory, now=drill.wake_at)
    assert (drill.wake_at, over.report.state) == (70.0, "quiet")
    assert over.publish == ((FIRE_ALARM_TRIGGER, Bool(False)),)
    assert after(DrillOrdered(0.0)).refused == ""
    refused = after(FIRE, AlarmHeard(fleets("b"), True), DrillOrdered(60.0)).refused
    assert refused == "no drill during an alarm: fire of Panel, b"


def test_an_end_notes_its_time_so_that_its_retained_false_stays_a_while() -> None:
    made = after(FIRE, CALM, OperatorReset(), now=42.0)
    assert (made.memory.ended_at, made.memory.told, made.memory.owed) == (42.0, None, False)
    owed = after(FIRE, CALM, AlarmHeard(fleets("desk"), False), now=42.0)
    freed = after(OperatorReset(), memory=owed.memory, now=43.0)
    assert (freed.memory.ended_at, freed.memory.owed) == (43.0, False)


# ---- what a person reads


def test_every_fault_and_report_says_what_a_person_must_know() -> None:
    both = DeviceTells("Panel", AlarmInputs(fleets("fire", "code_blue"), True))
    causes = (AlarmCause("Panel", "code_blue"), AlarmCause("Panel", "fire"))
    raised = after(both, AlarmHeard(fleets("b"), True))
    text = "the robots are stopped: code_blue of Panel, fire of Panel"
    fault = Fault("ALARM_RAISED", text)
    assert raised.report == FleetAlarmReport("alarm", causes, ("b",), (fault,), 10.0)
    against = after(AlarmHeard(fleets("desk", "c"), False), memory=raised.memory).report
    text = "c or desk publishes false, while this daemon publishes true"
    assert against.faults == (Fault("ALARM_CONTRADICTED", text), fault)
    quiet = after(AlarmHeard(fleets("b"), True)).report
    assert (quiet.waits, quiet.faults) == ((), ())
    drill = Fault("ALARM_DRILL", "the robots are stopped for a drill, which ends by itself")
    assert after(DRILL).report == FleetAlarmReport("drill", (), (), (drill,), 10.0)
    heard = [AlarmHeard(fleets(name), True) for name in "cb"]
    waits = after(FIRE, *heard, CALM, OperatorReset()).report
    text = "reset here, but the alarm of b, c is not over"
    assert waits == FleetAlarmReport("reset", (), ("b", "c"), (Fault("ALARM_WAITS", text),), 10.0)
    text = "reset here, but this daemon has just started"
    quiet_start = after(CALM, OperatorReset(), memory=restarted(after(FIRE))).report
    assert quiet_start == FleetAlarmReport("reset", (), (), (Fault("ALARM_WAITS", text),), 10.0)


def test_an_alarm_for_every_fleet_meets_every_alarm_for_some() -> None:
    """FLEET-ALARM-3 to FLEET-ALARM-5: an alarm without fleets is an alarm for all fleets."""
    waits = after(FIRE, AlarmHeard(fleets("b"), True, fleets("y")), CALM, OperatorReset())
    assert (waits.publish, waits.report.state, waits.report.waits) == ((), "reset", ("b",))
    some = after(FIRE, AlarmHeard(fleets("b"), True), CALM, OperatorReset(), limits=to("y"))
    assert (some.publish, some.report.waits) == ((), ("b",))
    against = after(FIRE, AlarmHeard(fleets("desk"), False, fleets("y")))
    assert against.report.faults[0].code == "ALARM_CONTRADICTED"


def test_a_statement_names_the_causes_and_comes_back_from_any_wire() -> None:
    report = after(FIRE).report
    assert alarming.statement(report, fleets()) == {
        "state": "alarm",
        "fleets": "[]",
        "causes": "fire of Panel",
    }
    assert alarming.statement(after(CALM).report, fleets("x"))["causes"] == "-"
    assert alarming.heard(EmergencySignal(("x",), True), ["/X/a"]).senders == {"X/a"}
