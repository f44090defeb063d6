"""`rmf-bridge status`: its findings in runtime directories, its output, and its exit codes."""

import io
import json
import os
import pwd
import re
from pathlib import Path
from typing import Any

import pytest

from bridges import cli
from bridges.commands import status
from bridges.commands.status import IN_USE, show, users
from bridges.kinds import kind_names
from bridges.runtime import daemons as on_machine
from bridges.runtime import faults
from bridges.runtime.daemons import DOWN, FAULTY, NONE, WELL, DaemonStatus, daemons
from bridges.runtime.holder import HOLDER
from bridges.runtime.record import Records, of
from bridges.settings.load import load
from bridges.system import directories
from bridges.system.directories import Directories
from tests.commands.runtime import served
from workbench.metrics.machine import of_machine
from workbench.notify.troubles import LEFT_ON, of_daemons

ROOT = Path(__file__).parents[2]
STUCK = {"code": "DOOR_OPENING_FAULT", "detail": "held, but not open after 8 s"}


def lift(*found: dict[str, str]) -> dict[str, Any]:
    return {
        "file": "/etc/rmf-bridges/lift_a.yaml",
        "kind": "lift",
        "version": "1.2",
        "transport": "dds",
        "domain_id": 3,
        "heard_by": {"lift_states": 2},
        "hears": {"lift_requests": 0},
        "devices": {
            "Lift1": {
                "mode": "AGV",
                "floor": "L1",
                "session": "-",
                "faults": list(found),
                "input_age_s": 0.04,
                "refused": {},
            }
        },
    }


def seen(
    folder: Path, age_s: float = 0.0, units: dict[str, str] | None = None
) -> list[DaemonStatus]:
    path = folder / "status.json"
    written_at = path.stat().st_mtime if path.exists() else 0.0
    return list(daemons([folder], units or {}, written_at + age_s))


def shown(found: list[DaemonStatus]) -> list[str]:
    out = io.StringIO()
    show(found, out)
    return out.getvalue().splitlines()


def test_a_running_daemon_is_shown_with_its_devices_and_its_subscribers(tmp_path: Path) -> None:
    with served(tmp_path / "lift_a", lift()) as folder:
        found = seen(folder)
        lines = shown(found)
    assert [one.level for one in found] == [WELL]
    assert re.sub(r"by hand, \w+", "by hand, USER", "\n".join(lines)).splitlines() == [
        "lift_a: serving (by hand, USER)",
        "  /etc/rmf-bridges/lift_a.yaml: lift, version 1.2, dds domain 3",
        "  lift_states: heard by 2 nodes",
        "  lift_requests: nobody sends",
        "  Lift1: mode AGV, floor L1; read 0.0 s ago",
    ]


def test_a_fault_is_shown_with_its_cause_and_its_remedy(tmp_path: Path) -> None:
    with served(tmp_path / "lift_a", lift(STUCK)) as folder:
        found = seen(folder)
        lines = shown(found)
    remedy = faults.remedies()["DOOR_OPENING_FAULT"]
    assert [one.level for one in found] == [FAULTY]
    assert lines[-3:] == [
        "    DOOR_OPENING_FAULT: held, but not open after 8 s",
        f"      cause: {remedy.cause}",
        f"      do: {remedy.do}",
    ]


def test_a_remedy_names_the_device_and_its_file_and_its_settings() -> None:
    file = str(Path(__file__).parents[2] / "config" / "lift_dry_contact.yaml")
    known = faults.values(file, "Lift1")
    told = faults.remedies()
    assert faults.here(told["RMF_SILENT"], file, "Lift1", known).cause == (
        "RMF has sent no request for `request_timeout_s` (30 s)"
    )
    assert faults.here(told["FIRE_LATCHED"], file, "Lift1", known).do == (
        f"when it is safe: `rmf-bridge reset {file}`"
    )
    held = faults.here(told["HOLDER_SILENT"], "/x/lift a.yaml", "Lift 1", {})
    assert held.do == (
        "look into the car; then `rmf-bridge release 'Lift 1'`. If `holder_ttl_s` is set, the"
        " supervisor releases such a lift by itself"
    )
    assert faults.values("/no/such.yaml", "Lift1") == faults.values(file, "Lift9") == {}


