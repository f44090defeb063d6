"""Runs a demo: `python -m hal_fakes.demo [ride|charging|page]`.

A demo plays one day of robots and devices. The exit code is 0 after a day without errors. After an
error the exit code is 1, and the demo prints the reason. After Ctrl-C the exit code is 130. The demo
never leaves a process running.
"""

import argparse
import sys
from collections.abc import Sequence

from hal_fakes.demo import building, charging, ride
from hal_fakes.demo.demo_run import DemoRun

DEMOS = {"ride": ride.DEMO, "charging": charging.DEMO, "page": building.DEMO}


def main(argv: Sequence[str] | None = None) -> int:
    """Run a demo."""
    parser = argparse.ArgumentParser(prog="python -m hal_fakes.demo", description=__doc__)
    parser.add_argument("demo", nargs="?", choices=DEMOS, default="ride", help="default: ride")
    parser.add_argument(
        "--fail",
        nargs=3,
        action="append",
        default=[],
        metavar=("DEVICE", "PART", "MODE"),
        help="let a part fail before the demo begins (off, stuck, slow, garbage or wrong); the demo"
        " then exits with 1",
    )
    parser.add_argument(
        "--patience",
        type=float,
        default=1.0,
        metavar="N",
        help="wait N times as long for each step: for a slow or busy machine",
    )
    args = parser.parse_args(argv)
    demo = DEMOS[args.demo]
    for device, _, _ in args.fail:
        if device not in demo.files:
            parser.error(f"no device '{device}'; there are {', '.join(demo.files)}")
    return DemoRun(demo, args.fail, args.patience).play()


if __name__ == "__main__":
    sys.exit(main())
