"""`rmf-bridge log FILE` prints the log of a device's service from systemd's journal."""

import argparse
import os
import shutil
import sys
import time
from typing import NoReturn

from bridges.runtime.completers import completed_by, device_names, service_names
from bridges.runtime.daemons import daemons
from bridges.runtime.services import service_name, services, unit
from bridges.system.directories import runtimes
from bridges.system.log import pairs


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `log`."""
    file = parser.add_argument(
        "file", metavar="FILE", help="the device YAML, or its service's name"
    )
    completed_by(file, service_names)
    parser.add_argument("-f", "--follow", action="store_true", help="keep printing new lines")
    parser.add_argument("-n", "--lines", type=int, default=100, metavar="N", help="default: 100")
    parser.add_argument(
        "--since",
        metavar="TIME",
        help="print lines since this time, such as today, '1 hour ago', '09:30'",
    )
    device = parser.add_argument("--device", metavar="NAME", help="only lines about this device")
    completed_by(device, device_names)
    parser.add_argument("--event", metavar="WORD", help="only this event: state, fault, refused …")
    parser.add_argument("--json", action="store_true", help="print each line as the journal's JSON")


def run(args: argparse.Namespace) -> int:
    """Run journalctl in place of this process. Return 69 without a journal, or if the daemon does not
    log to the journal."""
    name = service_name(args.file)
    known = services()
    if name not in known and _runs_by_hand(name):
        print(
            f"{name} was started by hand: its log is on the terminal where it runs, or where"
            f" `rmf-bridge run {args.file} 2> LOG` sends it",
            file=sys.stderr,
        )
        return os.EX_UNAVAILABLE
    if shutil.which("journalctl") is None:
        print(
            "no journalctl here: a daemon without systemd logs to its own terminal", file=sys.stderr
        )
        return os.EX_UNAVAILABLE
    if name not in known:
        there = ", ".join(sorted(known)) or "none"
        print(
            f"{name} is not a service here (services: {there}); the journal's lines about {name}:",
            file=sys.stderr,
        )
    sys.stdout.flush()
    return _become(command(args))


def _runs_by_hand(name: str) -> bool:
    found = daemons(runtimes(), {}, time.time())
    return any(one.name == name and one.state in ("serving", "old") for one in found)


def _become(words: list[str]) -> NoReturn:
    """Replace this process by journalctl, which then receives all signals to this process."""
    os.execvp(words[0], words)


def command(args: argparse.Namespace) -> list[str]:
    """Return the journalctl command line."""
    words = ["journalctl", f"--unit={unit(service_name(args.file))}", f"--lines={args.lines}"]
    words += ["--output=json"] if args.json else ["--output=short-iso", "--no-hostname"]
    words += ["--follow"] if args.follow else []
    words += [f"--since={args.since}"] if args.since else []
    if pattern := _pattern(args.event, args.device):
        words += [f"--grep={pattern}", "--case-sensitive=yes"]
    return words


def _pattern(event: str | None, device: str | None) -> str:
    """Return a regular expression for the log lines of this event and this device. Our log lines have
    the form `event key=value …`."""
    parts = [f"^{_literal(event)}\\b"] if event else []
    if device:
        _, written = pairs("", device=device).split(" ", 1)
        parts += [f" {_literal(written)}( |$)"]
    return ".*".join(parts)


def _literal(text: str) -> str:
    return "".join(c if c.isalnum() or c in '_="' else f"\\{c}" for c in text)
