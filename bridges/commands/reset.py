"""`rmf-bridge reset FILE` clears latched faults for an operator, if their cause is gone."""

import argparse
import os
import sys
from pathlib import Path

from bridges.runtime import order


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `reset`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the device YAML of the daemon")
    parser.add_argument("--runtime-dir", metavar="DIR", help="the daemon's runtime directory")


def run(args: argparse.Namespace) -> int:
    """Return 0 if the reset is sent, 1 if no daemon runs, and 69 if this user may not see or signal the
    daemon."""
    try:
        places = order.places_of(args.file, args.runtime_dir)
        if places is None:
            return 1
        code = order.send(args.file, places, None)
        if code == 0:
            print("reset sent; for remaining faults see rmf-bridge status, or the log")
        return code
    except PermissionError as error:
        print(error, file=sys.stderr)
        return os.EX_UNAVAILABLE
