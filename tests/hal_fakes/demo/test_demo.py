"""The demo, with real processes on real DDS."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from hal_fakes.demo.daemons import DaemonProcess, DemoFailed, stop_all
from hal_fakes.wire import Wire, runs_here, wire
from tests.processes import RUN, running
from tests.waiting import PATIENCE_S, wait_until

CONFIG = Path(__file__).parents[3] / "config"
PATIENTLY = ("--patience", "10")
"""Options that let the demo wait longer, because the test's machine may be busy."""


@contextmanager
def demo(directory: Path, *options: str, on: Wire | None = None) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen(
        [sys.executable, "-m", "hal_fakes.demo", *options],
        env={
            "TMPDIR": str(directory),
            "PATH": "/usr/bin:/bin",
            "TRANSPORT": on or wire(),
            RUN: os.environ[RUN],
        },
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        yield process
    finally:
        process.terminate()
        process.communicate(timeout=PATIENCE_S)


@pytest.fixture
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a short path, because the path of a socket has at most 107 characters."""
    return tmp_path_factory.mktemp("d")


@pytest.mark.long(25)
def test_a_robot_goes_through_the_door_rides_the_lift_and_charges(directory: Path) -> None:
    with demo(directory, *PATIENTLY, on=runs_here()) as process:
        out, _ = process.communicate()
    assert process.returncode == 0, out
    assert "\nRIGHT: the robot went through the door, rode from L1 to L3 and charged" in out
    assert (running(directory), list(directory.iterdir())) == ([], [])


@pytest.mark.long(23)
def test_a_failed_demo_prints_the_reason_and_the_last_states_and_the_logs(
    directory: Path,
) -> None:
    with demo(directory, "--fail", "ward_door", "operator", "stuck") as process:
        out, _ = process.communicate()
    assert process.returncode == 1, out
    assert "\nlast state of Lift1: car at L1, door closed, mode HUMAN\n" in out
    assert "WRONG: waited 20 s for ward_door to be open, and the heartbeat to list the robot" in out
    assert out.count("--- the end of ") == 3
    assert running(directory) == []


def test_an_unknown_part_of_a_plant_makes_the_demo_fail(domain: int, directory: Path) -> None:
    daemon = DaemonProcess(CONFIG / "door_modbus.yaml", directory, domain)
    try:
        with pytest.raises(
            DemoFailed, match=r"^fail ward_door flux_capacitor off: error ward_door has no"
        ):
            daemon.order("fail ward_door flux_capacitor off")
    finally:
        stop_all([daemon])


def test_an_unknown_device_of_the_demo_is_a_usage_error(directory: Path) -> None:
    with demo(directory, "--fail", "Lift9", "car", "off") as process:
        out, _ = process.communicate()
    assert process.returncode == 2
    assert "there are Lift1, ward_door, charger_a" in out


def test_ctrl_c_stops_every_process_and_leaves_nothing_behind(directory: Path) -> None:
    with demo(directory) as process:
        assert process.stdout is not None
        wait_until(lambda: len(running(directory)) >= 3, "three daemons run")
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130, out
    assert (running(directory), list(directory.iterdir())) == ([], [])


def test_a_daemon_that_cannot_start_is_noticed_and_its_log_says_why(
    domain: int, directory: Path
) -> None:
    daemon = DaemonProcess(CONFIG / "none_such.yaml", directory, domain)
    try:
        wait_until(lambda: died(daemon), "the daemon's death is noticed")
        assert "none_such.yaml" in daemon.tail()
    finally:
        stop_all([daemon])


def died(daemon: DaemonProcess) -> bool:
    try:
        daemon.check()
    except DemoFailed:
        return True
    return False


def test_a_daemon_that_hangs_is_killed_with_its_fake(domain: int, directory: Path) -> None:
    daemon = DaemonProcess(CONFIG / "door_modbus.yaml", directory, domain)
    try:
        wait_until(lambda: "ready " in daemon.tail(), "the daemon is ready")
        assert len(running(directory)) == 2
        daemon._process.send_signal(signal.SIGSTOP)
    finally:
        stop_all([daemon], within_s=0.2)
    wait_until(lambda: running(directory) == [], "no process is left")
