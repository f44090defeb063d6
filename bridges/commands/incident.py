"""`rmf-bridge incident FILE` makes a recording of a daemon's last minutes when a person asks for it."""

import argparse
import os
import sys
import time
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from bridges.blackbox.incident import AFTER_S, BEFORE_S, INSTALL, Incident, Note, of_end, part
from bridges.blackbox.ring import DIED, NAME, RingContent, RingError
from bridges.blackbox.triggers import OPERATOR, death
from bridges.runtime import holder
from bridges.runtime.runtime_directory import find
from bridges.settings.load import SettingsError
from bridges.system.directories import Directories
from bridges.system.installed import of_workbench
from bridges.system.machine_time import machine_s
from bridges.system.written import no_folder, not_written


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `incident`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the device YAML of the daemon")
    parser.add_argument("--note", default="", metavar="TEXT", help="what you saw")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="MCAP", help="default: NAME_TIME.mcap, in this folder"
    )
    parser.add_argument(
        "--after",
        type=float,
        default=AFTER_S,
        metavar="S",
        help=f"how long to wait for later events, which are recorded too (default: {AFTER_S:g} s)",
    )
    parser.add_argument(
        "--died",
        action="store_true",
        help="record the previous run, which did not shut down cleanly",
    )
    parser.add_argument("--anonymous", action="store_true", help="leave out the site's names")
    parser.add_argument("--runtime-dir", metavar="DIR", help="the daemon's runtime directory")


def run(args: argparse.Namespace) -> int:
    """Return 0 if the recording is written.

    Return 65 if the recording's YAML cannot be made anonymous. Return 69 if the ring (the file with the
    daemon's last minutes) cannot be read. Return 73 if the recording cannot be written. Raises
    NotInstalled if `--anonymous` needs the workbench, which is not installed.
    """
    try:
        from bridges.blackbox import mcap_write
    except ImportError as error:
        print(f"to write a recording, {error.name} is needed: {INSTALL}", file=sys.stderr)
        return os.EX_UNAVAILABLE
    if args.anonymous:
        of_workbench("workbench.replay.anonymous")  # a missing workbench must fail before the wait
    name = "anonymous" if args.anonymous else args.file.stem
    path = args.output or Path(f"{name}_{datetime.now():%Y-%m-%d_%H-%M-%S}.mcap")
    if why := no_folder(path):
        return not_written(path, why)
    try:
        places = find(args.file.absolute(), args.runtime_dir)
        incident = _incident(places, args)
    except (PermissionError, RingError) as error:
        print(f"{error}. {_hint(died=args.died)}", file=sys.stderr)
        return os.EX_UNAVAILABLE
    try:
        if args.anonymous:
            incident = _anonymous(incident)
        mcap_write.write(path, incident)
    except SettingsError as error:
        print(
            f"the recording's YAML cannot be made anonymous: {error.problems[0]}", file=sys.stderr
        )
        return os.EX_DATAERR
    except OSError as error:
        return not_written(path, error.strerror)
    print(f"{path}: {len(incident.entries)} entries")
    return 0


def _anonymous(incident: Incident) -> Incident:
    """Return the incident without the names of the site. Raises SettingsError."""
    hidden: Incident = of_workbench("workbench.replay.anonymous").anonymous(incident)
    return hidden


def _hint(*, died: bool) -> str:
    if died:
        return "--died records the run before the last run; without --died the last run is recorded"
    return "Does the daemon run, and does the YAML keep a ring?"


def _incident(places: Directories, args: argparse.Namespace) -> Incident:
    """Return the last 120 s of the daemon. If the daemon runs, wait, and add the later events. Raises
    PermissionError and RingError."""
    died, ring = places.runtime / DIED, places.runtime / NAME
    if args.died:
        return _over(RingContent(died), args.note)
    before, at = RingContent(ring), machine_s()
    _tell_of_death(died)
    if not _serves(places):
        print(f"no daemon serves {args.file} now, so no later events will come")
        return _over(before, args.note)
    _wait(args.after)
    after = _of_run(before, ring)
    if after is None:
        dead = _of_run(before, died)
    else:
        dead = None if _serves(places) else after
    if dead is not None:
        return _over(dead, args.note)
    note, entries = Note(at, OPERATOR, args.note), list((after or before).entries())
    return Incident(before.head, part(entries, at - BEFORE_S, at + AFTER_S), (note,))


def _serves(places: Directories) -> bool:
    found = holder.look(places)
    return found is not None and found.serves


def _of_run(before: RingContent, ring: Path) -> RingContent | None:
    """Return the present content of this file if it is the ring of the same run."""
    with suppress(RingError):
        found = RingContent(ring)
        if found.head.run == before.head.run:
            return found
    return None


def _over(ring: RingContent, text: str) -> Incident:
    """Return the last 120 s of a run that is over. If the run died, its death is the first reason."""
    entries = list(ring.entries())
    died = None if ring.ended else death(entries)
    note = Note(entries[-1].at if entries else 0.0, OPERATOR, text)
    notes = (note,) if died is None else (died, note) if text else (died,)
    return of_end(ring.head, entries, notes)


def _tell_of_death(ring: Path) -> None:
    """Say that an earlier run died, because the present run's ring does not show that run."""
    with suppress(OSError):
        ended = datetime.fromtimestamp(ring.stat().st_mtime)
        print(
            f"an earlier run did not shut down cleanly (it ended at {ended:%Y-%m-%d %H:%M:%S});"
            " --died records its last minutes"
        )


def _wait(seconds: float) -> None:
    """Wait. Ctrl-C ends only the wait: the command then writes the recording."""
    try:
        if seconds > 0:
            print(f"waiting {seconds:g} s for later events; Ctrl-C ends the wait")
            time.sleep(seconds)
    except KeyboardInterrupt:
        print()
