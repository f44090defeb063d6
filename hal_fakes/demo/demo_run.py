"""Runs a demo: starts the daemons, plays the day of the demo, checks this day, and leaves no process
running.

The exit code is 0 after a day without errors. After an error the exit code is 1, and the demo prints
the reason. After Ctrl-C the exit code is 130.
"""

import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Final

from bridges.messages import words
from bridges.messages.topics import AnyTopic
from bridges.settings.load import load
from bridges.system.columns import columns_of, hanging
from bridges.transports.transport import Transport, TransportError
from hal_fakes.demo.daemons import DaemonProcess, DemoFailed, PageProcess, stop_all
from hal_fakes.demo.journal import Journal
from hal_fakes.demo.world import PUBLISHED, World
from hal_fakes.domain import free_domain
from hal_fakes.wire import join, wire

READY_WITHIN_S: Final = 20.0
Failure = tuple[str, str, str]
"""A device, a part of its plant, and the failure mode."""


class Interrupted(Exception):
    """The end of a demo by Ctrl-C or another signal."""


@dataclass(frozen=True, slots=True)
class Demo:
    """One demo, which plays one day of robots and devices.

    - `files` holds each daemon's YAML, by the device's name.
    - `dawn` describes in words the state of all devices before the day begins. `dawns` checks this
      state.
    - `live` plays the day. It raises DemoFailed when an awaited event is late.
    - `problems` returns the errors of the day. It reads only the journal of events.
    - `right` is a sentence that sums up a day without errors.
    - `outcomes` has the result of each part of the day, if the summary lists the parts.
    - `page_password` is the password of the page's user `demo`. Without a password the demo serves no
      page.
    - `publishes` are the topics that RMF's side publishes. If real supervisors run, it leaves out the
      topics of these supervisors.
    """

    files: dict[str, Path]
    dawn: str
    dawns: Callable[[World], bool]
    live: Callable[[World], None]
    problems: Callable[[Journal], Sequence[str]]
    right: str
    outcomes: Mapping[str, str] = field(default_factory=dict)
    page_password: str = ""
    publishes: Sequence[AnyTopic] = PUBLISHED


class DemoRun:
    """One run of a demo. The demo sets `failures` after all devices are ready, and before the first
    step of the day.

    `patience` is a factor on the time limit of every step.
    """

    def __init__(self, demo: Demo, failures: Sequence[Failure] = (), patience: float = 1.0) -> None:
        self.demo = demo
        self.failures = failures
        self._patience = patience
        self.daemons: dict[str, DaemonProcess] = {}
        self.journal = Journal(
            time.monotonic(), sys.stdout.write, colour=sys.stdout.isatty(), columns=_columns
        )
        self.page: PageProcess | None = None
        self._page_says = ""
        self._interrupted = False

    def play(self) -> int:
        """Play the demo and return its exit code. Keep the daemons' logs only after an error."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, self._interrupt)
        directory = Path(tempfile.mkdtemp(prefix="rmf-demo-"))
        code, keep_logs = self._played(directory)
        if not keep_logs:
            shutil.rmtree(directory)
        sys.stdout.flush()
        return code

    def _played(self, directory: Path) -> tuple[int, bool]:
        try:
            with self._up(directory) as transport:
                self._live(transport)
        except Interrupted:
            sys.stdout.write("interrupted; every daemon has been stopped\n")
            return 130, False
        except TransportError as error:
            sys.stdout.write(f"the demo cannot start: {error}\n")
            return 1, False
        except DemoFailed as wrong:
            self._fail([str(wrong)])
            return 1, True
        if problems := self.demo.problems(self.journal):
            self._fail(problems)
            return 1, True
        _write(summary(self.demo, self.journal))
        return 0, False

    def _live(self, transport: Transport) -> None:
        world = World(
            transport,
            self.daemons,
            self.journal,
            self._check,
            self._patience,
            publishes=self.demo.publishes,
        )
        for device, file in self.demo.files.items():
            if load(file).buses:
                self.daemons[device].follow(world.edge)
        world.until(
            lambda: self.demo.dawns(world), READY_WITHIN_S, f"the morning: {self.demo.dawn}"
        )
        self.journal.begin_day()
        world.note(self.demo.dawn)
        for device, part, mode in self.failures:
            world.note(f"{part} of {device} fails: {mode}")
            self.daemons[device].order(f"fail {device} {part} {mode}")
        world.page = self._page_says
        self.demo.live(world)

    @contextmanager
    def _up(self, directory: Path) -> Iterator[Transport]:
        """Start every daemon on a ROS domain of its own and on loopback. Yield RMF's side of the same
        graph."""
        domain = free_domain()
        count = len(self.demo.files)
        begun = f"{count} daemons on fake hardware, {wire()}, domain {domain}, loopback only"
        self.journal.note("demo", begun, time.monotonic())
        transport = join("rmf_demo", domain)
        try:
            for device, file in self.demo.files.items():
                self._check()
                self.daemons[device] = DaemonProcess(file, directory, domain)
            if self.demo.page_password:
                self.page = PageProcess(directory, domain, self.demo.page_password)
                self._page_says = self.page.address()
                self.journal.note("demo", self._page_says, time.monotonic())
            yield transport
            self.journal.flush(time.monotonic())
        finally:
            stop_all([*self.daemons.values(), *([self.page] if self.page else [])])
            transport.close()

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        """Record the signal, and do nothing else. The present step ends first, so no process is left
        behind."""
        self._interrupted = True

    def _check(self) -> None:
        """Raise Interrupted after a signal, or DemoFailed if a daemon has died."""
        sys.stdout.flush()
        if self._interrupted:
            raise Interrupted
        for daemon in self.daemons.values():
            daemon.check()

    def _fail(self, problems: Sequence[str]) -> None:
        self.journal.flush(time.monotonic())
        for daemon in self.daemons.values():
            sys.stdout.write(f"\n--- the end of {daemon.log}\n{daemon.tail()}\n")
        sys.stdout.write("\n")
        for device in self.daemons:
            state = self.journal.latest(device)
            if state is not None:
                _write(f"last state of {device}: {words.described(state)}\n")
        _write("\nWRONG: " + "\n       ".join(problems) + "\n")


def _columns() -> int:
    """Return the terminal's width in characters. Return 0 for a pipe or file."""
    return columns_of(sys.stdout)


def _write(text: str) -> None:
    """Write lines that fit into the terminal."""
    columns = _columns()
    for line in text.splitlines():
        start = line[: len(line) - len(line.lstrip())]
        told = hanging(line.lstrip(), columns - len(start), 7 - len(start)) if columns else [line]
        sys.stdout.write("\n".join(f"{start}{one}" if columns else one for one in told) + "\n")


def summary(demo: Demo, journal: Journal) -> str:
    """Summarise the day in a few lines."""
    counts = ", ".join(f"{n} {what}" for what, n in sorted(journal.counts().items()))
    legs = ", ".join(f"{name} {seconds:.1f} s" for name, seconds in journal.legs.items())
    if demo.outcomes:
        legs = "\n       ".join(
            f"{name:<17} {seconds:5.1f} s  {demo.outcomes[name]}"
            for name, seconds in journal.legs.items()
        )
    return f"\nRIGHT: {demo.right}\n       {counts}\n       {legs}\n"
