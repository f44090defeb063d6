"""The settings of alarms, and the statements about alarms on `/diagnostics`."""

from typing import Any

import pytest

from bridges.kinds.shared import alarming
from bridges.kinds.shared.alarming import AlarmingSettings
from bridges.kinds.shared.fleet_alarm_memory import AlarmCause, FleetAlarmLimits, FleetAlarmReport
from bridges.messages.definitions import (
    Bool,
    DiagnosticArray,
    DiagnosticStatus,
    EmergencySignal,
    KeyValue,
)
from bridges.messages.topics import EMERGENCY_SIGNAL, FIRE_ALARM_TRIGGER

EVERY = AlarmingSettings(alarm="fire_alarm_trigger")
SOME = AlarmingSettings(alarm="emergency_signal", fleets=("tiny", "big"), without_fleets="tell_all")

STOPS_ALL = (
    "an alarm stops the robots of every fleet on this graph, in every building of it; to stop fewer"
    " fleets, write alarm: emergency_signal and fleets"
)
NO_SIGNAL = (
    "Jazzy and older have no emergency_signal, and fire_alarm_trigger stops every fleet: write"
    " without_fleets: tell_all, or without_fleets: tell_nobody"
)


@pytest.mark.parametrize(
    ("settings", "key", "text"),
    [
        ({"alarm": "fire_alarm_trigger", "fleets": ("tiny",)}, "fleets",
         "only emergency_signal names fleets: write alarm: emergency_signal, or delete fleets"),
        ({"alarm": "emergency_signal", "fleets": ("tiny",)}, "fleets", NO_SIGNAL),
        ({"alarm": "emergency_signal", "without_fleets": "tell_all"}, "without_fleets",
         "has an effect only with fleets, and all fleets are told: delete without_fleets"),
    ],
)  # fmt: skip
def test_each_contradiction_of_topic_and_fleets_is_told_at_its_key(
    settings: dict[str, Any], key: str, text: str
) -> None:
    assert [*alarming.alarm_problems(AlarmingSettings(**settings))] == [((key,), text)]


@pytest.mark.parametrize(
    ("settings", "notes"),
    [
        (AlarmingSettings(), []),
        (EVERY, [(("alarm",), STOPS_ALL)]),
        (SOME, [(("without_fleets",),
                 "under Jazzy and older an alarm stops every fleet, not only these")]),
        (AlarmingSettings(alarm="emergency_signal", fleets=("tiny",), without_fleets="tell_nobody"),
         [(("without_fleets",), "under Jazzy and older an alarm stops no robot")]),
    ],
)  # fmt: skip
def test_each_effect_that_the_site_should_know_is_noted_at_its_key(
    settings: AlarmingSettings, notes: list[Any]
) -> None:
    assert [*alarming.alarm_notes(settings)] == notes
    assert [*alarming.alarm_problems(settings)] == []


def test_the_devices_of_a_file_share_the_alarm_of_those_that_have_one() -> None:
    devices = {"quiet": AlarmingSettings(), "one": SOME, "other": SOME}
    told = frozenset({"tiny", "big"})
    limits = FleetAlarmLimits(EMERGENCY_SIGNAL, told, frozenset({"one", "other"}))
    assert alarming.alarm_limits(devices) == limits
    assert [*alarming.disagreements(devices)] == []
    [(name, _)] = alarming.disagreements({**devices, "third": EVERY})
    assert name == "third"


def test_an_alarm_is_a_bool_on_its_own_topic_or_a_signal_on_any() -> None:
    fire = FIRE_ALARM_TRIGGER.name
    assert alarming.is_alarm(fire, Bool(True))
    assert alarming.is_alarm(EMERGENCY_SIGNAL.name, EmergencySignal(("tiny",), True))
    assert not alarming.is_alarm("door_open", Bool(True))
    assert not alarming.is_alarm(fire, DiagnosticArray())


def test_a_statement_without_fleets_is_for_all_fleets_and_names_its_node_without_a_slash() -> None:
    causes = AlarmCause("Panel", "fire"), AlarmCause("Lift1", "fire")
    said = alarming.statement(FleetAlarmReport("alarm", causes, (), (), 0.0), frozenset())
    assert said["causes"] == "fire of Panel, fire of Lift1"
    status = DiagnosticStatus(hardware_id="/X", values=(KeyValue(alarming.STATE, "alarm"),))
    assert [*alarming.statements(DiagnosticArray(status=(status,)))] == [
        ("X", "alarm", frozenset())
    ]
