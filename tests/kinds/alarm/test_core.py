"""Stories of one alarm panel in virtual time. They test which causes of an alarm the core reports, and
when."""

from typing import Any

import pytest
from msgspec.structs import replace

from bridges.kinds.alarm import core
from bridges.kinds.alarm.memory import PanelLimits, PanelMemory
from bridges.kinds.alarm.messages import summary
from bridges.kinds.alarm.report import PanelReport
from bridges.kinds.alarm.settings import PanelDurations, PanelSettings
from bridges.kinds.alarm.signals import PanelOutputs, PanelSample
from bridges.kinds.shared.decision import AlarmInputs, IoFailed, OperatorReset, Sampled, Suspended
from bridges.kinds.shared.durations import NEVER
from tests.depth import depth
from tests.walk import histories

LIMITS = PanelLimits(
    silent_alarm_after_s=10.0,
    drill_s=5.0,
    debounce={"fire": 0.25, "blue": 0.0, "drill": 0.25},
)

STEP_S = 0.125
"""The time (s) between two readings. It is a power of two, so sums of times stay exact."""


class Panel:
    """An alarm panel that the core reads every STEP_S.

    `told` gets an entry (s, present causes, `seen`, `drill`) whenever one of the last three changes.
    `seen` says that the panel was read. `drill` says that a drill is on.
    """

    def __init__(self) -> None:
        self.now = 0.0
        self.on: dict[str, bool] = {"fire": False, "blue": False}
        self.drill: bool | None = False
        self.unreadable = ""
        self.memory: PanelMemory = core.initial(LIMITS, 0.0)
        self.report: PanelReport
        self.told: list[tuple[float, str, bool, bool]] = []

    def until(self, at: float) -> "Panel":
        while self.now < at:
            self.now += STEP_S
            self.scan()
        return self

    def scan(self, event: Any = None) -> None:
        sample = Sampled(PanelSample(dict(self.on), self.drill))
        event = event or (IoFailed(self.unreadable) if self.unreadable else sample)
        made = core.decide(self.memory, event, self.now, LIMITS)
        assert made.wake_at > self.now
        self.memory, self.report = made.memory, made.report
        alarm = made.report.alarm
        told = (self.now, " ".join(sorted(alarm.present)), alarm.seen, alarm.drill)
        if not self.told or told[1:] != self.told[-1][1:]:
            self.told.append(told)

    @property
    def faults(self) -> list[str]:
        return [str(fault) for fault in self.report.faults]


def test_a_source_is_active_after_its_debounce_and_over_after_it_was_clear() -> None:
    """ALARM-1."""
    panel = Panel().until(1.0)
    panel.on["fire"] = True
    panel.until(1.25)
    panel.on["fire"] = False  # the contact bounces
    panel.until(2.0)
    panel.on["fire"] = True
    panel.until(3.0)
    assert panel.faults == ["ALARM_SOURCE_ACTIVE: fire"]
    assert summary(panel.report) == {"state": "alarm", "active": "fire"}
    panel.on["fire"] = False
    panel.until(3.75)
    panel.on["fire"] = True
    panel.until(4.0)
    panel.on["fire"] = False
    panel.until(6.0)
    assert panel.told == [
        (0.125, "", False, False),
        (0.375, "", True, False),
        (2.375, "fire", True, False),
        (5.125, "", True, False),
    ]


def test_a_fire_at_the_very_first_reading_counts_at_once() -> None:
    """ALARM-1."""
    panel = Panel()
    panel.on["fire"] = True
    assert panel.until(0.125).told == [(0.125, "fire", False, False)]


def test_a_panel_that_fails_at_every_second_reading_hides_no_fire_and_ends_none() -> None:
    """ALARM-1."""
    panel = Panel().until(1.0)
    for on in (True, False):
        panel.on["fire"] = on
        for _ in range(4 if on else 40):
            panel.unreadable = "" if panel.unreadable else "no answer"
            panel.until(panel.now + STEP_S)
        assert panel.told[-1][1] == "fire"
    panel.unreadable = ""
    assert panel.until(panel.now + 2.0).told[-1][1] == ""


def chatters(panel: Panel, until: float) -> Panel:
    """Let the fire contact change at each reading, which is faster than its debounce."""
    while panel.now < until:
        panel.on["fire"] = not panel.on["fire"]
        panel.until(panel.now + STEP_S)
    return panel


