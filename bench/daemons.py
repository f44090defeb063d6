"""Start and stop the measured processes, talk to the processes, and measure their cost."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from bench.figures import Row
from bridges.kinds.shared.rmf_section import Rmf
from bridges.transports.choose import open_transport
from bridges.transports.transport import Transport
from hal_fakes.wire import Wire

Content = dict[str, Any]
ROOT = Path(__file__).parent.parent
DOMAIN = 71
BARE = [sys.executable, "-m", "bench.bare", str(DOMAIN)]
WIRES: tuple[Wire, ...] = ("dds", "zenoh")
STOP_S = 5.0
SETTLE_S = 2.0


@contextmanager
def graph(speaks: Wire = "dds") -> Iterator[Transport]:
    """Join the DDS or zenoh network of the daemons from this process, and yield the transport."""
    rmf = Rmf(transport=speaks, domain_id=DOMAIN)
    transport = open_transport(rmf, "bench", localhost=True)
    try:
        yield transport
    finally:
        transport.close()


@contextmanager
def running(command: list[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run a process until the end of the block, and end it with SIGTERM."""
    with log.open("wb") as out:
        pipe = subprocess.PIPE
        child = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=out)
    try:
        yield child
    finally:
        child.send_signal(signal.SIGTERM)
        try:
            child.wait(STOP_S)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
        for end in (child.stdin, child.stdout):
            assert end is not None
            end.close()


def shipped(name: str) -> Content:
    """Return the content of an example file in `config/`."""
    content: Content = yaml.safe_load((ROOT / f"config/{name}.yaml").read_text())
    return content


def daemon(
    content: Content, directory: Path, transport: str = "dds", *, simulate: bool = True
) -> list[str]:
    """Write the YAML, and return the command that starts its daemon.

    `transport` and the loopback network replace the `rmf:` section of `content`.
    """
    file = directory.with_suffix(".yaml")
    rmf = {"transport": transport, "network": "localhost"}
    file.write_text(yaml.safe_dump({**content, "rmf": rmf}, sort_keys=False))
    run = [sys.executable, "-m", "bridges.cli", "run", str(file)]
    run += ["--simulate"] if simulate else []
    return [*run, "--domain-id", str(DOMAIN), "--runtime-dir", str(directory)]


@contextmanager
def ready(command: list[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run a process, and yield it when its log says that it is ready."""
    with running(command, log) as child:
        wait_for_log(log, "ready")
        yield child


def wait_for_log(log: Path, word: str, deadline_s: float = 20.0) -> None:
    """Wait for a line with this word in a log."""
    until = time.monotonic() + deadline_s
    while word not in log.read_text():
        if time.monotonic() > until:
            raise SystemExit(f"no {word!r} within {deadline_s} s in {log}:\n{log.read_text()}")
        time.sleep(0.002)


def cost(command: list[str], log: Path, watched_s: float = 10.0) -> Row:
    """Return the cost of an idle process: memory, threads, CPU, and the time until the process is
    ready."""
    started_at = time.monotonic()
    with ready(command, log) as child:
        ready_s = time.monotonic() - started_at
        time.sleep(SETTLE_S)
        return {**cost_of(child.pid, watched_s), "ready s": ready_s}


def cost_of(pid: int, watched_s: float) -> Row:
    """Return the cost of a process over the next `watched_s` seconds."""
    before_s = cpu_s(pid)
    time.sleep(watched_s)
    used_s = cpu_s(pid) - before_s
    threads = len(list(Path(f"/proc/{pid}/task").iterdir()))
    return {"RSS MB": memory_mb(pid), "threads": threads, "CPU %": 100 * used_s / watched_s}


def memory_mb(pid: int) -> float:
    """Return a process's resident memory in MB (10^6 bytes)."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def cpu_s(pid: int) -> float:
    """Return a process's user and system time together (s)."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(") ", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
