"""Deaths of a door's daemon, and lack of resources such as disk space. The Modbus server is real, and
the tests watch one of its relays."""

import os
import random
import resource
import shutil
import signal
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from bridges.messages.definitions import DoorModeValue
from bridges.runtime.signals import ENDING
from hal_fakes.domain import domain_for_a_while
from tests.runtime.site import SERVICE, Daemon, Graph, Module, command, environment
from tests.torture.table import Table
from tests.waiting import wait_until

LONGEST_LIFE_S = 4.0
PATIENCE_S = 60.0


class Door:
    """A Modbus module, and a stand-in for RMF that requests OPEN all the time."""

    def __init__(self, directory: Path, domain: int) -> None:
        directory.mkdir()
        self.module = Module(directory, domain)
        self.graph = Graph(self.module.domain)
        self.run = directory / "run"
        self._stop = threading.Event()
        self._asks = threading.Thread(target=self._ask)
        self._asks.start()

    def is_on(self) -> bool:
        """Return whether the module's relay is on."""
        return self.module.relay()[-1:] == [True]

    def daemon(self, **env: str) -> Daemon:
        """Start a daemon."""
        self.graph.states.clear()
        return Daemon(self.module.file, self.run, **env)

    def held(self) -> Daemon:
        """Start a daemon as a service, and wait until its relay is on."""
        running = self.daemon(**SERVICE)
        wait_until(self.is_on, "the relay holds the door", PATIENCE_S)
        return running

    def outputs_off(self, **env: str) -> int:
        """Run outputs-off as the systemd unit does, and return the exit code."""
        off = command("outputs-off", self.module.file, "--runtime-dir", self.run)
        environ = environment(**(SERVICE | env))
        return subprocess.run(off, env=environ, capture_output=True).returncode

    def states_go_on(self) -> None:
        """Wait until RMF has heard two more states."""
        before = len(self.graph.states)
        wait_until(lambda: len(self.graph.states) > before + 1, "states go on", PATIENCE_S)

    def close(self) -> None:
        self._stop.set()
        self._asks.join()
        self.graph.transport.close()
        self.module.close()

    def _ask(self) -> None:
        while not self._stop.wait(0.05):
            self.graph.request(DoorModeValue.MODE_OPEN)


@contextmanager
def door(directory: Path) -> Iterator[Door]:
    """Yield one door, until the end of the block."""
    with domain_for_a_while() as domain:
        standing = Door(directory, domain)
        try:
            yield standing
        finally:
            standing.close()


def kills(directory: Path, rng: random.Random, times: int, table: Table) -> None:
    """Kill a daemon with -9 at random moments. Half of the daemons run as services. The others are
    started by hand, and have a guard process that switches their relay off."""
    pause = threading.Event()
    with door(directory) as here:
        for n in range(times):
            by_hand = n % 2 == 0
            running = here.daemon(**({} if by_hand else SERVICE))
            if rng.random() < 0.5:
                wait_until(here.is_on, "the relay holds the door", PATIENCE_S)
                pause.wait(rng.uniform(0.0, 1.0))
            else:
                pause.wait(rng.uniform(0.0, LONGEST_LIFE_S))
            was_on = here.is_on()
            running.end(signal.SIGKILL)
            if not by_hand:
                assert here.outputs_off() == 0
            wait_until(
                lambda: not here.is_on() and _released(here.run), "the relay is off", PATIENCE_S
            )
            way = "its guard" if by_hand else "outputs-off"
            table.count(f"kill -9, then {way}", "relay off" + (", had been on" if was_on else ""))


def _released(run: Path) -> bool:
    return not list(run.glob("claimed-*"))


def signals(directory: Path, table: Table) -> None:
    """Send each signal that would end or suspend a process. The relay is on at that time."""
    with door(directory) as here:
        for number in sorted(ENDING - set(range(signal.SIGRTMIN + 1, signal.SIGRTMAX))):
            code = here.held().end(number)
            wait_until(lambda: not here.is_on(), "the relay is off", PATIENCE_S)
            table.count("each signal that ends or suspends", f"exit code {code}, relay off")


def shortages(directory: Path, rng: random.Random, times: int, table: Table) -> None:
    """Let a daemon that holds a door suffer each shortage, such as a full disk. The daemon must survive
    and then shut down cleanly."""
    with door(directory) as here:
        running = here.held()
        hurts: dict[str, Callable[[Door, int], None]] = {
            "full disk": lambda d, pid: _limited(d, pid, resource.RLIMIT_FSIZE, 0),
            "no descriptor left": lambda d, pid: _limited(d, pid, resource.RLIMIT_NOFILE, 3),
            "suspended process": _suspended,
            "removed directory": _removed,
        }
        for what in rng.sample([*hurts] * times, k=len(hurts) * times):
            hurts[what](here, running.process.pid)
            assert running.process.poll() is None
            assert here.is_on()
            table.count(what, "served on")
        code = running.end(signal.SIGTERM)
        wait_until(lambda: not here.is_on(), "the relay is off", PATIENCE_S)
        table.count("the end of that daemon", f"exit code {code}, relay off")


def _limited(here: Door, pid: int, what: int, soft: int) -> None:
    before = resource.prlimit(pid, what)
    resource.prlimit(pid, what, (soft, before[1]))
    here.states_go_on()
    resource.prlimit(pid, what, before)


def _suspended(here: Door, pid: int) -> None:
    os.kill(pid, signal.SIGSTOP)
    threading.Event().wait(1.0)
    os.kill(pid, signal.SIGCONT)
    here.states_go_on()


def _removed(here: Door, pid: int) -> None:
    shutil.rmtree(here.run, ignore_errors=True)
    here.states_go_on()
    wait_until((here.run / "status.json").exists, "the removed directory exists again", PATIENCE_S)
