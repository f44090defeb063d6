"""Commands, systemd units and waits for the checks."""

import re
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Timer
from typing import Final, TypeVar

CONFIG: Final = Path("/mnt/tests/vm/guest/config")
PYTHON: Final = "/usr/lib/rmf-bridges/current/bin/python3"
LATE_S: Final = 60.0
"""The limit (s) of a wait that has no limit of its own."""
KEPT: Final = Path("/var/lib/checks-kept")
"""A file with one line for each service: the time (s) from kill -9 until its relays were off."""

Found = TypeVar("Found")


class Wrong(Exception):
    """A failed check. The text gives the findings."""


def sh(*words: str, fails: bool = False) -> str:
    """Return a command's output. Without `fails` the exit code must be 0. With `fails` it must not be
    0. Raises Wrong."""
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    print(f"{time.monotonic():.3f} $ {' '.join(words)} -> {done.returncode}\n{done.stdout}", end="")
    if (done.returncode != 0) is not fails:
        raise Wrong(f"{' '.join(words)}: exit code {done.returncode}: {done.stdout.strip()[-300:]}")
    return done.stdout


@contextmanager
def beside(*words: str) -> Iterator[None]:
    """Run a command in parallel with the block. Raises Wrong if its exit code is not 0."""
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as it:
        try:
            yield
            told = it.communicate()[0]
        finally:
            it.kill()
    print(f"{time.monotonic():.3f} $ {' '.join(words)} -> {it.returncode}\n{told}", end="")
    if it.returncode:
        raise Wrong(f"{' '.join(words)}: exit code {it.returncode}: {told.strip()[-300:]}")


def until(
    look: Callable[[], Found], what: str, within_s: float = LATE_S, pause_s: float = 0.2
) -> Found:
    """Return the first true result of `look`. Raises Wrong if no result is true in time."""
    deadline = time.monotonic() + within_s
    while not (seen := look()):
        if time.monotonic() > deadline:
            raise Wrong(f"not within {within_s:g} s: {what}")
        time.sleep(pause_s)
    return seen


def mounted(tag: str, place: str) -> Path:
    """Mount this folder of the host read only, and return the place."""
    if not Path(place).is_mount():
        sh("mount", "-t", "9p", "-o", "ro,trans=virtio,version=9p2000.L", tag, place)
    return Path(place)


def unit(name: str) -> str:
    """Return the name of the service of a YAML."""
    return f"rmf-bridge@{name}.service"


def shown(service: str, *names: str) -> dict[str, str]:
    """Return these properties of a unit."""
    text = sh("systemctl", "show", service, *(f"-p{name}" for name in names))
    return dict(line.split("=", 1) for line in text.splitlines())


def is_active(service: str) -> bool:
    """Return whether the service is running and ready."""
    return shown(service, "ActiveState")["ActiveState"] == "active"


def pid(service: str) -> int:
    """Return the service's main process, or 0."""
    return int(shown(service, "MainPID")["MainPID"])


def restarts(service: str) -> int:
    """Return how often systemd has restarted the service."""
    return int(shown(service, "NRestarts")["NRestarts"])


def ready_s(service: str) -> float:
    """Return the time (s) from the start of the service's process until it reported "ready"."""
    began = since_boot_s(service, "ExecMainStartTimestampMonotonic")
    return since_boot_s(service, "ActiveEnterTimestampMonotonic") - began


def since_boot_s(service: str, name: str) -> float:
    """Return a property of a unit whose value is a time (s, monotonic clock)."""
    return int(shown(service, name)[name]) / 1e6


def kill(service: str, name: str) -> None:
    """Send this signal only to the service's main process."""
    sh("systemctl", "kill", "-s", name, "--kill-whom=main", service)


def back(service: str, old: int) -> None:
    """Wait until the service is ready with another process."""

    def look() -> bool:
        seen = shown(service, "MainPID", "ActiveState")
        return seen["ActiveState"] == "active" and seen["MainPID"] != str(old)

    until(look, f"{service} is back", pause_s=0.5)


def keep(name: str, took_s: float) -> None:
    """Note how long this service's relays took to go off."""
    with KEPT.open("a") as out:
        print(name, took_s, file=out)


def cursor() -> str:
    """Return a cursor at the present end of the journal."""
    text = sh("journalctl", "-n", "0", "--show-cursor")
    return text.partition("-- cursor: ")[2].strip()


def journal(after: str, service: str) -> str:
    """Return the journal of a service after the cursor `after`."""
    sh("journalctl", "--sync")
    return sh("journalctl", *_monotonic(after, service))


def _monotonic(after: str, service: str) -> tuple[str, ...]:
    return "--no-hostname", "-o", "short-monotonic", f"--after-cursor={after}", "-u", service


def heard(after: str, service: str, pattern: str) -> float:
    """Return the time (s, monotonic clock) at which a service logged this pattern after the cursor
    `after`."""
    words = ["journalctl", "--follow", "--no-tail", *_monotonic(after, service)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as follows:
        late = Timer(LATE_S, follows.kill)
        late.start()
        try:
            assert follows.stdout
            for line in follows.stdout:
                print(line, end="")
                if re.search(pattern, line):
                    return float(line.partition("]")[0].lstrip("[ "))
        finally:
            late.cancel()
            follows.kill()
    raise Wrong(f"not within {LATE_S:g} s: {service} says {pattern!r}")


def enable(name: str) -> str:
    """Enable the service of one of our YAML files, and wait until it is ready. Return the service's
    unit."""
    sh("rmf-bridge", "enable", str(CONFIG / f"{name}.yaml"))
    until(lambda: is_active(unit(name)), f"{name} is ready")
    return unit(name)


def disable(name: str) -> None:
    """Stop the service, and keep it from starting at boot."""
    sh("rmf-bridge", "disable", name)


def far_side(name: str) -> None:
    """Start the simulated equipment to which a YAML file connects the daemon (far_side.py). It runs
    until the next boot."""
    given = (
        "Restart=always",
        "Type=notify",
        "WorkingDirectory=/mnt",
        "Environment=PYTHONPATH=/mnt",
    )
    words = ["--collect", f"--unit=far-{name}", *(f"--property={each}" for each in given)]
    file = str(CONFIG / f"{name}.yaml")
    sh("systemd-run", *words, PYTHON, "-m", "tests.vm.guest.far_side", file)
