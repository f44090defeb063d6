"""The times at which `notify` reports a trouble to people, in virtual time."""

from dataclasses import dataclass, field
from datetime import time

import msgspec
import pytest

from bridges.messages import definitions as d
from bridges.observe.requesters import Moment
from tests.observe.story import OPEN, RED, WALL, Story
from workbench.explain.explanation import Explanation, NextStep
from workbench.notify.messages import worded
from workbench.notify.notices import KeptTrouble, Notice, Notices
from workbench.notify.settings import NotifySettings, QuietHours, Recipient
from workbench.notify.troubles import Trouble, troubles

TO = [Recipient(webhook="https://chat.example/hook")]
SETTINGS = NotifySettings(to=TO, after_s=30, over_s=60, again_s=900)
FIRE = Trouble("lift", "Lift1", "FIRE", "warning", "lift Lift1: FIRE")
SILENT = Trouble("door", "ward", "SILENT", "critical", "door ward is silent")
NOON, NIGHT = time(12, 0), time(2, 0)
ALL = {("lift", "Lift1"), ("door", "ward")}


@dataclass
class Desk:
    """A run of `notify` that examines the troubles every 10 s. `told` has one line for each notice."""

    notices: Notices = field(default_factory=lambda: Notices(SETTINGS))
    now: float = 0.0
    clock: time = NOON
    told: list[str] = field(default_factory=list)

    def passes(
        self, seconds: float, *present: Trouble, heard: set[tuple[str, str]] = ALL
    ) -> "Desk":
        """Let time pass. During this time these troubles are present."""
        for _ in range(round(seconds / 10)):
            self.now += 10
            for one in self.notices.turn(present, heard, self.now, self.clock):
                self.told.append(f"{self.now:g} {one.event} {one.trouble.what} {one.for_s:g}")
        return self


def test_a_trouble_is_told_once_after_it_has_lasted_and_its_end_once() -> None:
    desk = Desk().passes(20, FIRE).passes(100)
    assert desk.told == []
    desk.passes(300, FIRE).passes(50).passes(10, FIRE).passes(200)
    assert desk.told == ["160 new FIRE 30", "540 over FIRE 350"]


def test_a_trouble_that_comes_and_goes_is_told() -> None:
    desk = Desk()
    for _ in range(5):
        desk.passes(10, FIRE).passes(20)
    assert desk.told == ["40 new FIRE 30"]


def test_a_critical_trouble_is_told_again_until_somebody_acknowledges_it() -> None:
    desk = Desk().passes(2000, SILENT, FIRE)
    assert desk.told == [
        "40 new SILENT 30",
        "40 new FIRE 30",
        "940 again SILENT 930",
        "1840 again SILENT 1830",
    ]
    assert desk.notices.acknowledge(SILENT.key)
    assert not desk.notices.acknowledge("door ward: OTHER")
    assert desk.passes(4000, SILENT, FIRE).told[4:] == []


def test_in_the_quiet_hours_only_critical_troubles_are_told_and_warnings_afterwards() -> None:
    quiet = QuietHours(begins="22:00", ends="06:00")
    desk = Desk(Notices(msgspec.structs.replace(SETTINGS, quiet=quiet)), clock=NIGHT)
    desk.passes(100, FIRE, SILENT)
    assert desk.told == ["40 new SILENT 30"]
    desk.clock = time(6, 0)
    assert desk.passes(10, FIRE, SILENT).told[1:] == ["110 new FIRE 100"]
    desk.clock = NIGHT
    assert desk.passes(100, SILENT).told[2:] == []
    desk.clock = NOON
    assert desk.passes(10, SILENT).told[2:] == ["220 over FIRE 100"]


def test_a_restart_tells_nothing_twice_and_no_end_of_what_it_has_not_heard() -> None:
    before = Desk().passes(100, SILENT).notices
    kept = msgspec.json.decode(msgspec.json.encode(before.kept()), type=list[KeptTrouble])
    desk = Desk()
    desk.notices.restore(kept, desk.now)
    desk.passes(500, heard=set())
    assert desk.told == []
    assert desk.passes(100).told == ["560 over SILENT 500"]


def test_invented_devices_do_not_grow_the_memory_without_bound() -> None:
    desk = Desk()
    made_up = [Trouble("lift", f"{n}", "FIRE", "warning", "") for n in range(3000)]
    desk.passes(10, *made_up)
    assert len(desk.notices.known) == 1000


@pytest.mark.parametrize(
    ("begins", "ends", "at", "quiet"),
    [
        ("22:00", "06:00", time(23), True),
        ("22:00", "06:00", time(6), False),
        ("12:00", "14:00", time(13), True),
        ("12:00", "14:00", time(14), False),
    ],
)
def test_quiet_hours_may_pass_midnight(begins: str, ends: str, at: time, quiet: bool) -> None:
    assert QuietHours(begins=begins, ends=ends).contains(at) is quiet


def found(story: Story) -> list[str]:
    now = Moment(story.now, WALL + story.now)
    return [f"{one.severity} {one.key}" for one in troubles(story.graph, now, SETTINGS)]


def test_a_silent_device_has_no_other_trouble() -> None:
    story = Story().lift().asks(RED, "L1").lift(RED, "L1", OPEN).passes(200)
    assert found(story) == ["critical lift Lift1: SILENT"]


def test_a_robot_in_a_still_lift_is_critical_and_a_waiting_robot_is_a_warning() -> None:
    story = Story().lift(RED, "L1", OPEN)
    for _ in range(400):
        story.passes(1).asks("fleet/blue").asks(RED, "L1").lift(RED, "L1", OPEN)
    assert found(story) == ["critical lift Lift1: STUCK", "warning lift Lift1: WAITING"]


def test_the_faults_of_panels_and_robots_are_troubles_and_so_is_the_silence_of_a_panel() -> None:
    values = (d.KeyValue("kind", "alarm"), d.KeyValue("ALARM_RAISED", "fire"))
    panel = d.DiagnosticStatus(2, "node: Main panel", "ALARM_RAISED", "Main panel", values)
    values = (d.KeyValue("kind", "fleet"), d.KeyValue("ROBOT_SILENT", "5 s"))
    robot = d.DiagnosticStatus(2, "fleet: AMR1", "ROBOT_SILENT", "AMR1", values)
    story = Story().hear("/diagnostics", d.DiagnosticArray(status=(panel, robot)))
    assert found(story) == [
        "critical alarm Main panel: ALARM_RAISED",
        "warning fleet AMR1: ROBOT_SILENT",
    ]
    assert found(story.passes(30)) == [
        "critical alarm Main panel: SILENT",
        "critical fleet AMR1: SILENT",
    ]


def test_a_remedy_counts_more_than_that_nobody_has_to_act() -> None:
    idle = Explanation("dispenser", "X", "", ("It is idle.",), (NextStep("nobody", "wait"),))
    trouble = Trouble("dispenser", "X", "OUTCOME_UNKNOWN", "warning", "dispenser X")
    remedies = {"OUTCOME_UNKNOWN": ("nobody knows", "look at the robot")}
    text = worded(Notice("new", trouble, 30.0), idle, None, remedies).text
    assert text.splitlines() == [
        "The trouble has lasted 30 s.",
        "It is idle.",
        "OUTCOME_UNKNOWN: nobody knows. look at the robot",
    ]