def test_a_daemon_whose_status_is_old_hangs(tmp_path: Path) -> None:
    with served(tmp_path / "lift_a", lift()) as folder:
        found = seen(folder, age_s=6.0)
        assert (found[0].state, found[0].level) == ("old", DOWN)
        assert shown(found)[0].startswith("lift_a: runs, but silent for 6 s")


def test_a_daemon_that_starts_is_down_until_it_has_written_its_first_status(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with served(tmp_path / "lift_a", {}) as folder:
        (folder / "status.json").unlink()
        assert cli.main(["status", "--runtime-dir", str(folder)]) == DOWN
    (line,) = capsys.readouterr().out.splitlines()
    assert line.startswith("lift_a: runs, but has written no status yet (")


@pytest.mark.parametrize("told", [{}, {"devices": {}}, {"devices": {"Lift1": {}}}])
def test_an_incomplete_status_is_shown_as_far_as_possible(
    tmp_path: Path, told: dict[str, Any]
) -> None:
    with served(tmp_path / "lift_a", told) as folder:
        assert shown(seen(folder))[0].startswith("lift_a: serving")


@pytest.mark.parametrize(
    ("unit", "state"),
    [
        ("active (running)", "serving"),
        ("deactivating (stop-sigterm)", "serving"),
        ("activating (auto-restart)", "died"),
        ("failed (failed)", "died"),
        ("inactive (dead)", "died"),
    ],
)
def test_systemd_tells_whether_a_service_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, unit: str, state: str
) -> None:
    """A service may be unable to write its name into its directory. `status` asks systemd about this
    service too."""
    monkeypatch.setattr(on_machine, "SERVICE_RUN", tmp_path)
    with served(tmp_path / "lift_a", lift()) as folder:
        (folder / HOLDER).unlink()
        found = seen(folder, units={"lift_a": unit})
    assert [(one.state, one.unit) for one in found] == [(state, unit)]


def test_a_daemon_that_left_its_status_file_has_died(tmp_path: Path) -> None:
    with served(tmp_path / "lift_a", lift()) as folder:
        pass
    found = seen(folder)
    assert [(one.state, one.level) for one in found] == [("died", DOWN)]
    assert len(shown(found)) == 1


def test_the_age_of_a_reading_counts_up_to_now(tmp_path: Path) -> None:
    with served(tmp_path / "lift_a", lift()) as folder:
        assert shown(seen(folder, age_s=0.9))[-1] == "  Lift1: mode AGV, floor L1; read 0.9 s ago"


def test_a_table_of_a_device_is_shown_in_words(tmp_path: Path) -> None:
    content = lift()
    content["devices"]["Lift1"]["last_refusal"] = {"request": "task-1", "reason": "no such floor"}
    with served(tmp_path / "lift_a", content) as folder:
        told = "mode AGV, floor L1, last_refusal (request task-1, reason no such floor)"
        assert shown(seen(folder))[-1] == f"  Lift1: {told}; read 0.0 s ago"


def test_outputs_that_nobody_has_verified_off_are_reported_even_without_a_status(
    tmp_path: Path,
) -> None:
    with served(tmp_path / "lift_a", lift()) as folder:
        (folder / "status.json").unlink()
    config = load(ROOT / "config" / "door_modbus.yaml")
    record = Records(Directories(folder, folder)).write(of(config))
    found = seen(folder)
    assert [(one.state, one.level) for one in found] == [("left on", DOWN)]
    head, remedy = shown(found)
    assert head.startswith("lift_a: has died, and its outputs were not verified off (")
    assert remedy == (
        f"  do: rmf-bridge outputs-off {config.path}; if the device will not answer again,"
        f" cut its relays' supply and remove {record}"
    )


@pytest.mark.parametrize("unit", ["failed (failed)", "inactive (dead)", ""])
def test_outputs_left_on_are_reported_also_when_systemd_has_removed_the_runtime_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, unit: str
) -> None:
    """systemd removes it at the end of a service. It forgets a disabled unit too."""
    run, state = tmp_path / "run", tmp_path / "state"
    monkeypatch.setattr(on_machine, "SERVICE_RUN", run)
    monkeypatch.setattr(on_machine, "SERVICE_STATE", state)
    monkeypatch.setattr(directories, "SERVICE_RUN", run)
    places = Directories(run / "ward", state / "ward")
    Records(places).write(of(load(ROOT / "config" / "door_modbus.yaml")))
    (state / "clean").mkdir()
    units = {"ward": unit} if unit else {}
    found = [one for one in daemons(on_machine.folders(), units, 0.0) if one.by == "service"]
    assert [(one.name, one.state, one.unit) for one in found] == [("ward", "left on", unit)]
    (trouble,) = of_daemons(found, ())
    assert trouble.what == LEFT_ON
    (left_on,) = (one for one in of_machine(found) if one.name.endswith("outputs_unverified"))
    assert [sample.value for sample in left_on.samples] == [1]


