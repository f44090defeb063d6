"""The times at which `notify` reports a trouble to people, in virtual time."""

from dataclasses import dataclass, field
from datetime import datetime, time

import msgspec
import pytest

from bridges.messages import definitions as d
from bridges.observe.requesters import Moment
from bridges.runtime.daemons import DaemonStatus
from tests.observe.story import OPEN, RED, WALL, Story
from workbench.explain.explanation import Explanation, NextStep
from workbench.notify.messages import worded
from workbench.notify.notices import KeptTrouble, Notice, Notices
from workbench.notify.settings import NotifySettings, QuietHours, Recipient
from workbench.notify.troubles import Trouble, heard_now, of_daemons, troubles

TO = [Recipient(webhook="https://chat.example/hook")]
SETTINGS = NotifySettings(to=TO, after_s=30, over_s=60, again_s=900)
FIRE = Trouble("lift", "Lift1", "FIRE", "warning", "lift Lift1: FIRE")
SILENT = Trouble("door", "ward", "SILENT", "critical", "door ward is silent")
AT = datetime(2026, 11, 29, 2, 13, 5).astimezone()
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


def test_a_trouble_that_gets_worse_is_told_again_also_after_its_acknowledgement() -> None:
    soon = Trouble("daemon", "lift", "CERTIFICATE", "warning", "it ends in 6 days", stage=1)
    over = msgspec.structs.replace(soon, severity="critical", headline="it has ended", stage=2)
    heard = {("daemon", "lift")}
    desk = Desk().passes(100, soon, heard=heard)
    assert desk.notices.acknowledge(soon.key)
    restarted = Desk(now=desk.now)
    restarted.notices.restore(desk.notices.kept(0), desk.now, 0)
    for one in desk, restarted:
        one.told.clear()
        one.passes(1000, over, heard=heard).passes(100, heard=heard)
        assert one.told == [
            "110 new CERTIFICATE 100",
            "1010 again CERTIFICATE 1000",
            "1160 over CERTIFICATE 1090",
        ]


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
    kept = msgspec.json.decode(msgspec.json.encode(before.kept(WALL)), type=list[KeptTrouble])
    desk = Desk()
    desk.notices.restore(kept, desk.now, WALL + 300)  # 200 s after the last look
    desk.passes(500, heard=set())
    assert desk.told == []
    assert desk.passes(100).told == ["560 over SILENT 790"]


def test_what_a_silent_device_had_is_not_over_and_only_its_silence_is_told() -> None:
    """A daemon that dies in an alarm says no more that the robots stand."""
    stuck = Trouble("lift", "Lift1", "STUCK", "critical", "Lift1 does not move", 180.0)
    dead = Trouble("lift", "Lift1", "SILENT", "critical", "lift Lift1 is silent")
    desk = Desk().passes(100, FIRE, stuck)
    assert desk.told == ["10 new STUCK 180", "40 new FIRE 30"]
    desk.passes(2000, dead, heard=ALL - {("lift", "Lift1")})
    assert desk.told[2:] == [
        "140 new SILENT 30",
        "1040 again SILENT 930",
        "1940 again SILENT 1830",
    ]
    desk.passes(100, FIRE)
    assert sorted(desk.told[5:]) == ["2160 over SILENT 1990", "2160 over STUCK 2270"]


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


def daemon(state: str, *devices: str, kind: str = "lift") -> DaemonStatus:
    status = {"kind": kind, "devices": {device: {} for device in devices}}
    return DaemonStatus(name="x", state=state, by="service", why="do: it", status=status)


@pytest.mark.parametrize(
    ("one", "told"),
    [
        (daemon("serving", "Lift1"), ""),
        (daemon("stopped"), ""),
        (daemon("unknown"), ""),
        (daemon("died", "Lift1"), ""),  # that Lift1 is silent is told
        (daemon("died", "Lift1", "Lift2"), "daemon x does not serve"),
        (daemon("died", "Lift1", kind="lift_supervisor"), "daemon x does not serve"),
        (daemon("failed"), "daemon x does not serve"),
        (daemon("old", "Lift2"), "daemon x does not serve"),
        (
            daemon("left on", "Lift1"),
            "daemon x has died, and its outputs are not verified off; do: it",
        ),
    ],
)
def test_a_daemon_of_this_machine_that_does_not_serve_is_critical(
    one: DaemonStatus, told: str
) -> None:
    troubles = [*of_daemons([one], ALL)]
    assert [(each.severity, each.headline) for each in troubles] == [("critical", told)] * bool(
        told
    )


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
    assert heard_now(story.graph, Moment(story.now, WALL + story.now)) == {
        ("alarm", "Main panel"),
        ("fleet", "AMR1"),
    }
    assert found(story.passes(30)) == [
        "critical alarm Main panel: SILENT",
        "critical fleet AMR1: SILENT",
    ]
    assert heard_now(story.graph, Moment(story.now, WALL + story.now)) == set()


def test_a_remedy_counts_more_than_that_nobody_has_to_act() -> None:
    idle = Explanation("dispenser", "X", "", ("It is idle.",), (NextStep("nobody", "wait"),))
    trouble = Trouble("dispenser", "X", "OUTCOME_UNKNOWN", "warning", "dispenser X")
    remedies = {"OUTCOME_UNKNOWN": ("nobody knows", "look at the robot")}
    text = worded(Notice("new", trouble, 30.0), idle, None, remedies, AT, "").text
    assert text.splitlines() == [
        "At 2026-11-29 02:13:05 the trouble had lasted 30 s.",
        "It is idle.",
        "OUTCOME_UNKNOWN: nobody knows. Do: look at the robot",
    ]


def test_a_critical_notice_names_the_command_that_ends_its_repeats_and_a_next_step() -> None:
    panel = Trouble("alarm", "It's", "SILENT", "critical", "alarm It's is silent")
    told = worded(Notice("again", panel, 30.0), None, None, {}, AT, "sudo rmf-bridge notify /f")
    assert told.title == "Still: alarm It's is silent"
    assert told.text.splitlines()[1:] == [
        "Next, a person: run `rmf-bridge status` on the machine of its daemon, and do what it says.",
        """To stop the repeats: sudo rmf-bridge notify /f --ack 'alarm It'"'"'s: SILENT'""",
    ]
    assert datetime.fromisoformat(told.at) == AT
