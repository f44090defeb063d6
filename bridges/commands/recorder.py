"""`rmf-bridge recorder` reads the rings of this machine's daemons and writes recordings to files.

A ring is a file in memory that holds a daemon's last minutes.
"""

import argparse
import os
import sys
from contextlib import suppress
from datetime import date
from pathlib import Path

from bridges.blackbox import days
from bridges.blackbox.incident import INSTALL
from bridges.blackbox.recorder import Recorder
from bridges.blackbox.recordings import Recordings
from bridges.runtime import signals
from bridges.runtime.notify import notify
from bridges.system import directories, log
from bridges.system.columns import aligned
from bridges.system.machine_time import machine_s

EVERY_S = 1.0
SERVICE = Path("/var/lib/rmf-bridge-recorder")
"""The folder in which `rmf-bridge-recorder.service` keeps its files."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `recorder`."""
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="DIR",
        help="default: the unit's state directory, else a folder in the user's state directory",
    )
    parser.add_argument(
        "--days",
        type=int,
        nargs="?",
        const=1,
        metavar="N",
        help="print the rides, waits and availability of the last N days (default 1), and exit",
    )
    parser.add_argument("--csv", action="store_true", help="print every day as CSV, and exit")


def run(args: argparse.Namespace) -> int:
    """Return 0 after SIGTERM or SIGINT, 69 if the library for recordings is missing, and 77 if this
    user may not read the service's counts."""
    if args.csv or args.days is not None:
        return _tell_days(args)
    log.start()
    try:
        from bridges.blackbox import mcap_write  # noqa: F401 - fails now, not at an incident
    except ImportError as error:
        print(f"the recorder needs {error.name}: {INSTALL}", file=sys.stderr)
        return os.EX_UNAVAILABLE
    end = signals.End()
    recordings = Recordings(args.output or _folder())
    recordings.tidy()
    recorder = Recorder(directories.runtimes, recordings, machine_s)
    recorder.look()
    _notify("READY=1")
    while not end.wait(EVERY_S):
        recorder.look()
        _notify("WATCHDOG=1")
    _notify("STOPPING=1")
    recorder.close()
    return 0


def _tell_days(args: argparse.Namespace) -> int:
    folder = args.output or (SERVICE if SERVICE.exists() else _folder())
    if folder == SERVICE and not os.access(SERVICE, os.R_OK | os.X_OK):
        print(
            f"{SERVICE} is not readable for this user: repeat the command with sudo",
            file=sys.stderr,
        )
        return os.EX_NOPERM
    found = days.read(folder)
    if args.csv:
        print(days.as_csv(found), end="")
        return 0
    told = [days.HEADINGS, *(row.cells for row in days.rows(found, date.today(), args.days))]
    print("\n".join(aligned(told)) if len(told) > 1 else "nothing was counted in this time")
    return 0


def _folder() -> Path:
    """Return the folder of recordings. Under systemd this is the unit's state directory. Without
    systemd it is a folder in the user's state directory."""
    given = os.environ.get("STATE_DIRECTORY", "").split(":")[0]
    return Path(given) if given else directories.state_base() / "recordings"


def _notify(state: str) -> None:
    with suppress(OSError):
        notify(state)