def test_root_sees_the_outputs_that_a_users_daemon_left_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    user = pwd.getpwuid(os.getuid())
    home = pwd.struct_passwd((*user[:5], str(tmp_path / "home"), user.pw_shell))
    monkeypatch.setattr(pwd, "getpwuid", lambda uid: home)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "of_root"))
    folder = tmp_path / "ward"
    folder.mkdir()
    places = Directories(folder, tmp_path / "home/.local/state/rmf-bridge/ward")
    path = Records(places).write(of(load(ROOT / "config" / "door_modbus.yaml")))
    assert [one.state for one in seen(folder)] == ["stopped"]
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    (one,) = seen(folder)
    assert one.state == "left on"
    assert str(path) in one.why


def test_a_daemon_that_hangs_is_not_serving_after_the_clock_was_set_back(tmp_path: Path) -> None:
    with served(tmp_path / "lift_a", lift()) as folder:
        (found,) = seen(folder, age_s=-3600.0)
    assert (found.state, found.level) == ("old", DOWN)


def test_a_dead_simulation_has_nothing_to_switch_off(tmp_path: Path) -> None:
    with served(tmp_path / "lift_a", lift() | {"simulated": True}) as folder:
        pass
    (line,) = shown(seen(folder))
    assert line.startswith("lift_a: has died SIMULATED (")


def test_a_daemon_that_ended_well_has_left_only_its_lock(tmp_path: Path) -> None:
    with served(tmp_path / "lift_a", lift()) as folder:
        (folder / "status.json").unlink()
    assert [(one.state, one.level) for one in seen(folder)] == [("stopped", WELL)]


def test_a_failed_unit_without_a_directory_is_shown() -> None:
    found = list(daemons([], {"lift_b": "failed (failed)"}, 0.0))
    assert [(one.name, one.state, one.level) for one in found] == [("lift_b", "failed", DOWN)]
    (line,) = shown(found)
    assert line.startswith("lift_b: does not start; `rmf-bridge log lift_b` tells why (service, ")


