"""`rmf-bridge replay FILE`: compute a recording's decisions again with the installed version of the
program."""

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import asdict
from datetime import datetime
from itertools import islice
from pathlib import Path
from typing import Final

from bridges.blackbox.entries import Head
from bridges.blackbox.value_codec import Tree, UnknownValue, value
from bridges.settings.load import SettingsError, load
from bridges.system.log import plain
from workbench.replay.files import opened
from workbench.replay.recordings import unreadable
from workbench.replay.replayed import Course, Difference, Replay, ReplayedCores, of_head
from workbench.replay.sources import BagError, Notes, NotReplayable

EX_DATAERR, EX_CONFIG = 65, 78
MOST: Final = 200
"""Maximum number of differences that `replay` prints."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `replay`."""
    parser.add_argument(
        "file",
        type=Path,
        metavar="FILE",
        help="a recording of a daemon, or the daemon's ring (the file of its latest events)",
    )
    parser.add_argument(
        "--config", type=Path, metavar="YAML", help="show what this YAML would have changed"
    )
    parser.add_argument("--json", action="store_true", help="the result as JSON")


def run(args: argparse.Namespace) -> int:
    """Return the exit code.

    - 0: every decision is the same.
    - 1: a decision differs.
    - 65: FILE has nothing to replay.
    - 66: FILE is no readable recording.
    - 78: a YAML has an error.
    """
    notes = Notes()
    try:
        head, entries = opened(args.file, notes)
        config = load(args.config) if args.config else of_head(head)
        if config.kind != head.kind:
            raise NotReplayable(
                f"{args.config} describes a {config.kind}, {args.file} records a {head.kind}"
            )
        replay = Replay(entries, ReplayedCores(config))
        found = replay.changes() if args.config else replay.differences()
        differences = list(islice(found, MOST))
        course = replay.course
        if args.config and not course.subjects and course.others:
            there = ", ".join(sorted(config.devices))
            recorded = ", ".join(sorted(course.others))
            raise NotReplayable(f"{args.config} describes {there}, {args.file} records {recorded}")
    except SettingsError as error:
        for problem in error.problems:
            print(problem, file=sys.stderr)
        return EX_CONFIG
    except (NotReplayable, UnknownValue) as error:
        print(error, file=sys.stderr)
        return EX_DATAERR
    except BagError as error:
        return unreadable("replay", error)
    return _told(args, head, course, differences, notes)


def _told(
    args: argparse.Namespace,
    head: Head,
    course: Course,
    differences: list[Difference],
    notes: Notes,
) -> int:
    if args.json:
        print(json.dumps(_as_json(head, course, differences, notes)))
    else:
        for line in _lines(args, head, course, differences) if course.decisions else ():
            print(line)
        if notes.damage:
            print(notes.damage, file=sys.stderr)
    if not course.decisions:
        print(f"{args.file} has no decision that can be replayed", file=sys.stderr)
        return EX_DATAERR
    return 1 if differences else 0


def _as_json(
    head: Head, course: Course, differences: list[Difference], notes: Notes
) -> dict[str, object]:
    return {
        "file": head.file,
        "version": head.version,
        "subjects": sorted(course.subjects),
        "from": course.began,
        "to": course.ended,
        "decisions": course.decisions,
        "not_replayed": course.unusable,
        "damage": notes.damage,
        "differences": [asdict(one) for one in differences],
    }


def _lines(
    args: argparse.Namespace, head: Head, course: Course, differences: list[Difference]
) -> Iterator[str]:
    names = ", ".join(sorted(course.subjects)) or "nobody"
    yield (
        f"{course.decisions} decisions of {names}, {_day(course.began)} to {_time(course.ended)},"
        f" recorded by version {head.version}"
    )
    if course.unusable:
        yield (
            f"{course.unusable} entries are left out, because the recording lacks the daemon's"
            " memory for them"
        )
    if args.config:
        yield from _changes(differences)
    else:
        for one in differences:
            yield from _difference(one)
    if len(differences) == MOST:
        yield f"… only the first {MOST} are shown"
    if not differences:
        same = (
            f"{args.config} would have changed no decision"
            if args.config
            else "every decision is as recorded"
        )
        yield same


def _changes(differences: list[Difference]) -> Iterator[str]:
    """Yield a line for each change. The line tells when the change began and ended, and how often the
    change came."""
    times: dict[str, list[str]] = {}
    lasts: dict[tuple[str, str], list[str]] = {}
    for one in differences:
        if before := lasts.pop((one.subject, one.what), None):
            before[-1] += f" to {_time(one.wall)}"
        if one.today is not None:
            today, recorded = _plain(one.today), _plain(one.recorded)
            text = f"{one.subject}: {_part(one)}: {today} (recorded: {recorded})"
            came = times.setdefault(text, [])
            came.append(_time(one.wall))
            if one.what != "refused":
                lasts[one.subject, one.what] = came
    for text, came in times.items():
        more = f"; {len(came)} times, the last {came[-1]}" if len(came) > 1 else ""
        yield f"{came[0]} {text}{more}"


def _difference(one: Difference) -> Iterator[str]:
    yield f"{one.subject} at {_time(one.wall)}: {_part(one)} differs"
    yield f"  recorded: {_plain(one.recorded)}"
    yield f"  today:    {_plain(one.today)}"
    yield "  after these events:"
    for at, words in one.before:
        yield f"    {_time(at)} {words}"


def _part(one: Difference) -> str:
    return "state" if one.what == "news" else one.what


def _plain(told: Tree) -> str:
    """Format one value of a decision for people. An empty text becomes `-`."""
    if isinstance(told, list):
        return ", ".join(map(_plain, told)) or "-"
    try:
        return plain(value(told)) or "-"
    except UnknownValue:
        return str(told)


def _day(wall: float) -> str:
    return datetime.fromtimestamp(wall).astimezone().isoformat(" ", "milliseconds")


def _time(wall: float) -> str:
    return datetime.fromtimestamp(wall).strftime("%H:%M:%S.%f")[:-3]
