"""`explain` for a name that publishes no state: a daemon, an alarm panel, a coordinator's site."""

import pytest

from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.runtime.diagnostics import diagnosis
from bridges.runtime.faults import for_explain
from bridges.runtime.subject import Status
from workbench.explain.explanation import Explanation
from workbench.explain.heard_devices import HeardDevices

WALL = 1_800_000_000.0
ALARM = {"state": "alarm", "causes": "fire of Main panel", "fleets": "", "since": ""}
RAISED = {"code": "ALARM_RAISED", "detail": "fire of Main panel"}
ACTIVE = {"code": "ALARM_SOURCE_ACTIVE", "detail": "fire"}


def told(name: str, daemon: Status, panel: Status, silent_s: float = 0.0) -> Explanation:
    site = HeardDevices()
    for at in range(10):
        said = diagnosis("panels", "alarm", daemon, {"Main panel": panel}, stamp(WALL + at))
        site.take(Heard(float(at), WALL + at, "diagnostics", said))
    site.pass_time(9.0 + silent_s, WALL + 9.0 + silent_s)
    assert len(site.reports(name)) in (1, 2)
    return site.explain("lift", name, None, for_explain())


@pytest.mark.parametrize(
    ("name", "kind"), [("panels", "a daemon"), ("Main panel", "an alarm panel")]
)
def test_a_quiet_panel_needs_nothing_and_is_no_silent_device(name: str, kind: str) -> None:
    found = told(name, {"alarm": {**ALARM, "state": "quiet", "causes": "-"}}, {"seen": True})
    assert kind in found.now[0]
    assert [(step.who, step.what) for step in found.next] == [("nobody", "there is nothing to do")]


@pytest.mark.parametrize("name", ["panels", "Main panel"])
def test_an_alarm_and_its_reset_come_first(name: str) -> None:
    found = told(name, {"alarm": ALARM, "faults": [RAISED]}, {"faults": [ACTIVE]})
    assert found.now[0].startswith("Every robot must stand still because fire of Main panel")
    assert {step.who for step in found.next} == {"a person"}
    if name == "panels":
        assert any("rmf-bridge reset" in step.what for step in found.next)


def test_a_drill_ends_by_itself() -> None:
    drill = [{"code": "ALARM_DRILL", "detail": ""}]
    found = told("panels", {"alarm": {**ALARM, "state": "drill"}, "faults": drill}, {})
    assert [(step.who, step.what) for step in found.next] == [
        ("nobody", "the drill ends by itself")
    ]


def test_a_daemon_that_has_fallen_silent_is_looked_at() -> None:
    found = told("panels", {}, {}, silent_s=60.0)
    assert found.next[0].what == "look at the daemon: `rmf-bridge status` on its machine"


def test_a_misspelt_name_is_still_nobodys() -> None:
    site = HeardDevices()
    said = diagnosis("panels", "alarm", {}, {"Main panel": {}}, stamp(WALL))
    site.take(Heard(0.0, WALL, "diagnostics", said))
    assert site.reports("Main pannel") == []
    (step,) = site.explain("lift", "Main pannel", None).next
    assert "did you mean Main panel?" in step.what
