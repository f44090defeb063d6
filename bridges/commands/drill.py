"""`rmf-bridge drill FILE`: make the robots stop for some time, as in an alarm, and then drive on."""

import argparse
import os
import sys
from pathlib import Path
from typing import Final

from bridges.runtime import order

LONGEST_S: Final = 86400.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `drill`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the device YAML of the daemon")
    how = parser.add_mutually_exclusive_group(required=True)
    how.add_argument(
        "--for", dest="for_s", type=float, metavar="S", help="the duration; the drill then ends"
    )
    how.add_argument("--end", action="store_true", help="end the drill now")
    parser.add_argument("--runtime-dir", metavar="DIR", help="the daemon's runtime directory")


def run(args: argparse.Namespace) -> int:
    """Return 0 if the drill has begun or ended. Return 1 if no daemon runs, and 4 if the daemon
    refused.

    Return 69 if the order cannot be written, if the daemon does not answer, or if this user may not see
    the daemon or send it a signal.
    """
    for_s = 0.0 if args.end else args.for_s
    if not args.end and not 1.0 <= for_s <= LONGEST_S:
        args.usage(f"--for {for_s:g}: a drill lasts from 1 to {LONGEST_S:g} s")
    try:
        places = order.places_of(args.file, args.runtime_dir)
        code = 1 if places is None else order.give(args.file, places, drill_s=for_s)
    except PermissionError as error:
        print(error, file=sys.stderr)
        return os.EX_UNAVAILABLE
    if code == 0:
        begun = f"the drill has begun, and ends by itself in {for_s:g} s; --end ends it earlier"
        print("no ordered drill goes on any more" if args.end else begun)
    return code
