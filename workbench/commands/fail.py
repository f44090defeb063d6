"""`rmf-bridge fail FILE PART MODE`: make a wire or a part of a simulated device fail."""

import argparse

from bridges.runtime.completers import completed_by
from workbench.graph.plants import MODES, add_simulation, names, obey, tell


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `fail`."""
    add_simulation(parser)
    part = parser.add_argument(
        "part",
        metavar="PART",
        nargs="?",
        help="a signal of the file, or a part such as car; without PART: list signals and parts",
    )
    completed_by(part, names("fail"))
    parser.add_argument(
        "mode", nargs="?", choices=MODES, help="the way in which the part fails; ok mends the part"
    )


def run(args: argparse.Namespace) -> int:
    """Return the exit code.

    - 0: the part now fails.
    - 1: the part cannot fail in this way.
    - 69: no simulation of the file runs.
    """
    if args.part is None:
        return tell(args, "fail")
    if args.mode is None:
        args.usage(f"give a MODE for {args.part}: {', '.join(MODES[:-1])}; or ok, which mends it")
    return obey(args, "fail", args.part, args.mode)
