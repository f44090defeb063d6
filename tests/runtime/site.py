"""A door on a real Modbus TCP connection. A real daemon talks to a simulated module."""

import json
import os
import re
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from bridges.messages.definitions import DoorMode, DoorModeValue, DoorRequest, DoorState
from bridges.messages.topics import DOOR_REQUESTS, DOOR_STATES
from hal_fakes.__main__ import served
from hal_fakes.caller import Caller
from hal_fakes.wire import join, wire
from tests.waiting import PATIENCE_S, wait_until

ROOT = Path(__file__).parents[2]
SERVICE = {"RMF_BRIDGE_SERVICE": "1"}
"""The environment variable that tells a daemon that systemd runs it as a service. Such a daemon starts
no guard process.

A guard process would run for minutes after the test's module has gone.
"""
PATIENT = "stale_after_s: 30"
"""A limit so long that the door does not become stale, even if a busy machine delays the scans.

For the same reason the module may take 1.5 s to answer, instead of 0.3 s.
"""
YAML = """
kind: door
driver: dry_contact
rmf: {{transport: {transport}, network: localhost, domain_id: {domain}}}
buses:
  module: {{type: modbus, tcp: {{host: 127.0.0.1, port: {port}}}, timeout_s: 1.5}}
doors:
  ward_door:
    limits: {{close_grace_s: 0, stale_after_s: 30}}
    inputs:
      opened: {{point: "unit 1 discrete input 0", active: high}}
      closed: {{point: "unit 1 discrete input 1", active: high}}
    outputs:
      hold_open: {{point: "unit 1 coil 0", active: high}}
"""


class Module:
    """The I/O module and the door behind it, in the test's process. The module outlives every
    daemon."""

    text = YAML

    def __init__(self, directory: Path, domain: int, transport: str | None = None) -> None:
        transport = transport or wire()
        self.directory = directory
        self.domain = domain
        self.edges: list[dict[str, Any]] = []
        draft = directory / "draft.yaml"
        draft.write_text(self.text.format(domain=domain, transport=transport, port=502))
        path = directory / "plant.sock"
        self._far_side = ExitStack()
        there: Any = self._far_side.enter_context(served(draft, "module", path))
        self.file = directory / "ward_door.yaml"
        port = there.get("tcp", there)["port"]
        self.yaml = self.text.format(domain=domain, transport=transport, port=port)
        self.file.write_text(self.yaml)
        self._follow = socket.socket(socket.AF_UNIX)
        self._follow.connect(str(path))
        self._follow.sendall(b"follow\n")
        self._follow.setblocking(False)
        self._partial = b""

    def relay(self) -> list[bool]:
        """Return every edge of the door's relay so far."""
        try:
            while chunk := self._follow.recv(65536):
                self._partial += chunk
        except BlockingIOError:
            pass
        *lines, self._partial = self._partial.split(b"\n")
        self.edges += [json.loads(line) for line in lines if line.startswith(b"{")]
        return [edge["value"] for edge in self.edges if edge["signal"] == "hold_open"]

    def tell(self, *words: str) -> None:
        """Give the simulated door an order, such as `fail ward_door opened off`."""
        with Caller(self.directory / "plant.sock") as control:
            control.order(" ".join(words))

    def hang(self) -> None:
        """Let the module stop answering. Its relay keeps its state."""
        self.tell("fail", "ward_door", "server", "stuck")

    def go_on(self) -> None:
        """Let the module answer again."""
        self.tell("fail", "ward_door", "server", "ok")

    def close(self) -> None:
        """Close the module."""
        self._follow.close()
        self._far_side.close()


def shipped(name: str, directory: Path, transport: str) -> Path:
    """Copy a shipped YAML file, choose this transport, and remove `ros_setup`. Return the copy."""
    text = (ROOT / "config" / name).read_text()
    text = re.sub(r" *ros_setup: .*\n", "", text)
    file = directory / name
    file.write_text(re.sub(r"transport: \w+", f"transport: {transport}", text))
    return file


BRIDGE = ("bridges.cli",)


def command(*arguments: str | Path, program: Sequence[str] = BRIDGE) -> list[str]:
    """Return the command line of `rmf-bridge …`. `program` can replace `rmf-bridge` by another Python
    module and this module's first arguments."""
    return [sys.executable, "-m", *program, *map(str, arguments)]


def environment(**more: str) -> dict[str, str]:
    """Return this process's environment without a service's variables, but with the variables in
    `more`."""
    units = ("RMF_", "NOTIFY", "WATCHDOG", "RUNTIME_DIR", "STATE_DIR", "SERVICE_RESULT")
    own = {name: value for name, value in os.environ.items() if not name.startswith(units)}
    return own | more


class Daemon:
    """A running `rmf-bridge run`, and its log."""

    def __init__(
        self,
        file: Path,
        runtime_dir: Path,
        *options: str,
        program: Sequence[str] = BRIDGE,
        **env: str,
    ) -> None:
        self.log = runtime_dir.parent / f"{runtime_dir.name}.log"
        with self.log.open("wb") as out:
            self.process = subprocess.Popen(
                command("run", file, "--runtime-dir", runtime_dir, *options, program=program),
                stdout=out,
                stderr=out,
                env=environment(**env),
            )

    def wait_for(self, text: str) -> None:
        """Wait until this text is in the log. Fail at once if the daemon ends first."""

        def said() -> bool:
            ended = self.process.poll() is not None
            log = self.log.read_text()
            assert text in log or not ended, f"the daemon ended without {text!r}:\n{log}"
            return text in log

        wait_until(said, f"{text!r} in {self.log}")

    def end(self, number: int) -> int:
        """Send a signal to the daemon. Wait for its end, and return its exit code."""
        self.process.send_signal(number)
        return self.process.wait(PATIENCE_S)


@contextmanager
def daemon(
    file: Path, runtime_dir: Path, *options: str, program: Sequence[str] = BRIDGE, **env: str
) -> Iterator[Daemon]:
    """Yield a running daemon. It ends when the block ends."""
    started = Daemon(file, runtime_dir, *options, program=program, **env)
    try:
        yield started
    finally:
        started.process.terminate()
        try:
            started.process.wait(PATIENCE_S)
        finally:
            started.process.kill()
            started.process.wait()


def hold_open(module: Module, graph: "Graph", running: Daemon) -> None:
    """Request OPEN again and again, until the relay is on and so holds the door open."""
    running.wait_for("ready")

    def held() -> bool:
        graph.ask(DoorModeValue.MODE_OPEN)
        return module.relay() == [True]

    wait_until(held, "the relay holds the door")


class Graph:
    """A node that stands in for RMF. It requests the door and hears the door's states."""

    def __init__(self, domain: int) -> None:
        self.states: list[DoorState] = []
        self.transport = join("rmf", domain)
        self._requests = self.transport.publisher(DOOR_REQUESTS)
        self.heard = self.transport.subscribe(DOOR_STATES, self.states.append)

    def ask(self, mode: DoorModeValue) -> None:
        """Wait until the door's node listens, then send a request."""
        wait_until(self._requests.matched, "the node listens")
        self.request(mode)

    def request(self, mode: DoorModeValue) -> None:
        """Send a request, even if no node listens."""
        request = DoorRequest(
            door_name="ward_door", requester_id="r", requested_mode=DoorMode(int(mode))
        )
        self._requests.publish(request)

    def last(self) -> DoorModeValue | None:
        """Return the mode in the door's last state, or None before the first state."""
        return DoorModeValue(self.states[-1].current_mode.value) if self.states else None
