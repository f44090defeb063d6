"""The deaths of a daemon. After every death the outputs go off.

The daemon serves a door on a real Modbus connection, and dies while its relay is on.
"""

import os
import pty
import re
import resource
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path

import msgspec
import pytest
from msgspec.structs import replace

from bridges.messages.definitions import DoorModeValue
from bridges.runtime import order
from bridges.runtime.holder import HOLDER, ourselves
from bridges.runtime.signals import ENDING, WRITES
from hal_fakes.wire import wire
from tests.depth import depth
from tests.runtime.site import (
    SERVICE,
    YAML,
    Graph,
    Module,
    command,
    daemon,
    environment,
    hold_open,
    shipped,
)
from tests.waiting import PATIENCE_S, wait_until


@pytest.fixture(scope="module")
def wall(
    module_domain: int, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Module, Graph]]:
    """Yield one module and one graph for all tests. Each test starts its own daemon."""
    standing = Module(tmp_path_factory.mktemp("wall"), module_domain)
    joined = Graph(standing.domain)
    yield standing, joined
    joined.transport.close()
    standing.close()


@pytest.fixture
def graph(wall: tuple[Module, Graph]) -> Graph:
    return wall[1]


@pytest.fixture
def module(wall: tuple[Module, Graph]) -> Module:
    """Return the module in its first state. The relay is off, and the list of edges is empty."""
    standing, joined = wall
    standing.go_on()
    standing.file.write_text(standing.yaml)
    assert standing.relay()[-1:] in ([], [False])
    standing.edges.clear()
    joined.states.clear()
    return standing


def fill(pipe: int) -> None:
    """Fill a pipe that nobody reads."""
    os.set_blocking(pipe, False)
    with suppress(BlockingIOError):
        while os.write(pipe, b"x"):
            pass
    os.set_blocking(pipe, True)


def _off(module: Module) -> None:
    wait_until(lambda: module.relay()[-1] is False, "the relay is off")


def _states_go_on(graph: Graph) -> None:
    before = len(graph.states)
    wait_until(lambda: len(graph.states) > before + 2, "states go on")


def _told(*arguments: str | Path, **env: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        command(*arguments), env=environment(**env), capture_output=True, text=True
    )


def _children(pid: int) -> list[int]:
    return [
        int(child)
        for task in Path(f"/proc/{pid}/task").iterdir()
        for child in (task / "children").read_text().split()
    ]


def _alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def test_the_rule_leaves_out_crashes_and_signals_that_end_nothing_by_default() -> None:
    left_alone = {signal.Signals(n).name for n in signal.valid_signals() - ENDING}
    assert left_alone == {
        *("SIGKILL", "SIGSTOP"),
        *("SIGABRT", "SIGBUS", "SIGFPE", "SIGILL", "SIGSEGV", "SIGSYS", "SIGTRAP"),
        *("SIGCHLD", "SIGCONT", "SIGURG", "SIGWINCH", "SIGUSR1"),
        *("SIGPIPE", "SIGXFSZ"),
    }


USUAL = [signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP, signal.SIGRTMAX]
"""The signals that `make test` sends to a daemon. SIGINT and SIGTERM are missing here, because
test_process.py sends them."""
EVERY = [n for n in ENDING if n < signal.SIGRTMIN or n in (signal.SIGRTMIN, signal.SIGRTMAX)]
"""The signals that `make deep` sends to a daemon. The first and the last realtime signal stand for all
realtime signals."""


@pytest.mark.parametrize(
    "number", depth(USUAL, sorted(EVERY)), ids=lambda number: signal.Signals(number).name
)
def test_every_signal_that_would_end_or_suspend_the_daemon_releases_the_relay(
    module: Module, graph: Graph, tmp_path: Path, number: signal.Signals
) -> None:
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        hold_open(module, graph, running)
        assert running.end(number) == 0
    _off(module)
    assert module.relay() == [True, False]


