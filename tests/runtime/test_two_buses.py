"""A dead bus that comes first in the YAML file. The dead bus must not keep a relay of another bus on.

The daemon ends by a signal, by a part that dies, or by SIGKILL.
"""

import os
import signal
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from msgspec.structs import replace

from bridges.messages.definitions import DoorModeValue
from bridges.runtime import dead_daemon, record
from bridges.runtime.record import Records
from bridges.settings.load import Config, load
from bridges.system.directories import Directories
from tests.depth import depth
from tests.runtime.hostile import live_before_dead, with_a_dead_bus_first
from tests.runtime.site import ROOT, SERVICE, Graph, Module, command, daemon, environment, hold_open
from tests.waiting import wait_until

HURT = "tests.runtime.hurt"
SIGNALS = [signal.SIGTERM, *depth([], [signal.SIGINT, signal.SIGHUP, signal.SIGTSTP])]
PARTS = ["loop", "reader", "watch"]
"""The parts that fail (`hurt.py`): a bus's thread, the transport, and the daemon's main thread, which
watches over both."""


@pytest.fixture
def two(module: Module) -> Iterator[Path]:
    """Yield a YAML file with two doors. The bus of the first door never answers."""
    with socket.create_server(("127.0.0.1", 0)) as hole:
        module.file.write_text(with_a_dead_bus_first(module.yaml, hole.getsockname()[1]))
        yield module.file


@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: signal.Signals(number).name)
def test_a_signal_switches_the_live_bus_off_while_the_dead_one_is_still_waited_for(
    two: Path, module: Module, graph: Graph, tmp_path: Path, number: int
) -> None:
    with daemon(two, tmp_path / "run", **SERVICE) as running:
        hold_open(module, graph, running)
        assert running.end(number) == 1, "the exit code hides the outputs of the dead bus"
        assert live_before_dead(running.log.read_text())
    assert module.relay() == [True, False]


@pytest.mark.parametrize("part", PARTS)
def test_a_part_that_dies_switches_the_live_bus_off_while_the_dead_one_is_still_waited_for(
    two: Path, module: Module, graph: Graph, tmp_path: Path, part: str
) -> None:
    hurt = tmp_path / "hurt"
    program = (HURT, part, str(hurt))
    with daemon(two, tmp_path / "run", program=program, **SERVICE) as running:
        hold_open(module, graph, running)
        hurt.touch()

        def ended() -> bool:
            graph.request(DoorModeValue.MODE_OPEN)  # wakes the transport's reader
            return running.process.poll() is not None

        wait_until(ended, "the daemon has ended")
        log = running.log.read_text()
        assert (running.process.returncode, "died" in log or "Traceback" in log) == (
            1 if part == "watch" else os.EX_SOFTWARE,
            True,
        )
        assert live_before_dead(log)
    assert module.relay() == [True, False]


def test_after_a_kill_the_live_bus_is_switched_off_while_the_dead_one_is_still_tried(
    two: Path, module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(two, tmp_path / "run", **SERVICE) as running:
        hold_open(module, graph, running)
        running.end(signal.SIGKILL)
    off = command("outputs-off", two, "--runtime-dir", tmp_path / "run")
    done = subprocess.run(off, env=environment(), capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr.index("outputs_off device=ward_door") < done.stderr.index("device=far_door")
    assert module.relay() == [True, False]


def test_what_several_dead_daemons_left_on_shares_the_time_of_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After TimeoutStopSec systemd kills ExecStopPost. So `outputs-off` must divide its time among the
    records, and must reach the last record in time."""
    file, given = tmp_path / "lift.yaml", list[float]()
    claims = Records(Directories(tmp_path, tmp_path))
    for name in ("lift_dry_contact", "lift_relay_board", "lift_one_hot"):
        config = load(ROOT / "config" / f"{name}.yaml")
        claims.write(replace(record.of(config), file=str(file)))

    def silent(config: Config, timeout_s: float, *_: object) -> set[str]:
        given.append(timeout_s)
        return set()

    monkeypatch.setattr(dead_daemon, "outputs_off", silent)
    assert dead_daemon._off_by_all(claims, file, {}) == 1
    assert len(given) == 3
    assert sum(given) == pytest.approx(dead_daemon.TIMEOUT_S)
