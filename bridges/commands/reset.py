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
    parser.add_argument(
        "--device",
        default="",
        metavar="NAME",
        help="only this device of the file, and not the fleets' alarm; default: all devices and the"
        " alarm",
    )
    parser.add_argument("--runtime-dir", metavar="DIR", help="the daemon's runtime directory")


def run(args: argparse.Namespace) -> int:
    """Return 0 if every device accepted the reset. Return 1 if no daemon runs, or if the file has no
    device of that name, and 4 if a device refused.

    Return 69 if the order cannot be written, if the daemon does not answer, or if this user may not see
    the daemon or send it a signal.
    """
    try:
        places = order.places_of(args.file, args.runtime_dir)
        if places is None:
            return 1
        status = order.status_of(places) or {}
        if status and not order.has_device(args.file, status, args.device):
            return 1
        code = order.give(args.file, places, reset=True, device=args.device)
        if code in (0, order.REFUSED):
            print(_remains(places, args.device) or "reset; no fault remains")
        return code
    except PermissionError as error:
        print(error, file=sys.stderr)
        return os.EX_UNAVAILABLE


def _remains(places: Directories, device: str) -> str:
    """Return a line for each fault that the reset has not ended; "" if there is none. `device`: the
    device that was reset, or "" for all."""
    status = order.status_of(places) or {}
    parts = [] if device else [("", status)]
    parts += [
        (f"{name}: ", one)
        for name, one in status.get("devices", {}).items()
        if device in ("", name)
    ]
    found = ((n, Fault(f["code"], f["detail"])) for n, d in parts for f in d.get("faults", ()))
    return "\n".join(printable(f"remains: {n}{fault}") for n, fault in found)
