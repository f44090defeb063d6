"""The demos' stage: processes, journal, and one way out, however a demo ends.

Exit code 0 when it went right, 1 with the reason, 130 after Ctrl-C. Nothing is left running.
"""

import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from bridges.rmf import words
from bridges.rmf.transport import Transport, TransportError
from hal_fakes.demo.daemons import Daemon, Wrong, stop_all
from hal_fakes.demo.journal import Journal
from hal_fakes.domain import free_domain
from hal_fakes.wire import join, wire


class Interrupted(Exception):
    """Ctrl-C, or another signal to end."""


class Stage:
    """`daemons`: by the device that each serves. `files`: their YAMLs."""

    def __init__(self, files: dict[str, Path]) -> None:
        self.files = files
        self.daemons: dict[str, Daemon] = {}
        self.journal = Journal(time.monotonic(), sys.stdout.write, colour=sys.stdout.isatty())
        self._interrupted = False

    def interrupt(self, number: int, frame: FrameType | None) -> None:
        """Only marks it: nothing is cut off half-way, so nothing is forgotten."""
        self._interrupted = True

    def check(self) -> None:
        """Raises Interrupted, or Wrong when a daemon has died."""
        sys.stdout.flush()
        if self._interrupted:
            raise Interrupted
        for daemon in self.daemons.values():
            daemon.check()

    @contextmanager
    def up(self, directory: Path) -> Iterator[Transport]:
        """Every daemon started, on a domain and a loopback of their own, and a place beside them."""
        domain = free_domain()
        count = {2: "two", 3: "three", 4: "four"}[len(self.files)]
        self.note(f"{count} daemons on fake hardware, {wire()}, domain {domain}, loopback only")
        transport = join("rmf_demo", domain)
        try:
            for device, file in self.files.items():
                self.check()
                self.daemons[device] = Daemon(file, directory, domain)
            yield transport
            self.journal.flush(time.monotonic())
        finally:
            stop_all(self.daemons.values())
            transport.close()

    def order(self, device: str, line: str) -> None:
        """One order to the plants of a device's daemon."""
        self.daemons[device].order(line)

    def press(self, device: str, signal_name: str, on: bool) -> None:
        """A person or the building acts on a plant."""
        self.order(device, f"press {device} {signal_name} {'on' if on else 'off'}")

    def note(self, text: str) -> None:
        """A line of the demo's own."""
        self.journal.note("demo", text, time.monotonic())


def play(
    stage: Stage,
    act: Callable[[Path], None],
    problems: Callable[[Journal], Sequence[str]],
    summary: Callable[[Journal], str],
) -> int:
    """Act, and judge what came of it; the logs remain only where it went wrong."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, stage.interrupt)
    directory = Path(tempfile.mkdtemp(prefix="rmf-demo-"))
    code = _judged(stage, act, problems, summary, directory)
    if code != 1:
        shutil.rmtree(directory)
    sys.stdout.flush()
    return code


def _judged(
    stage: Stage,
    act: Callable[[Path], None],
    problems: Callable[[Journal], Sequence[str]],
    summary: Callable[[Journal], str],
    directory: Path,
) -> int:
    try:
        act(directory)
    except Interrupted:
        sys.stdout.write("interrupted; every daemon has been stopped\n")
        return 130
    except TransportError as error:
        sys.stdout.write(f"the demo cannot start: {error}\n")
        shutil.rmtree(directory)
        return 1
    except Wrong as wrong:
        return _fail(stage, [str(wrong)])
    wrongs = problems(stage.journal)
    if wrongs:
        return _fail(stage, wrongs)
    sys.stdout.write(summary(stage.journal))
    return 0


def _fail(stage: Stage, wrongs: Sequence[str]) -> int:
    stage.journal.flush(time.monotonic())
    for daemon in stage.daemons.values():
        sys.stdout.write(f"\n--- the end of {daemon.log}\n{daemon.tail()}\n")
    sys.stdout.write("\n")
    for device in stage.daemons:
        state = stage.journal.latest(device)
        said = words.condition(state) if state else "nothing"
        sys.stdout.write(f"last said by {device}: {said}\n")
    sys.stdout.write("\nWRONG: " + "\n       ".join(wrongs) + "\n")
    return 1