def test_a_source_that_chatters_is_an_alarm_and_a_fault_until_it_was_clear() -> None:
    """ALARM-1: the contact changes from 1.125 s on. It has a debounce of 0.25 s and RESTLESS_S."""
    panel = chatters(Panel().until(1.0), 6.0)
    assert panel.report.alarm == AlarmInputs(frozenset({"fire"}), True)
    assert panel.faults == [
        "ALARM_SOURCE_ACTIVE: fire",
        "HAZARD_INPUTS_UNSTEADY: fire: not steady within 2 s",
    ]
    panel.on["fire"] = False
    assert panel.until(9.0).faults == []
    assert panel.told[2:] == [(3.375, "fire", True, False), (7.0, "", True, False)]


def test_the_core_wakes_to_read_a_source_that_has_kept_changing() -> None:
    """ALARM-1: the contact changes from 1 s on. It is active at 3.25 s, and a fault at 4 s."""
    limits = replace(LIMITS, t=PanelDurations(stale_after_s=60.0))
    memory = core.initial(limits, 0.0)
    for now in (0.0, 0.25):
        off = Sampled(PanelSample({"fire": False}))
        memory = core.decide(memory, off, now, limits).memory
    told = []
    for now in (1.0, 3.125, 3.25, 3.875, 4.0):
        for on in (False, True):
            made = core.decide(memory, Sampled(PanelSample({"fire": on})), now, limits)
            memory = made.memory
        told.append((made.wake_at, *(fault.code for fault in made.report.faults)))
    active, fault = "ALARM_SOURCE_ACTIVE", "HAZARD_INPUTS_UNSTEADY"
    assert told == [
        (1.25,),
        (3.25,),
        (3.5, active),
        (4.0, active),
        (4.25, active, fault),
    ]


def test_a_source_with_a_long_debounce_is_no_fault_before_it_is_active() -> None:
    """ALARM-1: the debounce is longer than `clear_s`."""
    limits = replace(LIMITS, t=PanelDurations(stale_after_s=60.0), debounce={"fire": 3.0})
    memory = core.initial(limits, 0.0)
    for now in (0.0, 3.0):
        off = Sampled(PanelSample({"fire": False}))
        memory = core.decide(memory, off, now, limits).memory
    told = []
    for now in (5.0, 9.5, 10.0):
        for on in (True, False):
            made = core.decide(memory, Sampled(PanelSample({"fire": on})), now, limits)
            memory = made.memory
        told.append([fault.code for fault in made.report.faults])
    assert told == [[], [], ["ALARM_SOURCE_ACTIVE", "HAZARD_INPUTS_UNSTEADY"]]


def test_a_source_behind_a_bus_that_fails_from_the_start_is_no_alarm() -> None:
    """ALARM-1: the source never settles, but no reading has shown a fire."""
    panel = Panel()
    for reading in range(80):
        panel.unreadable = "no answer" if reading % 2 else ""
        panel.until(panel.now + STEP_S)
    assert panel.report.alarm == AlarmInputs(frozenset(), False)
    assert panel.faults == ["HAZARD_INPUTS_UNSTEADY: fire: not steady within 2 s"]


def test_one_bounce_of_a_contact_is_no_alarm_with_any_clear_s() -> None:
    """ALARM-1: the end of a bounce settles after the debounce, not after `clear_s`."""
    limits = replace(LIMITS, t=PanelDurations(clear_s=30.0))
    memory = core.initial(limits, 0.0)
    for scan in range(160):
        sample = PanelSample({"fire": scan == 8})
        made = core.decide(memory, Sampled(sample), scan * STEP_S, limits)
        memory = made.memory
        assert made.report.alarm.present == frozenset()
        assert made.report.faults == ()


def test_a_silent_panel_is_a_fault_and_its_sources_stay_unproven() -> None:
    """ALARM-2."""
    panel = Panel().until(1.0)
    panel.on["fire"] = True
    panel.until(2.0)
    panel.unreadable = "no answer"
    panel.on["fire"] = False
    panel.until(5.0)
    assert panel.report.alarm == AlarmInputs(frozenset({"fire"}), False)
    assert panel.faults == ["ALARM_SOURCE_ACTIVE: fire", "PANEL_SILENT: no answer"]
    panel.unreadable = ""
    assert panel.until(7.0).report.alarm == AlarmInputs(frozenset(), True)


