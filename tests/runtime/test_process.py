"""The daemon as a process: its start, its end, and the files that remain."""

import json
import os
import signal
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from bridges.messages.definitions import DoorModeValue
from bridges.runtime.daemon import STARTING
from hal_fakes.wire import runs_here
from tests.runtime.site import YAML, Daemon, Graph, Module, command, daemon, environment, hold_open
from tests.transports.conftest import ROS2
from tests.waiting import LEASE_S, PATIENCE_S, wait_until

ROOT = Path(__file__).parents[2]


@pytest.fixture(params=[runs_here(), ROS2])
def module(
    domain: int,
    request: pytest.FixtureRequest,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> Iterator[Module]:
    monkeypatch.setenv("TRANSPORT", runs_here())
    standing = Module(tmp_path, domain, request.param)
    yield standing
    standing.close()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_releases_the_relay_and_leaves_the_graph_at_once(
    module: Module, graph: Graph, tmp_path: Path, number: signal.Signals
) -> None:
    with daemon(module.file, tmp_path / "run") as running:
        hold_open(module, graph, running)
        assert running.end(number) == 0
        wait_until(lambda: graph.heard.matched() == 0, "the node has left the graph", LEASE_S)
    wait_until(lambda: module.relay() == [True, False], "the relay is off")
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == [
        *("holder.json", "holder.lock", "ring")
    ]


def test_after_a_kill_the_relay_is_switched_off_from_a_fresh_process_whatever_the_yaml_says_now(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run", RMF_BRIDGE_SERVICE="1") as running:
        hold_open(module, graph, running)
        off = command("outputs-off", module.file, "--runtime-dir", tmp_path / "run")
        refused = subprocess.run(off, env=environment(), capture_output=True, text=True)
        assert (refused.returncode, module.relay()) == (os.EX_UNAVAILABLE, [True])
        assert "To stop this process: " in refused.stderr
        running.end(signal.SIGKILL)
    module.file.write_text("kind: lift\n")
    done = subprocess.run(off, env=environment(), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    wait_until(lambda: module.relay() == [True, False], "the relay is off")


def test_outputs_that_cannot_be_verified_off_are_reported(module: Module, tmp_path: Path) -> None:
    module.file.write_text(YAML.format(domain=module.domain, transport=runs_here(), port=1))
    done = subprocess.run(
        command("outputs-off", module.file, "--runtime-dir", tmp_path / "run"),
        env=environment(),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert "cut the relays' supply" in done.stderr


def test_a_second_node_for_the_same_door_takes_both_out_of_service(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "one") as first:
        hold_open(module, graph, first)
        with daemon(module.file, tmp_path / "two") as second:
            wait_until(lambda: graph.last() is DoorModeValue.MODE_OFFLINE, "the door is OFFLINE")
            first.wait_for("TWO_NODES_FOR_ONE_DEVICE")
            second.wait_for("TWO_NODES_FOR_ONE_DEVICE")
            wait_until(lambda: module.relay()[-1] is False, "the relay is off")


def test_one_runtime_directory_has_one_daemon(module: Module, tmp_path: Path) -> None:
    with daemon(module.file, tmp_path / "run") as first:
        first.wait_for("ready")
        second = Daemon(module.file, tmp_path / "run")
        assert second.process.wait(PATIENCE_S) == os.EX_UNAVAILABLE


def test_systemd_hears_ready_then_finished_scans_then_stopping(
    module: Module, tmp_path: Path
) -> None:
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(path)
        systemd.settimeout(PATIENCE_S)
        env = {"NOTIFY_SOCKET": path, "WATCHDOG_USEC": "3000000"}
        with daemon(module.file, tmp_path / "run", **env) as running:
            heard = [systemd.recv(64)]
            while heard.count(b"WATCHDOG=1") < 3 or heard[-1] != b"WATCHDOG=1":
                heard.append(systemd.recv(64))
            assert running.end(signal.SIGTERM) == 0
        while heard[-1] != b"STOPPING=1":
            heard.append(systemd.recv(64))
    ready = heard.index(b"READY=1")
    assert heard.count(b"READY=1") == 1
    assert set(heard[:ready]) <= {STARTING.encode()}  # only a slow start sends these messages
    assert set(heard[ready:]) == {b"READY=1", b"WATCHDOG=1", b"STOPPING=1"}


def test_the_status_file_says_what_is_shown_what_is_driven_and_how_old_it_is(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run") as running:
        running.wait_for("ready")
        status = tmp_path / "run" / "status.json"
        wait_until(status.exists, "a status file")
        told = json.loads(status.read_text())
    assert told["simulated"] is False
    assert told["pid"] == running.process.pid
    door = told["devices"]["ward_door"]
    assert {"mode", "hold", "outputs", "faults", "input_age_s", "refused"} <= set(door)


def test_a_configuration_that_cannot_be_right_never_starts(tmp_path: Path) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text("kind: dor\n")
    refused = subprocess.run(
        command("run", file, "--runtime-dir", tmp_path / "run"),
        env=environment(),
        capture_output=True,
        text=True,
    )
    assert refused.returncode == os.EX_CONFIG
    assert f"{file}:1:7" in refused.stderr
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("options", "env", "why"),
    [
        (["--simulate"], {"RMF_BRIDGE_SERVICE": "1"}, "never simulates"),
        (["--expose"], {}, "needs --simulate"),
    ],
)
def test_a_service_never_simulates_and_a_real_device_needs_no_expose(
    tmp_path: Path, options: list[str], env: dict[str, str], why: str
) -> None:
    file = ROOT / "config" / "door_modbus.yaml"
    refused = subprocess.run(
        command("run", file, "--runtime-dir", tmp_path / "run", *options),
        env=environment(**env),
        capture_output=True,
        text=True,
    )
    assert refused.returncode == os.EX_USAGE
    assert why in refused.stderr


def test_a_killed_simulation_leaves_no_process_behind(domain: int, tmp_path: Path) -> None:
    file = ROOT / "config" / "door_modbus.yaml"
    options = ("--simulate", "--domain-id", str(domain))
    with daemon(file, tmp_path / "run", *options) as running:
        running.wait_for("ready")
        children = Path(f"/proc/{running.process.pid}/task/{running.process.pid}/children")
        pids = [int(pid) for pid in children.read_text().split()]
        assert len(pids) == 1
        running.end(signal.SIGKILL)
    wait_until(lambda: not any(_alive(pid) for pid in pids), "the far side has ended")


def test_a_simulation_says_so_wherever_it_is_looked_at(domain: int, tmp_path: Path) -> None:
    file = ROOT / "config" / "lift_dry_contact.yaml"
    options = ("--simulate", "--domain-id", str(domain))
    with daemon(file, tmp_path / "run", *options) as running:
        running.wait_for("ready")
        status = tmp_path / "run" / "status.json"
        wait_until(status.exists, "a status file")
        assert json.loads(status.read_text())["simulated"] is True
        assert not (tmp_path / "run" / "claimed.yaml").exists()
    assert "SIMULATED: no hardware moves" in running.log.read_text()


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return b"Z" not in Path(f"/proc/{pid}/stat").read_bytes().rsplit(b")", 1)[1][:3]
