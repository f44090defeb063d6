"""`rmf-bridge workcell done|again|failed FILE` lets a person decide the outcome of a request in doubt.
A request is in doubt if the daemon does not know whether the machine has moved the items."""

import argparse
import os
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from bridges.kinds.shared.decision import DecidedByPerson
from bridges.runtime import order

IN_DOUBT: Final = ("MEMORY_LOST", "OUTCOME_UNKNOWN")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `workcell`."""
    parser.add_argument(
        "verdict",
        choices=("done", "again", "failed"),
        help="done: the items were moved, and RMF sends the robot on; again: nothing was moved, and the"
        " cycle runs again; failed: RMF ends the robot's task",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="the device YAML of the daemon")
    parser.add_argument("--device", default="", metavar="NAME", help="one device of the file")
    parser.add_argument(
        "--request",
        default="",
        metavar="GUID",
        help="decide only this request; default: every request in doubt, and the loss of the memory",
    )
    parser.add_argument("--runtime-dir", metavar="DIR", help="the daemon's runtime directory")


def run(args: argparse.Namespace) -> int:
    """Return 0 if the daemon accepted the decision. Return 1 if no daemon runs, nothing is in doubt, or
    the file has no device of that name. Return 4 if the daemon refused the decision.

    Return 69 if the order cannot be written, if the daemon does not answer, or if this user may not see
    the daemon or send it a signal.
    """
    try:
        places = order.places_of(args.file, args.runtime_dir)
        if places is None:
            return 1
        status = order.status_of(places)
        if status is None:
            print(f"no daemon of {args.file} has written its status yet", file=sys.stderr)
            return 1
        if not order.has_device(args.file, status, args.device):
            return 1
        doubts = list(_doubts(status, args.device))
        verdict = DecidedByPerson(args.verdict, args.request)
        given = {"verdict": verdict, "device": args.device}
        if doubts and (code := order.give(args.file, places, **given)):
            return code
    except PermissionError as error:
        print(error, file=sys.stderr)
        return os.EX_UNAVAILABLE
    if not doubts:
        print(f"no request of {args.device or args.file} is in doubt", file=sys.stderr)
        return 1
    print(*doubts, sep="\n")
    print(f"decided: {args.verdict}; rmf-bridge status shows the effect")
    return 0


def _doubts(status: Mapping[str, Any], device: str) -> Iterator[str]:
    """Yield the requests in doubt that the status lists. `device` is a device's name, or "" for every
    device."""
    found: dict[str, Any] = status.get("devices", {})
    for name, state in found.items():
        for fault in state.get("faults", []):
            if device in ("", name) and fault["code"] in IN_DOUBT:
                yield f"{name}: {fault['code']}: {fault['detail']}"