def test_a_long_silence_is_an_alarm_until_the_next_reading() -> None:
    """ALARM-3."""
    panel = Panel().until(1.0)
    panel.unreadable = "no answer"
    panel.until(10.875)
    assert panel.report.alarm.present == frozenset()
    panel.until(11.0)
    assert panel.report.alarm.present == {"silence"}
    assert summary(panel.report)["state"] == "silent"
    panel.unreadable = ""
    assert panel.until(11.125).report.alarm == AlarmInputs(frozenset(), True)


def test_a_panel_that_never_answers_alarms_after_the_same_time() -> None:
    """ALARM-3."""
    panel = Panel()
    panel.unreadable = "no answer"
    panel.until(9.875)
    assert panel.report.alarm.present == frozenset()
    assert panel.faults == ["PANEL_SILENT: no answer"]
    assert panel.until(10.0).report.alarm.present == {"silence"}


def test_a_reading_is_believed_until_it_is_stale_and_the_silence_has_its_own_reason() -> None:
    """ALARM-2: `stale_after_s` is 1 s."""
    panel = Panel().until(1.0)
    panel.unreadable = "no answer"
    panel.until(1.5)
    panel.unreadable = ""
    panel.until(2.0)
    panel.now = 2.875
    panel.scan(OperatorReset())
    assert (panel.report.silent, panel.faults, panel.report.read_at) == (False, [], 2.0)
    panel.now = 3.0
    panel.scan(OperatorReset())
    assert (panel.report.silent, panel.faults) == (True, ["PANEL_SILENT: no reading"])
    assert summary(panel.report)["state"] == "silent"


def test_a_panel_that_was_never_tried_is_not_silent_yet() -> None:
    """ALARM-2: an event, such as a person's reset, can come before the first reading."""
    panel = Panel()
    panel.scan(OperatorReset())
    assert (panel.report.silent, panel.faults) == (False, [])
    panel.scan(IoFailed("no answer"))
    assert (panel.report.silent, panel.faults) == (True, ["PANEL_SILENT: no answer"])


def test_every_active_source_is_named_and_nothing_is_driven() -> None:
    """ALARM-1."""
    panel = Panel().until(1.0)
    panel.on.update(fire=True, blue=True)
    assert panel.until(2.0).faults == ["ALARM_SOURCE_ACTIVE: blue, fire"]
    made = core.decide(panel.memory, Sampled(PanelSample(panel.on)), 3.0, LIMITS)
    assert made.outputs == PanelOutputs()


def test_without_a_debounce_a_source_and_a_drill_count_at_their_first_reading() -> None:
    """ALARM-1 and ALARM-4."""
    plain = PanelLimits(silent_alarm_after_s=10.0, drill_s=5.0)
    memory = core.initial(plain, 0.0)
    off, on = PanelSample({"fire": False}, False), PanelSample({"fire": True}, True)
    memory = core.decide(memory, Sampled(off), 1.0, plain).memory
    made = core.decide(memory, Sampled(on), 2.0, plain)
    assert made.report.alarm == AlarmInputs(frozenset({"fire"}), True, drill=True)
    assert made.wake_at == 3.0  # 1 s after the reading, when it is stale


@pytest.mark.parametrize("drill", [False, True])
def test_a_panel_that_is_scanned_only_when_it_asks_for_it_sees_every_change_in_time(
    drill: bool,
) -> None:
    """ALARM-1 to ALARM-4: the daemon may wait for the core's `wake_at` before it reads a quiet panel
    again."""
    panel, told = Panel().until(1.0), []
    fault = "ALARM_DRILL: a drill, which ends by itself" if drill else "ALARM_SOURCE_ACTIVE: fire"
    panel.drill, panel.on["fire"] = drill, not drill
    for _ in range(4):
        panel.scan()
        told.append((panel.now, *panel.faults))
        panel.now = core.decide(panel.memory, OperatorReset(), panel.now, LIMITS).wake_at
    assert told == [(1.0,), (1.25, fault), (2.25, fault), (3.25, fault)]
    panel.on["fire"], panel.now = False, 4.0
    panel.scan()
    assert core.decide(panel.memory, OperatorReset(), 4.0, LIMITS).wake_at == 5.0  # clear_s