def test_signals_that_end_nothing_by_default_or_only_a_write_leave_the_door_held(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        hold_open(module, graph, running)
        usr1s = [signal.SIGUSR1] * 2000
        for number in (signal.SIGWINCH, signal.SIGCHLD, signal.SIGCONT, *usr1s, *WRITES):
            running.process.send_signal(number)
        _states_go_on(graph)
        assert module.relay() == [True]
        running.wait_for("no_order")
        assert "ordered what=" not in running.log.read_text()


def test_orders_of_several_people_at_one_time_are_all_obeyed_and_answered(
    module: Module, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        running.wait_for("ready")
        drill = command("drill", "--end", module.file, "--runtime-dir", tmp_path / "run")
        people = [subprocess.Popen(drill, env=environment()) for _ in range(3)]
        assert [one.wait(PATIENCE_S) for one in people] == [order.REFUSED] * 3
        said = running.log.read_text()
    assert (said.count("ordered what="), said.count("ordered what=DrillOrdered")) == (3, 3)


def test_an_unread_log_delays_neither_a_request_nor_the_end_nor_outputs_off(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    """The reader of the log has stopped reading, as after Ctrl-S or with a log shipper that hangs."""
    run, (read, unread), heard = tmp_path / "run", os.pipe(), b""
    processes = ExitStack()

    def started(word: str) -> "subprocess.Popen[bytes]":
        process = subprocess.Popen(
            command(word, module.file, "--runtime-dir", run),
            env=environment(**SERVICE),
            stderr=unread,
        )
        processes.callback(process.kill)
        return process

    def asked(mode: DoorModeValue, relay: bool) -> None:
        def done() -> bool:
            graph.ask(mode)
            return module.relay()[-1:] == [relay]

        wait_until(done, f"the relay is {relay}")

    with processes:
        for end in (signal.SIGTERM, signal.SIGKILL):
            running = started("run")
            while b" ready " not in heard:
                heard += os.read(read, 4096)
            fill(unread)
            for mode, relay in (
                (DoorModeValue.MODE_OPEN, True),
                (DoorModeValue.MODE_CLOSED, False),
            ):
                asked(mode, relay)
            asked(DoorModeValue.MODE_OPEN, True)
            running.send_signal(end)
            assert running.wait(PATIENCE_S) == (0 if end is signal.SIGTERM else -end)
            if end is signal.SIGKILL:
                assert started("outputs-off").wait(PATIENCE_S) == 0
            _off(module)
            os.set_blocking(read, False)
            with suppress(BlockingIOError):
                while os.read(read, 65536):
                    pass
            os.set_blocking(read, True)
            heard = b""
    os.close(read)
    os.close(unread)


def test_a_closed_terminal_releases_the_relay(module: Module, graph: Graph, tmp_path: Path) -> None:
    pid, terminal = pty.fork()
    if pid == 0:
        run = command("run", module.file, "--runtime-dir", tmp_path / "run")
        os.execve(run[0], run, environment(**SERVICE))

    def held() -> bool:
        graph.ask(DoorModeValue.MODE_OPEN)
        return module.relay() == [True]

    wait_until(held, "the relay holds the door")
    os.close(terminal)
    _off(module)
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0


def test_a_daemon_by_hand_that_is_killed_has_a_guard_that_switches_off(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run") as running:
        hold_open(module, graph, running)
        (guard,) = _children(running.process.pid)
        rss = next(
            line
            for line in Path(f"/proc/{guard}/status").read_text().splitlines()
            if "VmRSS" in line
        )
        assert int(rss.split()[1]) < 4096
        assert os.getsid(guard) == guard
        for number in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM):
            os.kill(guard, number)
        running.end(signal.SIGKILL)
        _off(module)
    wait_until(lambda: not _alive(guard), "the guard has ended")
    assert [path.name for path in (tmp_path / "run").glob("claimed-*")] == []


def test_the_guard_of_a_relative_path_uses_the_record_and_not_the_edited_file(
    module: Module, graph: Graph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(module.directory)
    with daemon(Path(module.file.name), tmp_path / "run") as running:
        hold_open(module, graph, running)
        module.file.write_text(module.yaml.replace("coil 0", "coil 5"))
        running.end(signal.SIGKILL)
        _off(module)
        wait_until(lambda: not [*(tmp_path / "run").glob("claimed-*")], "the record is removed")


def test_the_guard_of_a_link_uses_the_record_though_the_link_leads_to_another_file_now(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    link, new = tmp_path / "ward_door.yaml", tmp_path / "new.yaml"
    link.symlink_to(module.file)
    new.write_text(module.yaml.replace("ward_door", "other_door"))
    with daemon(link, tmp_path / "run") as running:
        hold_open(module, graph, running)
        link.unlink()
        link.symlink_to(new)
        running.end(signal.SIGKILL)
        _off(module)
        wait_until(lambda: not [*(tmp_path / "run").glob("claimed-*")], "the record is removed")
        assert "record_of_another_file" in running.log.read_text()


def test_another_file_in_one_directory_switches_a_daemons_outputs_off_only_after_its_death(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    other = tmp_path / "other.yaml"
    other.write_text(module.yaml.replace("ward_door", "other_door"))
    off = ("outputs-off", other, "--runtime-dir", tmp_path / "run")
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        hold_open(module, graph, running)
        assert (_told(*off).returncode, module.relay()) == (os.EX_UNAVAILABLE, [True])
        running.end(signal.SIGKILL)
    done = _told(*off)
    assert (done.returncode, done.stderr.count("outputs_off device=")) == (0, 2), done.stderr
    _off(module)


def test_the_guard_tries_until_hardware_that_was_silent_at_the_death_answers(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run") as running:
        hold_open(module, graph, running)
        module.hang()
        running.end(signal.SIGKILL)
        wait_until(lambda: "outputs_not_off" in running.log.read_text(), "a first try fails")
        assert module.relay() == [True]
        module.go_on()
        _off(module)


def test_the_guard_ends_with_a_daemon_that_ends_in_good_order(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run") as running:
        hold_open(module, graph, running)
        (guard,) = _children(running.process.pid)
        assert running.end(signal.SIGINT) == 0
        assert not _alive(guard)
    assert module.relay() == [True, False]


def test_a_daemon_in_a_systemd_unit_has_no_guard(module: Module, tmp_path: Path) -> None:
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        running.wait_for("ready")
        assert _children(running.process.pid) == []


def test_reset_and_outputs_off_as_typed_find_the_daemon_started_by_hand(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    user = {"XDG_RUNTIME_DIR": str(tmp_path / "xdg"), "XDG_STATE_HOME": str(tmp_path / "home")}
    log = (tmp_path / "log").open("wb")
    run = subprocess.Popen(command("run", module.file), env=environment(**user), stderr=log)

    def held() -> bool:
        graph.ask(DoorModeValue.MODE_OPEN)
        return module.relay() == [True]

    wait_until(held, "the relay holds the door")
    assert _told("reset", module.file, **user).returncode == 0
    refused = _told("outputs-off", module.file, **user)
    assert (refused.returncode, "To stop this process: " in refused.stderr) == (
        os.EX_UNAVAILABLE,
        True,
    )
    assert module.relay() == [True]
    run.terminate()
    assert run.wait(PATIENCE_S) == 0
    log.close()
    ended = _told("reset", module.file, **user)
    assert (ended.returncode, "no daemon serves" in ended.stderr) == (1, True)


def test_a_reset_during_outputs_off_is_not_sent_and_does_not_end_it(
    domain: int, tmp_path: Path
) -> None:
    hole = socket.create_server(("127.0.0.1", 0))
    port = hole.getsockname()[1]
    file = tmp_path / "silent.yaml"
    file.write_text(YAML.format(domain=domain, transport=wire(), port=port))
    off = subprocess.Popen(
        command("outputs-off", file, "--runtime-dir", tmp_path / "run"), env=environment()
    )
    wait_until((tmp_path / "run" / HOLDER).exists, "outputs-off has begun")
    told = _told("reset", file, "--runtime-dir", tmp_path / "run")
    assert told.returncode == 1
    off.send_signal(signal.SIGUSR1)
    assert off.wait(PATIENCE_S) == 1
    hole.close()


@pytest.mark.parametrize("name", ["-1", "1", "0", '{"pid":1,"file":"x","serves":true}', ""])
def test_a_planted_name_makes_reset_signal_nobody(tmp_path: Path, name: str) -> None:
    run = tmp_path / "run"
    run.mkdir()
    (run / HOLDER).write_text(name)
    told = _told("reset", tmp_path / "ward_door.yaml", "--runtime-dir", run)
    assert (told.returncode, told.stdout) == (1, "")
    assert "Traceback" not in told.stderr


@pytest.mark.skipif(os.geteuid() != 0, reason="only root must distrust other users")
def test_root_acts_as_the_owner_of_a_directory_and_so_signals_no_one_elses_process(
    tmp_path: Path,
) -> None:
    with (
        tempfile.TemporaryDirectory(dir="/tmp") as base,
        subprocess.Popen(["sleep", "60"]) as roots,
    ):
        os.chmod(base, 0o755)
        run = Path(base) / "run"
        run.mkdir()
        name = run / HOLDER
        started = int(Path(f"/proc/{roots.pid}/stat").read_text().rpartition(")")[2].split()[19])
        planted = replace(ourselves(Path("x"), serves=True), pid=roots.pid, started=started)
        name.write_bytes(msgspec.json.encode(planted))
        os.chown(run, 65534, 65534)
        os.chown(name, 65534, 65534)
        told = _told("reset", tmp_path / "x.yaml", "--runtime-dir", run)
        assert (told.returncode, roots.poll()) == (os.EX_UNAVAILABLE, None)
        roots.kill()


def test_outputs_off_works_without_its_directory(module: Module, tmp_path: Path) -> None:
    (tmp_path / "in the way").write_text("")
    for given in (tmp_path / "none", tmp_path / "in the way" / "none"):
        done = _told("outputs-off", module.file, "--runtime-dir", given)
        assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr


def test_outputs_off_works_where_nothing_can_be_written(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        hold_open(module, graph, running)
        running.end(signal.SIGKILL)
    full = subprocess.run(
        command("outputs-off", module.file, "--runtime-dir", tmp_path / "run"),
        env=environment(),
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0)),
    )
    assert full.returncode == 0, full.stderr
    _off(module)


@pytest.mark.parametrize(
    "name", ["lift_supervisor.yaml", "door_supervisor.yaml", "charger_coordinator.yaml"]
)
def test_a_kind_without_hardware_has_nothing_to_switch_off(tmp_path: Path, name: str) -> None:
    file = Path(__file__).parents[2] / "config" / name
    done = _told("outputs-off", file, "--runtime-dir", tmp_path / "run")
    assert (done.returncode, "nothing_to_switch_off" in done.stderr) == (0, True), done.stderr
    assert "Traceback" not in done.stderr


def test_a_start_first_switches_off_what_a_dead_daemon_left_on_under_another_yaml(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        hold_open(module, graph, running)
        running.end(signal.SIGKILL)
    module.file.write_text(module.file.read_text().replace("coil 0", "coil 1"))
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        running.wait_for("ready")
        assert module.relay() == [True, False]
        said = running.log.read_text()
        assert said.index("predecessor_outputs_off") < said.index("serving ")
        assert len(list((tmp_path / "run").glob("claimed-*"))) == 1


def test_hardware_that_a_dead_daemon_left_on_is_tried_until_it_answers(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        hold_open(module, graph, running)
        running.end(signal.SIGKILL)
    before = sorted((tmp_path / "run").glob("claimed-*"))
    module.file.write_text(re.sub(r"port: \d+", "port: 1", module.file.read_text()))
    module.hang()
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        running.wait_for("predecessor_not_off")
        running.wait_for("serving")
        assert set(before) < set((tmp_path / "run").glob("claimed-*"))
        assert module.relay() == [True]
        module.go_on()
        _off(module)
        running.wait_for("predecessor_outputs_off")
    assert [p for p in before if p.exists()] == []


def test_a_removed_directory_or_a_full_disk_stops_neither_a_daemon_nor_its_shutdown(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    with daemon(module.file, run, **SERVICE) as running:
        hold_open(module, graph, running)
        shutil.rmtree(run)
        wait_until((run / "status.json").exists, "the directory is there again")
        refused = _told("outputs-off", module.file, "--runtime-dir", run)
        assert (refused.returncode, module.relay()) == (os.EX_UNAVAILABLE, [True])
        full, before = (0, resource.RLIM_INFINITY), (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
        resource.prlimit(running.process.pid, resource.RLIMIT_FSIZE, full)
        _states_go_on(graph)
        assert (running.process.poll(), module.relay()) == (None, [True])
        resource.prlimit(running.process.pid, resource.RLIMIT_FSIZE, before)
        running.wait_for("written_again what=status.json")
        resource.prlimit(running.process.pid, resource.RLIMIT_FSIZE, full)
        shutil.rmtree(run)
        assert running.end(signal.SIGTERM) == 0
    assert module.relay() == [True, False]


def test_running_out_of_file_descriptors_ends_no_daemon(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        hold_open(module, graph, running)
        resource.prlimit(running.process.pid, resource.RLIMIT_NOFILE, (3, 3))
        running.wait_for("not_written what=status.json")
        _states_go_on(graph)
        assert (running.process.poll(), module.relay()) == (None, [True])
        assert running.end(signal.SIGTERM) == 0
    assert module.relay() == [True, False]


@pytest.mark.skipif(os.geteuid() != 0, reason="only root must distrust other users")
def test_where_a_live_daemon_cannot_be_ruled_out_only_execstoppost_switches_off(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        hold_open(module, graph, running)
        running.end(signal.SIGKILL)
    (tmp_path / "run").chmod(0o777)
    off = ("outputs-off", module.file, "--runtime-dir", tmp_path / "run")
    by_hand = _told(*off)
    assert (by_hand.returncode, "can be written by other users" in by_hand.stderr) == (
        os.EX_UNAVAILABLE,
        True,
    )
    assert module.relay() == [True]
    stopped = _told(*off, SERVICE_RESULT="signal")
    assert (stopped.returncode, "Traceback" in stopped.stderr) == (0, False), stopped.stderr
    _off(module)


def _runs_for_others() -> bool:
    """Return whether another user may run this Python. If Python lies below root's home directory, no
    other user may."""
    try:
        return subprocess.run([sys.executable, "-c", ""], user=65534).returncode == 0
    except PermissionError:
        return False


@pytest.mark.skipif(
    os.geteuid() == 0 and not _runs_for_others(), reason="no other user can run this Python"
)
def test_a_user_without_permission_is_told_what_to_do_and_switches_nothing(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with tempfile.TemporaryDirectory(dir="/tmp") as base:
        os.chmod(base, 0o755)
        run = Path(base) / "run"
        run.mkdir(mode=0o700)
        with daemon(module.file, run, **SERVICE) as running:
            hold_open(module, graph, running)
            for name in ("outputs-off", "reset"):
                stranger = subprocess.run(
                    command(name, module.file, "--runtime-dir", run),
                    env=environment(),
                    capture_output=True,
                    text=True,
                    user=65534 if os.geteuid() == 0 else None,
                )
                if os.geteuid() == 0:
                    assert (stranger.returncode, "sudo" in stranger.stderr) == (
                        os.EX_UNAVAILABLE,
                        True,
                    )
                assert "Traceback" not in stranger.stderr
            assert module.relay() == [True]


@pytest.mark.skipif(
    os.geteuid() != 0 or not _runs_for_others(), reason="no other user can run this Python"
)
def test_reset_of_a_file_in_a_folder_that_others_may_not_read_says_so(tmp_path: Path) -> None:
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o700)
    told = subprocess.run(
        command("reset", closed / "door.yaml"),
        env=environment(),
        capture_output=True,
        text=True,
        user=65534,
    )
    assert (told.returncode, "Permission denied" in told.stderr) == (69, True)
    assert "Traceback" not in told.stderr


@pytest.mark.skipif(
    os.geteuid() == 0 and not _runs_for_others(), reason="no other user can run this Python"
)
@pytest.mark.parametrize("name", ["door_rs485.yaml", "charger_wiferion.yaml"])
def test_a_user_who_may_not_open_the_adapter_is_told_what_to_do(name: str) -> None:
    with tempfile.TemporaryDirectory(dir="/tmp") as base:
        os.chmod(base, 0o755)
        adapter, file = Path(base) / "adapter", Path(base) / name
        adapter.touch(mode=0o000)
        text = (Path(__file__).parents[2] / "config" / name).read_text()
        file.write_text(re.sub(r"/dev/serial/by-id/[^ ,}\n]*", str(adapter), text))
        done = subprocess.run(
            command("outputs-off", file, "--runtime-dir", Path(base) / "none"),
            env=environment(),
            capture_output=True,
            text=True,
            user=65534 if os.geteuid() == 0 else None,
        )
    assert (done.returncode, "Traceback" in done.stderr) == (1, False), done.stderr
    assert "the daemon's user must be in the group dialout" in done.stderr


def test_missing_lgpio_or_permission_is_reported_in_one_line(tmp_path: Path) -> None:
    file = Path(__file__).parents[2] / "config" / "lift_dry_contact.yaml"
    done = _told("outputs-off", file, "--runtime-dir", tmp_path / "run")
    assert done.returncode == 1
    assert "outputs_not_off" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_bus_that_cannot_be_opened_leaves_nothing_to_switch_off(
    domain: int, tmp_path: Path
) -> None:
    """The daemon has taken over no output, so it must leave no record of claimed outputs. Such a record
    could never be removed without the hardware."""
    file = shipped("lift_dry_contact.yaml", tmp_path, wire())
    text = file.read_text()
    text = text.replace("domain_id: 0", f"domain_id: {domain}\n  network: localhost")
    file.write_text(text.replace("type: gpio", "type: gpio, chip: 99"))
    done = _told("run", file, "--runtime-dir", tmp_path / "run")
    assert (done.returncode, "outputs_not_off" in done.stderr) == (69, False), done.stderr
    assert "ERROR" in done.stderr.splitlines()[-1]
    assert list(tmp_path.rglob("claimed-*")) == []


def test_a_simulation_without_a_place_for_its_socket_says_so_in_one_line(
    domain: int, tmp_path: Path
) -> None:
    file = shipped("lift_dry_contact.yaml", tmp_path, wire())
    options = ("--simulate", "--domain-id", str(domain), "--runtime-dir", "/proc/none")
    done = _told("run", file, *options)
    assert (done.returncode, "Traceback" in done.stderr) == (69, False), done.stderr
    assert "cannot make the plant's control socket /proc/none/" in done.stderr.splitlines()[-1]


def test_a_simulation_needs_no_token(domain: int, tmp_path: Path) -> None:
    file = Path(__file__).parents[2] / "config" / "charger_http.yaml"
    text = file.read_text()
    with_token = tmp_path / "charger.yaml"
    with_token.write_text(
        re.sub(r'(api_base: "[^"]*")', r"\1, token_file: /none/token", text, count=1)
    )
    assert "token_file" in with_token.read_text()
    options = ("--simulate", "--domain-id", str(domain))
    with daemon(with_token, tmp_path / "run", *options) as running:
        running.wait_for("ready")
        assert "token_file" not in running.log.read_text()
