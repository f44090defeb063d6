"""`rmf-bridge outputs-off FILE` switches every output off after a daemon's death, from a new process.

systemd runs this command as ExecStopPost. For a daemon that a person started by hand, the daemon's
guard process runs it.

A service that stops cleanly leaves a mark. The mark says that the daemon has switched all outputs off.
If the command finds this mark, it ends without loading a driver.
"""

import argparse
import os
import sys
from pathlib import Path

from bridges.runtime import last_mark


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `outputs-off`."""
    parser.add_argument("file", type=Path, nargs="?", metavar="FILE", help="the device YAML")
    parser.add_argument(
        "--all-records",
        action="store_true",
        help="switch off the outputs of every service that died or lost power and left a record;"
        " takes 6 s at most",
    )
    parser.add_argument("--runtime-dir", metavar="DIR", help="the dead daemon's runtime directory")
    parser.add_argument("--record", action="append", default=[], help=argparse.SUPPRESS)


def run(args: argparse.Namespace) -> int:
    """Return 0 if every output is verified off, 1 if an output is not off, and 69 if the daemon may
    still live."""
    if last_mark.says_off(os.environ):
        print('nothing_to_switch_off reason="the daemon verified it"', file=sys.stderr)
        return 0
    if args.all_records:
        from bridges.runtime.all_records import switch_off_all

        return switch_off_all()
    if args.file is None:
        args.usage("name a device YAML, or --all-records")
    from bridges.runtime.dead_daemon import switch_off

    return switch_off(args)