def test_a_change_of_anything_but_a_reason_is_news_for_the_log() -> None:
    panel = Panel().until(1.0)
    quiet = panel.report.news()
    panel.scan()
    assert panel.report.news() == quiet
    panel.scan(IoFailed("no answer"))
    lost = panel.report.news()
    panel.now = 2.0
    panel.scan(IoFailed("no answer"))
    assert panel.report.news() not in (quiet, lost)


def test_a_silent_panel_asks_to_be_woken_for_its_alarm() -> None:
    """ALARM-3."""
    panel = Panel().until(1.0)
    asked = []
    for _ in range(3):
        made = core.decide(panel.memory, IoFailed("no answer"), panel.now, LIMITS)
        panel.memory, panel.now = made.memory, made.wake_at
        asked.append(made.wake_at)
    assert asked == [2.0, 11.0, NEVER]


def test_a_failed_reading_restarts_the_debounce_of_the_drill_too() -> None:
    """ALARM-1 and ALARM-4: after one failed reading a bounce of the key must not begin a drill."""
    panel = Panel().until(1.0)
    panel.drill = True
    panel.until(1.125)
    panel.unreadable = "no answer"
    panel.until(1.25)
    panel.unreadable = ""
    panel.until(1.5)
    assert panel.report.alarm.drill is False
    assert panel.until(1.625).report.alarm.drill is True


def test_the_limits_are_those_of_the_file() -> None:
    durations = PanelDurations(stale_after_s=2.0)
    settings = PanelSettings(
        alarm="fire_alarm_trigger", silent_alarm_after_s=30.0, drill_s=60.0, limits=durations
    )
    assert PanelLimits.of(settings, {"fire": 0.5}) == PanelLimits(
        30.0, 60.0, durations, {"fire": 0.5}
    )
    without = replace(settings, drill_s=None)
    assert PanelLimits.of(without, {}) == PanelLimits(30.0, 0.0, durations, {})


def test_a_machine_that_slept_counts_its_sleep_as_silence() -> None:
    """ALARM-2 and ALARM-3."""
    panel = Panel().until(1.0)
    panel.now = 30.0
    panel.scan(Suspended("slept"))
    assert panel.report.alarm == AlarmInputs(frozenset({"silence"}), False)


def test_a_drill_ends_after_its_time_or_with_its_key() -> None:
    """ALARM-4."""
    panel = Panel().until(1.0)
    panel.drill = True
    panel.until(8.0)
    assert panel.told[-2:] == [(1.375, "", True, True), (6.375, "", True, False)]
    panel.drill = False
    panel.until(9.0)
    panel.drill = True
    panel.until(10.0)
    assert panel.faults == ["ALARM_DRILL: a drill, which ends by itself"]
    assert summary(panel.report) == {"state": "drill", "active": "-"}
    panel.drill = False
    assert panel.until(10.375).report.alarm.drill is False


def test_a_key_that_is_on_at_the_start_begins_no_drill() -> None:
    """ALARM-4."""
    panel = Panel()
    panel.drill = True
    panel.until(3.0)
    assert not any(told[3] for told in panel.told)


def test_no_history_hides_a_lasting_cause_or_makes_a_drill_last() -> None:
    """Try all histories of five moves, or of seven moves in `make deep`.

    A move lasts 0.375 s, or 6 s for "later". The panel is read every STEP_S. The checks judge the
    reports without the core's code.
    """
    moves = ("fire", "out", "key", "no key", "dead", "later")

    def after(state: tuple[PanelMemory, float, bool, bool], move: str) -> Any:
        memory, now, fire, key = state
        fire = {"fire": True, "out": False}.get(move, fire)
        key = {"key": True, "no key": False}.get(move, key)
        waits = 48 if move == "later" else 3
        for _ in range(waits):
            now += STEP_S
            sample = PanelSample({"fire": fire}, key)
            event = IoFailed("dead") if move == "dead" else Sampled(sample)
            made = core.decide(memory, event, now, LIMITS)
            memory = made.memory
            assert made.wake_at > now
        alarm = made.report.alarm
        assert not fire or move == "dead" or "fire" in alarm.present
        assert alarm.seen <= (move != "dead" or memory.read_at is not None)
        assert not (alarm.drill and move == "later")
        assert ("silence" in alarm.present) == (now >= memory.began_at + 10.0)
        return memory, now, fire, key

    start = (core.initial(LIMITS, 0.0), 0.0, False, False)
    ends = [*histories(start, moves, depth(5, 7), after)]
    assert len(ends) == len(moves) ** depth(5, 7)
