"""Daemons that are suspended, that no longer hear the graph, or that hang. RMF must get no outdated
states. systemd must not be told that a hanging daemon is alive."""

import argparse
import os
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bridges.commands import reset
from bridges.messages.definitions import DoorModeValue
from bridges.runtime.loop import SUSPENDED_S
from tests.runtime.site import SERVICE, Graph, Module, command, daemon, environment, hold_open
from tests.waiting import wait_until

WATCHDOG = {**SERVICE, "WATCHDOG_USEC": "3000000"}
HURT = "tests.runtime.hurt"


class Systemd:
    """A stand-in for systemd's socket, to which a daemon sends its messages."""

    def __init__(self, path: Path) -> None:
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(path))
        self.socket.setblocking(False)

    def heard(self) -> list[bytes]:
        """Return the messages since the last call."""
        found: list[bytes] = []
        try:
            while True:
                found.append(self.socket.recv(100))
        except BlockingIOError:
            return found


@contextmanager
def systemd(directory: Path) -> Iterator[Systemd]:
    """Yield a listener on the socket `notify`, in place of systemd."""
    listening = Systemd(directory / "notify")
    yield listening
    listening.socket.close()


def _state(pid: int) -> str:
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]


def test_after_sigstop_no_earlier_state_is_shown_as_new(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    scan_s = 2.0
    module.file.write_text(module.yaml.replace("modbus,", f"modbus, scan_s: {scan_s},"))
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        hold_open(module, graph, running)
        pid = running.process.pid

        def suspended() -> bool:
            """Suspend the daemon. During the suspension the door leaves OPEN.

            Return False if SIGSTOP came in the middle of a scan.
            """
            module.tell("fail", "ward_door", "opened", "ok")
            wait_until(lambda: graph.last() is DoorModeValue.MODE_OPEN, "the door shows OPEN")
            shown = len(graph.states)
            wait_until(lambda: len(graph.states) > shown, "another state comes")
            os.kill(pid, signal.SIGSTOP)
            wait_until(lambda: _state(pid) == "T", "the daemon is suspended")
            module.tell("fail", "ward_door", "opened", "off")
            stopped = time.monotonic()
            wait_until(
                lambda: time.monotonic() > stopped + scan_s + 2 * SUSPENDED_S,
                "time passes",
            )
            resumed = time.time()
            os.kill(pid, signal.SIGCONT)
            wait_until(lambda: len(_since(graph, resumed)) > 2, "states go on")
            modes = _since(graph, resumed)
            assert DoorModeValue.MODE_OPEN not in modes
            if "suspended bus=module" not in running.log.read_text():
                return False
            assert modes[0] is DoorModeValue.MODE_UNKNOWN
            return True

        wait_until(suspended, "the daemon is stopped between two scans")


def _since(graph: Graph, resumed: float) -> list[DoorModeValue]:
    """Return the modes of the states with stamps from `resumed` on."""
    return [
        DoorModeValue(state.current_mode.value)
        for state in tuple(graph.states)
        if state.door_time.sec + state.door_time.nanosec / 1e9 >= resumed
    ]


def test_a_transport_that_cannot_be_restarted_ends_the_daemon_with_the_relay_off(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    hurt = tmp_path / "hurt"
    with (
        systemd(tmp_path) as manager,
        daemon(
            module.file,
            tmp_path / "run",
            program=(HURT, "reader", str(hurt)),
            **WATCHDOG,
            NOTIFY_SOCKET=str(tmp_path / "notify"),
        ) as running,
    ):
        hold_open(module, graph, running)
        heard = manager.heard()
        hurt.touch()

        def ended() -> bool:
            heard.extend(manager.heard())
            graph.request(DoorModeValue.MODE_OPEN)  # wakes the reader, which then fails
            return running.process.poll() is not None

        wait_until(ended, "the daemon has ended")
        assert running.process.returncode == os.EX_SOFTWARE
        assert [*heard, *manager.heard()][-1] == b"STOPPING=1"
        said = running.log.read_text()
    assert said.count("reader_failed") == 1
    assert said.index("died transport=") < said.index("outputs_off bus=module verified=yes")
    wait_until(lambda: module.relay() == [True, False], "the relay is off")


def test_the_watchdog_is_not_fed_while_a_call_of_the_bus_hangs(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    hurt, run = tmp_path / "hurt", tmp_path / "run"
    with (
        systemd(tmp_path) as manager,
        daemon(
            module.file,
            run,
            program=(HURT, "bus", str(hurt)),
            **WATCHDOG,
            NOTIFY_SOCKET=str(tmp_path / "notify"),
        ) as running,
    ):
        hold_open(module, graph, running)
        wait_until(lambda: b"WATCHDOG=1" in manager.heard(), "the watchdog is fed")
        hurt.touch()
        _status_written(run, 3)
        manager.heard()
        _status_written(run, 5)
        assert manager.heard() == []
        assert module.relay() == [True]
        assert running.end(signal.SIGABRT) == -signal.SIGABRT  # systemd would send SIGABRT
    off = command("outputs-off", module.file, "--runtime-dir", run)
    assert subprocess.run(off, env=environment()).returncode == 0
    wait_until(lambda: module.relay() == [True, False], "the relay is off")


def _status_written(run: Path, times: int) -> None:
    """Wait until the daemon's main thread has written the status `times` times.

    The main thread also sends the watchdog messages. So each new status shows that a watchdog message
    was possible.
    """
    for _ in range(times):
        before = (run / "status.json").stat().st_ino
        wait_until(lambda: _inode(run) not in (None, before), "the status is written")  # noqa: B023


def _inode(run: Path) -> int | None:
    try:
        return (run / "status.json").stat().st_ino
    except FileNotFoundError:
        return None


def test_a_reset_during_the_start_does_no_harm(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    """The test repeats `rmf-bridge reset`, from before the daemon's start until the daemon serves."""
    run = tmp_path / "run"
    asked = argparse.Namespace(file=module.file, runtime_dir=str(run), device="")
    codes: list[tuple[bool, int]] = []
    with daemon(module.file, run, **SERVICE) as running:

        def ready() -> bool:
            serving = "serving " in running.log.read_text()
            codes.append((serving, reset.run(asked)))
            return "ready " in running.log.read_text()

        wait_until(ready, "the daemon is in service")
        assert (False, 0) in codes, "no reset from before the daemon served was obeyed"
        assert {code for _, code in codes} <= {0, 1}
        hold_open(module, graph, running)
        assert running.end(signal.SIGTERM) == 0
    assert module.relay() == [True, False]
