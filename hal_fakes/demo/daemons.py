"""The demo's daemons, as real processes. The demo acts on the plants behind a daemon through the
daemon's control socket."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

from bridges.runtime import holder, order
from bridges.system.directories import Directories
from hal_fakes.caller import Caller, SimulationRefused
from hal_fakes.plants.plant import Edge
from hal_fakes.wire import wire
from workbench.page import access

STOP_WITHIN_S = 20.0
CONNECT_WITHIN_S = 60.0
TAIL = 15


class DemoFailed(Exception):
    """The error of a demo that failed. The error's text names the missing event."""


class Program:
    """One `rmf-bridge …` in a session of its own.

    The session keeps Ctrl-C in the terminal from the program. So Ctrl-C reaches only the demo, and the
    demo stops every program in order.
    """

    def __init__(self, name: str, log: Path, words: Iterable[str], domain_id: int) -> None:
        self.name = name
        self.log = log
        command = [sys.executable, "-m", "bridges.cli", *words]
        command += ["--domain-id", str(domain_id), "--transport", wire()]
        environment = {k: v for k, v in os.environ.items() if k != "RMF_BRIDGE_SERVICE"}
        with self.log.open("wb") as out:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,
            )

    def check(self) -> None:
        """Raise DemoFailed if the daemon has died."""
        if self._exited():
            raise DemoFailed(f"the daemon {self.name} has died; its log has the reason")

    def tail(self) -> str:
        """Return the end of the daemon's log."""
        return "\n".join(self.log.read_text(errors="replace").splitlines()[-TAIL:])

    def ask_to_stop(self) -> None:
        """Send SIGTERM. The daemon then switches its outputs off and leaves the graph."""
        if not self._exited():
            os.kill(self._process.pid, signal.SIGTERM)

    def end(self, deadline: float) -> None:
        """Wait for the program's end, then kill the rest of its session."""
        while not self._exited() and time.monotonic() < deadline:
            time.sleep(0.02)
        if self._process.returncode is None:
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()

    def _exited(self) -> bool:
        """Has the program exited? Its exit status is not collected, so its pid and session id stay
        reserved until `end`."""
        if self._process.returncode is not None:
            return True
        look = os.WEXITED | os.WNOHANG | os.WNOWAIT
        return os.waitid(os.P_PID, self._process.pid, look) is not None


class DaemonProcess(Program):
    """One `rmf-bridge run FILE --simulate`."""

    def __init__(self, file: Path, directory: Path, domain_id: int) -> None:
        self.runtime_dir = directory / file.stem
        words = ("run", str(file), "--simulate", "--runtime-dir", str(self.runtime_dir))
        super().__init__(file.stem, directory / f"{file.stem}.log", words, domain_id)

    def follow(self, tell: Callable[[Edge], None]) -> None:
        """From now on call `tell` for every edge of the daemon's plants. A thread makes the calls."""
        caller = self._caller()
        caller.order("follow")
        threading.Thread(target=_read, args=(caller, tell), daemon=True).start()

    def order(self, line: str) -> None:
        """Give the daemon's plants one order. Raises DemoFailed if the simulation refuses the order."""
        with self._caller() as caller:
            try:
                caller.order(line)
            except SimulationRefused as error:
                raise DemoFailed(str(error)) from None

    def reset(self) -> None:
        """Reset the daemon as `rmf-bridge reset` does."""
        places = Directories(self.runtime_dir, self.runtime_dir)
        if not self._exited() and (daemon := holder.look(places)):
            order.send(daemon, places, reset=True)

    def _caller(self) -> Caller:
        path, deadline = self.runtime_dir / "plant.sock", time.monotonic() + CONNECT_WITHIN_S
        while True:
            self.check()
            try:
                return Caller(path, patience_s=None)
            except (FileNotFoundError, ConnectionRefusedError):
                if time.monotonic() > deadline:
                    raise DemoFailed(f"{self.name} made no {path.name}") from None
                time.sleep(0.05)


class PageProcess(Program):
    """`rmf-bridge page`. The user `demo` may log in."""

    def __init__(self, directory: Path, domain_id: int, password: str) -> None:
        self._password = password
        passwords = directory / "passwords"
        access.add_user(passwords, "demo", password)
        words = ["page", "--localhost", "--passwords", str(passwords)]
        words += ["--listen", f"127.0.0.1:{_page_port()}"]
        words += ["--runtime-dirs", str(directory)]
        super().__init__("page", directory / "page.log", words, domain_id)

    def address(self) -> str:
        """Wait until the page has logged its address, and return the address."""
        deadline = time.monotonic() + CONNECT_WITHIN_S
        while not (said := [line for line in self.tail().splitlines() if "http://" in line]):
            self.check()
            if time.monotonic() > deadline:
                raise DemoFailed("the page did not log its address")
            time.sleep(0.05)
        return f"{said[0]}; log in as demo, password {self._password}"


def _page_port() -> str:
    """Return PAGE_PORT if it is set, otherwise 8080. If 8080 is in use, return 0, which means any free
    port."""
    if given := os.environ.get("PAGE_PORT"):
        return given
    try:
        socket.create_server(("127.0.0.1", 8080)).close()
    except OSError:
        return "0"
    return "8080"


def _read(caller: Caller, tell: Callable[[Edge], None]) -> None:
    with suppress(OSError), caller:
        for edge in caller.edges():
            tell(edge)


def stop_all(daemons: Iterable[Program], within_s: float = STOP_WITHIN_S) -> None:
    """End every daemon. Kill a daemon that still runs after `within_s` seconds."""
    daemons = list(daemons)
    for daemon in daemons:
        daemon.ask_to_stop()
    deadline = time.monotonic() + within_s
    for daemon in daemons:
        daemon.end(deadline)
