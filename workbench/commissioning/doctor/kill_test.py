"""The kill test shows whether an output goes off when the process that holds the output is killed.

Another process (`victim.py`) switches one output on as the daemon would, with the daemon's lock, record
and guard. The test kills this process with -9. Then the guard must switch the output off and verify
that the output is off. The guard does the same as systemd's ExecStopPost after a service dies.

On GPIO, the test first checks whether the line is still an output. Only after this check may the guard
act.
"""

import os
import select
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from bridges.runtime.record import Records
from bridges.system.directories import Directories
from workbench.commissioning.doctor.finding import Finding, ok, warning, wrong
from workbench.commissioning.walk.core import WalkStep

KILL_TEST: Final = "kill test"
STARTS_S: Final = 15.0
SEEN_S: Final = 1.0
"""Time (s) for which a relay is on before the kill. A person needs this time to see the relay."""
OFF_WITHIN_S: Final = 15.0
"""Maximum time (s) until the output is off. `outputs-off` takes up to 5 s, and may run twice."""
LOOK_S: Final = 0.02
CUT: Final = "cut the relays' supply; then rmf-bridge outputs-off FILE"

StillDriven = Callable[[], bool | None]
"""A function that tells whether the kernel still drives the line, or None if this is unknown."""


def kill_test(
    file: Path,
    device: str,
    step: WalkStep,
    places: Directories,
    runtime_dir: str | None,
    kept: StillDriven,
) -> Iterator[Finding]:
    """Run the kill test. No daemon may serve the file during the test."""
    name = f"{device} {step.name}"
    victim = _started(file, device, step.name, runtime_dir)
    try:
        said = _line(victim, STARTS_S)
        if said != "on":
            why = said or "the test's process is silent"
            yield wrong(
                KILL_TEST, f"{name} was not switched on: {why}", "the test shows nothing", why
            )
            return
        if early := _line(victim, SEEN_S) or _ended_early(victim):
            yield wrong(
                KILL_TEST,
                f"{name} went off before the kill: {early}",
                "the test shows nothing",
                early,
            )
            return
        victim.kill()
        victim.wait()
        died_at, still = time.monotonic(), kept()
    finally:
        _ended(victim)
    yield from _kernel(name, still)
    yield _outcome(name, _off_after(places, file, died_at))


def _kernel(name: str, still: bool | None) -> Iterator[Finding]:
    if still is None:
        return
    if still:
        do = "dtparam=strict_gpiod in /boot/firmware/config.txt, reboot, and test again"
        means = "if outputs-off cannot run, the relay stays on"
        yield warning(KILL_TEST, f"{name}: the kernel kept the line as it was", means, do)
    else:
        yield ok(KILL_TEST, f"{name}: the kernel released the line at once")


def _outcome(name: str, off_after_s: float | None) -> Finding:
    if off_after_s is None:
        found = f"{name} is not verified off {OFF_WITHIN_S:g} s after kill -9"
        return wrong(KILL_TEST, found, "IT MAY STILL BE ON", CUT)
    done = "the guard switched the output off; this was verified"
    found = f"{name} was on, the process that held it was killed with -9, and {done}"
    return ok(KILL_TEST, f"{found} after {off_after_s:.1f} s")


def _started(
    file: Path, device: str, step: str, runtime_dir: str | None
) -> "subprocess.Popen[bytes]":
    words = [sys.executable, "-m", "workbench.commissioning.doctor.victim", str(file), device, step]
    return subprocess.Popen(
        [*words, runtime_dir or ""],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )


def _line(victim: "subprocess.Popen[bytes]", within_s: float) -> str:
    """Return the victim's next line. Return "" if no line comes within `within_s` (s), or if the victim
    has ended."""
    assert victim.stdout
    if not select.select([victim.stdout], [], [], within_s)[0]:
        return ""
    return os.read(victim.stdout.fileno(), 4096).decode(errors="replace").strip()


def _ended_early(victim: "subprocess.Popen[bytes]") -> str:
    return "" if victim.poll() is None else "the test's process has ended by itself"


def _ended(victim: "subprocess.Popen[bytes]") -> None:
    """Close the victim's input, and wait until the victim has ended. A victim that still lives switches
    the output off before the victim ends."""
    assert victim.stdin
    assert victim.stdout
    victim.stdin.close()
    victim.stdout.close()
    victim.wait()


def _off_after(places: Directories, file: Path, died_at: float) -> float | None:
    """Return the time (s) until `outputs-off` removed the record. Return None if the record is still
    there. `outputs-off` removes the record after a check that all outputs are off."""
    pause = threading.Event()
    while (after_s := time.monotonic() - died_at) < OFF_WITHIN_S:
        if not Records(places).unreleased():
            return after_s
        pause.wait(LOOK_S)
    return None
