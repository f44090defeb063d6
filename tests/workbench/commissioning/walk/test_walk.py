"""`rmf-bridge walk` on a real terminal with a real Modbus module. The tests also kill the process."""

import json
import os
import signal
from pathlib import Path

import pytest

from bridges import cli
from bridges.runtime.record import Records, of
from bridges.settings.load import load
from bridges.system.directories import Directories
from tests.commands.terminal import Terminal
from tests.processes import running
from tests.runtime.on_two_buses import DOOR
from tests.runtime.site import Module, daemon, environment
from tests.waiting import wait_until
from workbench.commissioning.examples import CONFIG

NO_OUTPUTS = (
    *("robots_http.yaml", "robots_traffic_light.yaml", "robots_vda5050.yaml"),
    *("lift_supervisor.yaml", "door_supervisor.yaml", "charger_coordinator.yaml"),
)


def walk(module: Module, tmp_path: Path) -> Terminal:
    words = ("--runtime-dir", tmp_path / "run", "--record", tmp_path / "record", "--by", "me")
    return Terminal("walk", module.file, *words, environ=environment())


def test_an_output_is_tried_seen_and_signed(module: Module, tmp_path: Path) -> None:
    terminal = walk(module, tmp_path)
    terminal.wait_for("closed yes")
    terminal.type("\r")
    terminal.wait_until(lambda: module.relay() == [True], "the relay is on")
    row = "| hold_open | the door is open | seen: the door is open |"
    terminal.wait_until(
        lambda: row in (tmp_path / "record.md").read_text(), "the feedback is noted"
    )
    terminal.type("\rq")
    terminal.wait_for("every output verified off")
    assert terminal.end() == 0
    assert module.relay() == [True, False]
    record = json.loads((tmp_path / "record.json").read_text())
    assert (record["device"], record["by"], record["end"]) == (
        "ward_door",
        "me",
        "ended by key; every output verified off",
    )
    assert record["outputs"] == [
        {"output": "hold_open", "expected": "the door is open", "seen": "seen: the door is open"}
    ]
    assert record["inputs"][1] == {
        "signal": "closed",
        "point": "unit 1 discrete input 1",
        "seen": "on and off",
    }
    assert row in (tmp_path / "record.md").read_text()


@pytest.mark.parametrize("how", ["closed terminal", "kill -9", "SIGTERM"])
def test_however_it_ends_the_output_goes_off(module: Module, tmp_path: Path, how: str) -> None:
    terminal = walk(module, tmp_path)
    terminal.wait_for("closed yes")
    terminal.type("\r")
    terminal.wait_until(lambda: module.relay() == [True], "the relay is on")
    terminal.wait_until(
        lambda: "nothing was seen" in (tmp_path / "record.md").read_text(),
        "the record notes that nothing was seen",
    )
    if how == "closed terminal":
        terminal.close()
    else:
        os.kill(terminal.pid, signal.SIGKILL if how == "kill -9" else signal.SIGTERM)
    terminal.wait()
    wait_until(lambda: module.relay() == [True, False], "the relay is off")
    wait_until(lambda: running(tmp_path / "run") == [], "the walk's guard has ended too")
    assert "| the door is open | not tried |" not in (tmp_path / "record.md").read_text()


def test_walk_refuses_a_device_that_is_served(module: Module, tmp_path: Path) -> None:
    with daemon(module.file, tmp_path / "run") as running:
        running.wait_for("ready file")
        terminal = walk(module, tmp_path)
        terminal.wait_for("To stop this process: ")
        assert terminal.end() == os.EX_UNAVAILABLE


def test_practice_begins_whatever_a_dead_daemon_has_left_on(module: Module, tmp_path: Path) -> None:
    run = tmp_path / "run"
    run.mkdir(mode=0o700)
    left = Records(Directories(run, run)).write(of(load(module.file)))
    words = ("--simulate", "--runtime-dir", run, "--record", tmp_path / "record")
    terminal = Terminal("walk", module.file, *words, environ=environment())
    terminal.wait_for("closed yes")
    terminal.type("q")
    terminal.wait_for("every output verified off")
    assert (terminal.end(), left.exists(), module.relay()) == (0, True, [])


def test_a_record_that_cannot_be_written_ends_the_walk_before_anything_is_switched(
    module: Module, tmp_path: Path
) -> None:
    (tmp_path / "record").write_text("a file, not a directory")
    words = ("--runtime-dir", tmp_path / "run", "--record", tmp_path / "record" / "of")
    terminal = Terminal("walk", module.file, *words, environ=environment())
    terminal.wait_for("every output verified off. Record: not written")
    assert terminal.end() == os.EX_CANTCREAT
    assert module.relay() == []


def test_without_a_terminal_it_switches_nothing(
    module: Module, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["walk", str(module.file)]) == os.EX_USAGE
    assert "walk needs a terminal" in capsys.readouterr().err


@pytest.mark.parametrize("file", NO_OUTPUTS)
def test_a_kind_without_outputs_is_refused_in_one_sentence(file: str, tmp_path: Path) -> None:
    words = ("--simulate", "--runtime-dir", tmp_path / "run")
    terminal = Terminal("walk", CONFIG / file, *words, environ=environment())
    terminal.wait_for(f"a {load(CONFIG / file).kind} has no outputs to test by hand\r\n")
    assert terminal.end() == os.EX_USAGE
    assert terminal.screen.count(b"\n") == 1


@pytest.mark.parametrize(
    ("file", "reading"),
    [("alarm_panel.yaml", "sources fire_panel no"), ("charger_register.yaml", "activity idle")],
)
def test_a_device_without_outputs_to_test_shows_its_readings(
    file: str, reading: str, tmp_path: Path
) -> None:
    words = ("--simulate", "--runtime-dir", tmp_path / "run", "--record", tmp_path / "record")
    terminal = Terminal("walk", CONFIG / file, *words, environ=environment())
    terminal.wait_for(reading)
    terminal.type("q")
    terminal.wait_for("every output verified off")
    assert terminal.end() == 0
    assert json.loads((tmp_path / "record.json").read_text())["outputs"] == []


def test_a_walk_shows_the_contacts_of_both_buses(tmp_path: Path) -> None:
    file = tmp_path / "door.yaml"
    file.write_text(DOOR)
    words = ("--simulate", "--runtime-dir", tmp_path / "run", "--record", tmp_path / "record")
    terminal = Terminal("walk", file, *words, environ=environment())
    terminal.wait_for("closed yes")
    terminal.type("\rq")
    terminal.wait_for("every output verified off")
    assert terminal.end() == 0
    inputs = json.loads((tmp_path / "record.json").read_text())["inputs"]
    assert {one["signal"]: one["seen"] for one in inputs}["fire"] == "off"
