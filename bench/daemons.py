"""Starting and stopping what is measured: simulated daemons, and a bare transport node."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parent.parent
STOP_S = 5.0


@contextmanager
def running(command: list[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A process, ended by SIGTERM."""
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


def daemon(file: Path, directory: Path, domain: int, transport: str = "dds") -> list[str]:
    """The command of one simulated daemon, on this transport whatever its YAML says."""
    text = re.sub(r"transport: \w+", f"transport: {transport}", file.read_text())
    file = directory.with_suffix(".yaml")
    file.write_text(re.sub(r" *ros_setup: .*\n", "", text))
    run = [sys.executable, "-m", "bridges.cli", "run", str(file), "--simulate"]
    return [*run, "--domain-id", str(domain), "--runtime-dir", str(directory)]


def wait_for_log(log: Path, word: str, deadline_s: float = 20.0) -> None:
    """Until a line with this word is in a log."""
    until = time.monotonic() + deadline_s
    while word not in log.read_text():
        if time.monotonic() > until:
            raise SystemExit(f"no {word!r} within {deadline_s} s in {log}:\n{log.read_text()}")
        time.sleep(0.002)


class PlantSocket:
    """A simulation's control socket."""

    def __init__(self, path: Path) -> None:
        self._socket = socket.socket(socket.AF_UNIX)
        self._socket.settimeout(5.0)
        self._socket.connect(str(path))
        self._lines = self._socket.makefile("rw")

    def say(self, line: str) -> None:
        """One command; its answer must be `ok`."""
        self._lines.write(line + "\n")
        self._lines.flush()
        answer = self._lines.readline().strip()
        if answer != "ok":
            raise SystemExit(f"{line}: {answer}")

    def edge(self, signal_name: str, value: bool) -> float:
        """Wait for this edge to come after `follow`; its monotonic time (s)."""
        while True:
            edge = json.loads(self._lines.readline())
            if (edge["signal"], edge["value"]) == (signal_name, value):
                return float(edge["at"])

    def close(self) -> None:
        """Hang up."""
        self._lines.close()
        self._socket.close()


def memory_mb(pid: int) -> float:
    """Resident memory of a process in MB (10^6 bytes)."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def cpu_s(pid: int) -> float:
    """User and system time that a process has used (s)."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(") ", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def threads(pid: int) -> int:
    """How many threads a process has."""
    return len(list(Path(f"/proc/{pid}/task").iterdir()))
