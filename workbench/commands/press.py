"""`rmf-bridge press FILE SIGNAL`: press a button, or change another input, of a simulated device."""

import argparse

from bridges.runtime.completers import completed_by
from workbench.graph.plants import add_simulation, names, obey, tell


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `press`."""
    add_simulation(parser)
    signal = parser.add_argument(
        "signal", metavar="SIGNAL", nargs="?", help="without SIGNAL: list the signals"
    )
    completed_by(signal, names("press"))
    parser.add_argument("how", nargs="?", choices=("on", "off"), default="on", help="default: on")


def run(args: argparse.Namespace) -> int:
    """Return the exit code.

    - 0: the input has changed.
    - 1: the file has no such signal.
    - 69: no simulation of the file runs.
    """
    if args.signal is None:
        return tell(args, "press")
    return obey(args, "press", args.signal, args.how)
