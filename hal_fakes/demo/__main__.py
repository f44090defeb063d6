"""`python -m hal_fakes.demo`: exit code 0 when the robot's day went right, 1 with the reason, 130
after Ctrl-C. Nothing is left running, whichever way it ends."""

import argparse
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from types import FrameType

from bridges.fields import Rmf
from bridges.rmf import words
from bridges.rmf.choose import open_transport
from bridges.rmf.transport import TransportError
from hal_fakes.demo import day, verdict
from hal_fakes.demo.daemons import Daemon, Wrong, stop_all
from hal_fakes.demo.journal import Journal
from hal_fakes.demo.world import World
from hal_fakes.domain import free_domain
from hal_fakes.rmf.robot import Robot

CONFIG = Path(__file__).parents[2] / "config"
FILES = {
    day.LIFT: CONFIG / "lift_dry_contact.yaml",
    day.DOOR: CONFIG / "door_modbus.yaml",
    day.CHARGER: CONFIG / "charger_http.yaml",
}
READY_WITHIN_S = 20.0


class Interrupted(Exception):
    """Ctrl-C, or another signal to end."""


class Demo:
    """The processes, and the way out."""

    def __init__(self, failures: Sequence[tuple[str, str, str]]) -> None:
        self._failures = failures
        self._interrupted = False
        self.daemons: dict[str, Daemon] = {}
        self.journal = Journal(time.monotonic(), sys.stdout.write, colour=sys.stdout.isatty())

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

    def run(self, directory: Path) -> None:
        """Start everybody and live the day. Raises Wrong, Interrupted or TransportError."""
        domain = free_domain()
        self._note(f"three daemons on fake hardware, DDS domain {domain}, loopback only")
        rmf = Rmf(transport="dds", domain_id=domain, network="localhost")
        robot = Robot(f"{day.FLEET}/{day.ROBOT}")
        transport = open_transport(rmf, "rmf_demo", localhost=True)
        with ExitStack() as stack:
            stack.callback(transport.close)
            stack.callback(self._stop)
            for device, file in FILES.items():
                self.check()
                self.daemons[device] = Daemon(file, directory, domain)
            world = World(transport, self.journal, robot, self.check)
            self._get_ready(world)
            day.live(world, self._press)
            self.journal.flush(time.monotonic())

    def _get_ready(self, world: World) -> None:
        for daemon in self.daemons.values():
            daemon.follow(world.edge)
        standing = f"{day.LIFT} at {day.FROM}, {day.DOOR} closed and {day.CHARGER} idle"
        world.until(lambda: day.dawns(world), READY_WITHIN_S, f"every daemon up: {standing}")
        self.journal.begin_day()
        self._note(standing)
        for device, part, mode in self._failures:
            self._note(f"{device}: {part} fails, {mode}")
            self.daemons[device].order(f"fail {device} {part} {mode}")

    def _press(self, device: str, signal_name: str, on: bool) -> None:
        self.daemons[device].order(f"press {device} {signal_name} {'on' if on else 'off'}")

    def _stop(self) -> None:
        stop_all(self.daemons.values())

    def _note(self, text: str) -> None:
        self.journal.note("demo", text, time.monotonic())


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo."""
    parser = argparse.ArgumentParser(prog="python -m hal_fakes.demo", description=__doc__)
    parser.add_argument(
        "--fail",
        nargs=3,
        action="append",
        default=[],
        metavar=("DEVICE", "PART", "MODE"),
        help="let a part fail first: off, stuck, slow, garbage or wrong; the demo then exits 1",
    )
    failures = parser.parse_args(argv).fail
    for device, _, _ in failures:
        if device not in FILES:
            parser.error(f"no device {device!r}; there are {', '.join(FILES)}")
    demo = Demo(failures)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, demo.interrupt)
    directory = Path(tempfile.mkdtemp(prefix="rmf-demo-"))
    code = _run(demo, directory)
    if code != 1:
        shutil.rmtree(directory)
    sys.stdout.flush()
    return code


def _run(demo: Demo, directory: Path) -> int:
    try:
        demo.run(directory)
    except Interrupted:
        sys.stdout.write("interrupted; every daemon has been stopped\n")
        return 130
    except TransportError as error:
        sys.stdout.write(f"the demo cannot start: {error}\n")
        shutil.rmtree(directory)
        return 1
    except Wrong as wrong:
        return _fail(demo, directory, [str(wrong)])
    wrongs = verdict.problems(demo.journal)
    if wrongs:
        return _fail(demo, directory, wrongs)
    sys.stdout.write(summary(demo.journal))
    return 0


def _fail(demo: Demo, directory: Path, wrongs: Sequence[str]) -> int:
    demo.journal.flush(time.monotonic())
    for daemon in demo.daemons.values():
        sys.stdout.write(f"\n--- the end of {daemon.log}\n{daemon.tail()}\n")
    sys.stdout.write("\n")
    for device in demo.daemons:
        state = demo.journal.latest(device)
        said = words.condition(state) if state else "nothing"
        sys.stdout.write(f"last said by {device}: {said}\n")
    sys.stdout.write("\nWRONG: " + "\n       ".join(wrongs) + "\n")
    return 1


def summary(journal: Journal) -> str:
    """What was done, in a few lines."""
    counts = ", ".join(f"{n} {what}" for what, n in sorted(journal.counts().items()))
    legs = ", ".join(f"{name} {seconds:.1f} s" for name, seconds in journal.legs.items())
    return (
        "\nRIGHT: the robot went through the door, rode from "
        f"{day.FROM} to {day.TO} and charged; every relay is off.\n"
        f"       {counts}\n       {legs}\n"
    )


if __name__ == "__main__":
    sys.exit(main())