def test_a_service_that_systemd_starts_again_and_again_is_down(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A daemon that finds no GPIO chip or no ROS ends before it opens a bus, and leaves no status."""
    monkeypatch.setattr(on_machine, "SERVICE_RUN", tmp_path)
    tries = {"lift_a": "activating (auto-restart)", "lift_b": "activating (auto-restart)"}
    with served(tmp_path / "lift_a", lift()) as folder:
        (folder / "status.json").unlink()
    found = seen(folder, units=tries)
    assert [(one.name, one.state, one.level) for one in found] == [
        ("lift_a", "failed", DOWN),
        ("lift_b", "failed", DOWN),
    ]


@pytest.mark.parametrize("broken", ["", "{", "[1]", '{"devices": 1}'])
def test_an_unreadable_status_counts_as_missing(tmp_path: Path, broken: str) -> None:
    with served(tmp_path / "lift_a", {}) as folder:
        (folder / "status.json").write_text(broken)
        assert [one.state for one in seen(folder)] == ["old"]


def test_a_name_from_the_graph_cannot_move_the_cursor(tmp_path: Path) -> None:
    told = lift()
    told["devices"] = {"\x1b[2J": told["devices"]["Lift1"]}
    with served(tmp_path / "lift_a", told) as folder:
        assert "\x1b" not in "".join(shown(seen(folder)))


def test_the_output_for_programs_is_json_and_an_empty_result_is_unknown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with served(tmp_path / "lift_a", lift(STUCK)) as folder:
        assert cli.main(["status", "--json", "--runtime-dir", str(folder)]) == FAULTY
    (told,) = json.loads(capsys.readouterr().out)
    assert (told["name"], told["state"], told["level"]) == ("lift_a", "serving", FAULTY)
    assert told["status"]["devices"]["Lift1"]["faults"] == [STUCK]
    assert cli.main(["status", "--runtime-dir", str(tmp_path / "nowhere")]) == NONE


def test_each_fault_has_a_remedy_and_each_remedy_belongs_to_a_fault() -> None:
    sources = "".join(path.read_text() for path in (ROOT / "bridges").rglob("*.py"))
    named = set(re.findall(r'Fault\(\s*"([A-Z_]+)"', sources))
    constants = set(re.findall(r'^[A-Z_]+(?:: Final)? = "([A-Z]+(?:_[A-Z]+)+)"$', sources, re.M))
    hazards = {"CODE_BLUE", "EARTHQUAKE", "EMERGENCY", "FIRE", "MANUAL", "OUT_OF_SERVICE"}
    known = set(faults.remedies())
    assert len(named) > 30
    assert named - known == set()
    assert known - named - constants - hazards == set()


@pytest.mark.parametrize("name", ["my.lift", "config/my.lift.yaml", "my.lift.yml"])
def test_a_daemon_with_a_dot_in_its_name_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    (tmp_path / "rmf-bridge").mkdir()
    with served(tmp_path / "rmf-bridge" / "my.lift", lift()):
        assert cli.main(["status", name]) == WELL


def test_an_unknown_name_is_answered_with_the_known_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    (tmp_path / "rmf-bridge").mkdir()
    with served(tmp_path / "rmf-bridge" / "lift_named", lift()):
        assert cli.main(["status", "no_such_lift"]) == NONE
    told = capsys.readouterr()
    assert re.search(r"^no daemon no_such_lift; there is .*\blift_named\b", told.err)
    assert told.out == ""


@pytest.mark.parametrize(
    ("kind", "device", "told"),
    [
        ("lift", {"session": "-"}, []),
        ("lift", {"session": "fleet/a"}, ["one: X is in use (session fleet/a)"]),
        ("door", {"hold": "on"}, ["one: X is in use (hold on)"]),
        ("charger", {"request": "-", "robot": "fleet/a"}, ["one: X is in use (robot fleet/a)"]),
        ("door_supervisor", {"held_by": "-"}, []),
        ("fleet", {"doing": "nothing"}, []),
        ("fleet", {"doing": "dock to L1 pad"}, ["one: X is in use (doing dock to L1 pad)"]),
        ("dispenser", {"mode": "IDLE", "queue": "-"}, []),
        ("dispenser", {"mode": "BUSY", "queue": "-"}, ["one: X is in use (mode BUSY)"]),
        (
            "new_kind",
            {"session": "-"},
            ["one: nobody knows whether a device of kind new_kind is in use"],
        ),
    ],
)
def test_a_device_with_a_user_or_of_an_unknown_kind_is_not_idle(
    kind: str, device: dict[str, str], told: list[str]
) -> None:
    status = {"kind": kind, "devices": {"X": device}}
    one = DaemonStatus(name="one", state="serving", by="service", status=status)
    assert list(users(one)) == told


def test_each_kind_tells_by_whom_a_device_is_used() -> None:
    assert IN_USE.keys() == set(kind_names())


@pytest.mark.parametrize("state", ["old", "died", "left on", "unknown", "failed"])
def test_the_users_of_a_daemon_that_does_not_serve_are_not_known(state: str) -> None:
    one = DaemonStatus(name="one", state=state, by="service")
    assert list(users(one)) == [
        "one: it does not serve, so nobody knows whether its devices are in use"
    ]


@pytest.mark.parametrize("others", [0, 1])
def test_a_named_daemon_that_does_not_exist_is_not_idle(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    others: int,
) -> None:
    monkeypatch.setattr(status, "units", dict)
    with served(tmp_path / "lift_a", lift()) as folder:
        monkeypatch.setattr(status, "daemon_folders", lambda: [folder][:others])
        for line in (["ghost"], ["--runtime-dir", str(tmp_path / "ghost")]):
            assert cli.main(["status", "--idle", *line]) == NONE
            told = capsys.readouterr()
            assert "no daemon" in told.out + told.err
            assert "idle" not in told.out
        assert (
            cli.main(["status", "--idle"]) == 0
        )  # also on a machine without daemons, for a rollout


def test_idle_is_an_exit_code_for_a_rollout(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with served(tmp_path / "lift_a", lift()) as folder:
        line = ["status", "--idle", "--runtime-dir", str(folder)]
        assert cli.main(line) == 0
        assert capsys.readouterr().out == "idle: no device of this machine is in use\n"
