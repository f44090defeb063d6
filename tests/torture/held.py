"""Attacks on a daemon from outside. Two attacks could keep a relay on: a dead bus, and processes that
wait for locks. Two attacks concern files: frequent reading of the lock, and links that another user
plants."""

import os
import shutil
import signal
import socket
import tempfile
import threading
from pathlib import Path

from bridges.runtime import holder
from bridges.runtime.runtime_directory import RuntimeDirectory
from bridges.system.directories import Directories, Distrusted
from tests.runtime.hostile import (
    NOBODY,
    group_member,
    live_before_dead,
    unit,
    with_a_dead_bus_first,
)
from tests.torture.deaths import PATIENCE_S, door
from tests.torture.table import Table
from tests.waiting import wait_until

SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGTSTP, signal.SIGRTMIN)
TAKES = 3000
PLANTED = 100


def dead_bus_first(directory: Path, table: Table) -> None:
    """Send each signal that would end or suspend a process. Meanwhile the first bus in the YAML never
    answers, and must not delay the other bus."""
    with door(directory) as here, socket.create_server(("127.0.0.1", 0)) as hole:
        module = here.module
        module.file.write_text(with_a_dead_bus_first(module.yaml, hole.getsockname()[1], 0.5))
        for number in SIGNALS:
            running = here.held()
            code = running.end(number)
            wait_until(lambda: not here.is_on(), "the relay is off", PATIENCE_S)
            assert live_before_dead(running.log.read_text())
            # Remove the record, so that the next start need not switch the dead bus off.
            shutil.rmtree(here.run)
            then = f"exit code {code}, the live bus off before the wait for the dead bus"
            table.count("such a signal, a dead bus listed first", then)


def readers(directory: Path, times: int, table: Table) -> None:
    """Kill a daemon with -9 while a user of the same group waits for locks. This user waits for the
    lock of every file that the user can open."""
    if os.geteuid() != 0:
        table.count("a group's member waits for every lock", "not tried: needs root", 0)
        return
    with tempfile.TemporaryDirectory() as public, door(directory) as here:
        os.chmod(public, 0o755)
        here.run = Path(public) / "run"
        here.run.mkdir()
        os.chown(here.run, 0, NOBODY)
        here.run.chmod(0o2750)
        for n in range(times):
            environ = unit(here.run, str(n))
            running = here.daemon(**environ)
            wait_until(here.is_on, "the relay holds the door", PATIENCE_S)
            with group_member(here.run) as opened:
                assert holder.HOLDER in opened
                running.end(signal.SIGKILL)
                assert here.outputs_off(**environ, SERVICE_RESULT="signal") == 0
            wait_until(lambda: not here.is_on(), "the relay is off", PATIENCE_S)
            table.count("kill -9 while a group's member waits for every lock", "relay off")


def looks(directory: Path, table: Table) -> None:
    """Take the lock again and again, each time with a single try. Meanwhile another thread reads in a
    loop who holds the lock, which must not block the lock."""
    places, end = Directories(directory, directory), threading.Event()

    def look() -> None:
        while not end.is_set():
            holder.look(places)

    looking = threading.Thread(target=look)
    looking.start()
    try:
        for _ in range(TAKES):
            RuntimeDirectory(places, directory / "lift.yaml", serves=True, wait_s=0.0).close()
    finally:
        end.set()
        looking.join()
    table.count("a take of the lock while a loop reads its holder", "granted", TAKES)


def planted(directory: Path, table: Table) -> None:
    """Start a daemon as root. Another user has planted a link in the path of its directory."""
    if os.geteuid() != 0:
        return
    precious, shared = directory / "precious" / "run", directory / "shared"
    precious.mkdir(parents=True)
    shared.mkdir()
    shared.chmod(0o1777)
    for n in range(PLANTED):
        (link := shared / str(n)).symlink_to(precious.parent)
        os.lchown(link, NOBODY, NOBODY)
        try:
            RuntimeDirectory(Directories(link / "run", link / "run"), Path("x.yaml"), serves=True)
        except Distrusted:
            assert not list(precious.iterdir())
            table.count("a planted link where root starts a daemon", "refused, nothing written")
