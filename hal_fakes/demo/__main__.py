"""`python -m hal_fakes.demo`: exit code 0 when the robot's day went right, 1 with the reason, 130
after Ctrl-C. Nothing is left running, whichever way it ends."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from hal_fakes.demo import day, verdict
from hal_fakes.demo.journal import Journal
from hal_fakes.demo.stage import Stage, play
from hal_fakes.demo.world import World
from hal_fakes.rmf.robot import Robot

CONFIG = Path(__file__).parents[2] / "config"
FILES = {
    day.LIFT: CONFIG / "lift_dry_contact.yaml",
    day.DOOR: CONFIG / "door_modbus.yaml",
    day.CHARGER: CONFIG / "charger_http.yaml",
}
READY_WITHIN_S = 20.0


def run(stage: Stage, failures: Sequence[tuple[str, str, str]], directory: Path) -> None:
    """Start everybody and live the day. Raises Wrong, Interrupted or TransportError."""
    robot = Robot(f"{day.FLEET}/{day.ROBOT}")
    with stage.up(directory) as transport:
        world = World(transport, stage.journal, robot, stage.check)
        for daemon in stage.daemons.values():
            daemon.follow(world.edge)
        standing = f"{day.LIFT} at {day.FROM}, {day.DOOR} closed and {day.CHARGER} idle"
        world.until(lambda: day.dawns(world), READY_WITHIN_S, f"every daemon up: {standing}")
        stage.journal.begin_day()
        stage.note(standing)
        for device, part, mode in failures:
            stage.note(f"{device}: {part} fails, {mode}")
            stage.order(device, f"fail {device} {part} {mode}")
        day.live(world, stage.press)


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
    stage = Stage(FILES)
    return play(stage, lambda at: run(stage, failures, at), verdict.problems, summary)


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
