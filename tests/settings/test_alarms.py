"""An alarm in a YAML file: its topic, fleets and sources, and the answer of `check`."""

import re
from pathlib import Path

import pytest

from bridges.settings.load import SettingsError, load
from bridges.settings.sheets.findings import findings

PANEL = (Path(__file__).parents[2] / "config" / "alarm_panel.yaml").read_text()
NAMED = (Path(__file__).parents[2] / "config" / "alarm_register.yaml").read_text()
SECOND = """  Second panel:
    alarm: {alarm}
    silent_alarm_after_s: 60
    sources:
      fire: {{point: BCM26, active: high, pull: up}}
"""


def problems(directory: Path, text: str) -> list[str]:
    file = directory / "a.yaml"
    file.write_text(text)
    with pytest.raises(SettingsError) as wrong:
        load(file)
    return [re.sub(r"^.*?a.yaml:", "", str(problem)) for problem in wrong.value.problems]


@pytest.mark.parametrize(
    ("was", "now", "says"),
    [
        ("alarm: fire_alarm_trigger", "alarm: none", "a panel must tell the fleets"),
        ("alarm: fire_alarm_trigger  ", "fleets: [x]\n    alarm: fire_alarm_trigger  ",
         "only emergency"),
        ("alarm: fire_alarm_trigger  ", "without_fleets: tell_all\n    alarm: fire_alarm_trigger  ",
         "has an effect only with fleets"),
        ("silent_alarm_after_s: 60", "", "needs 'silent_alarm_after_s'"),
        ("silent_alarm_after_s: 60", "silent_alarm_after_s: 3\n    limits: {stale_after_s: 5}",
         "must be at least stale_after_s (5 s)"),
        ("active: high, pull: up", "active: low, pull: up", "fire_panel reads clear in an alarm"),
        ("      code_blue", "      drill", "'drill' is a reserved name"),
        ("      code_blue", "      silence", "'silence' is a reserved name"),
        ("    drill_s: 300\n", "", "give the duration of a drill"),
        ("ros_setup: /opt/ros/jazzy/setup.bash", "diagnostics: false", "an alarm needs diagnostics"),
    ],
)  # fmt: skip
def test_a_mistake_about_an_alarm_is_refused(tmp_path: Path, was: str, now: str, says: str) -> None:
    assert was in PANEL
    found = problems(tmp_path, PANEL.replace(was, now, 1))
    assert [says in one for one in found] == [True], found


def test_named_fleets_need_a_setting_for_releases_without_names_of_fleets(tmp_path: Path) -> None:
    [found] = problems(tmp_path, re.sub(r" *without_fleets.*\n", "", NAMED))
    assert "write without_fleets: tell_all, or without_fleets: tell_nobody" in found


def test_the_panels_of_one_file_raise_one_alarm(tmp_path: Path) -> None:
    [found] = problems(tmp_path, PANEL + SECOND.format(alarm="emergency_signal"))
    assert "all devices of a file share one alarm, but 'Main panel' has another alarm" in found
    file = tmp_path / "a.yaml"
    file.write_text(PANEL + SECOND.format(alarm="fire_alarm_trigger"))
    assert list(load(file).devices) == ["Main panel", "Second panel"]


def test_a_door_without_a_fire_input_raises_no_alarm(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "config" / "door_modbus.yaml").read_text()
    text = text.replace("  ward_door:\n", "  ward_door:\n    alarm: fire_alarm_trigger\n")
    [found] = problems(tmp_path, text)
    assert "this door has no fire input, so it can raise no alarm" in found


@pytest.mark.parametrize(
    ("choice", "note"),
    [
        ("tell_all", "under Jazzy and older an alarm stops every fleet, not only these"),
        ("tell_nobody", "under Jazzy and older an alarm stops no robot"),
    ],
)
def test_check_tells_which_robots_an_alarm_stops_under_jazzy(
    tmp_path: Path, choice: str, note: str
) -> None:
    file = tmp_path / "a.yaml"
    file.write_text(NAMED.replace("tell_all", choice))
    notes = findings(load(file)).notes
    assert any(note in one for one in notes)
    goes_out = any("goes out on fire_alarm_trigger" in one for one in notes)
    assert goes_out == (choice == "tell_all")


def test_a_panel_has_no_outputs_to_switch_off(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text(PANEL)
    assert not load(file).drives
    assert load(Path(__file__).parents[2] / "config" / "door_modbus.yaml").drives
