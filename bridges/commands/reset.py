"""`rmf-bridge reset FILE` clears the daemon's latched faults whose cause is gone. An operator runs
it."""

import argparse
import os
import sys
from pathlib import Path

from bridges.kinds.shared.decision import Fault
from bridges.messages.words import printable
from bridges.runtime import order
from bridges.system.directories import Directories


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `reset`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the device YAML of the daemon")
    parser.add_argument("--runtime-dir", metavar="DIR", help="the daemon's runtime directory")


def run(args: argparse.Namespace) -> int:
    """Return 0 if every device accepted the reset. Return 1 if no daemon runs, and 4 if a device
    refused.

    Return 69 if the order cannot be written, if the daemon does not answer, or if this user may not see
    the daemon or send it a signal.
    """
    try:
        places = order.places_of(args.file, args.runtime_dir)
        if places is None:
            return 1
        code = order.give(args.file, places, reset=True)
        if code in (0, order.REFUSED):
            print(_remains(places) or "reset; no fault remains")
        return code
    except PermissionError as error:
        print(error, file=sys.stderr)
        return os.EX_UNAVAILABLE


def _remains(places: Directories) -> str:
    """Return a line for each fault that the reset has not ended; "" if there is none."""
    status = order.status_of(places) or {}
    parts = [("", status), *((f"{n}: ", d) for n, d in status.get("devices", {}).items())]
    found = ((n, Fault(f["code"], f["detail"])) for n, d in parts for f in d.get("faults", ()))
    return "\n".join(printable(f"remains: {n}{fault}") for n, fault in found)
