"""`rmf-bridge explain`: say on one screen why a robot waits for a lift, a door or a charger.

The messages come from a recording or from the live graph. `workbench/explain/` makes the sentences.
"""

import argparse
import json
import shutil
import sys
import time
from contextlib import closing
from dataclasses import asdict, replace
from pathlib import Path
from typing import Final

from bridges.messages import topics
from bridges.messages.words import KINDS
from bridges.runtime import faults
from bridges.transports.transport import TransportError
from workbench.explain.explanation import Explained, Explanation
from workbench.explain.heard_devices import HeardDevices
from workbench.explain.phrases import TimePhrases
from workbench.explain.text import SCREEN_LINES, lines
from workbench.graph.board import SECONDS
from workbench.graph.join import (
    add_graph_arguments,
    command_line,
    complain,
    interruptible,
    open_graph,
    seconds,
)
from workbench.graph.live import OF_DEVICES, Ear
from workbench.replay.recordings import RecordingSpan, add_span_arguments, told_between, unreadable
from workbench.replay.sources import BagError

LISTENS_S: Final = 5.0
AGAIN_S: Final = 1.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `explain`."""
    parser.add_argument(
        "file",
        type=Path,
        nargs="?",
        metavar="FILE",
        help="a recording: MCAP (ours, or of `ros2 bag`), .db3, or a folder of `ros2 bag record`",
    )
    parser.add_argument(
        "device", nargs="?", metavar="DEVICE", help="the device's name; default: every device"
    )
    parser.add_argument(
        "--live",
        metavar="DEVICE",
        help="listen to the graph instead of a FILE; DEVICE may be a robot: FLEET/ROBOT",
    )
    parser.add_argument(
        "--for",
        dest="for_s",
        type=seconds(0.1, 86400),
        default=LISTENS_S,
        metavar="SECONDS",
        help=f"with --live: time (s) to listen (default {LISTENS_S:.0f})",
    )
    parser.add_argument(
        "--follow",
        action="store_true",
        help="with --live: print each change until Ctrl-C",
    )
    parser.add_argument(
        "--kind", choices=KINDS, help="the kind, if a lift and a door have the same name"
    )
    parser.add_argument("--session", default="", metavar="ID", help="the session to explain")
    parser.add_argument("--json", action="store_true", help="the explanation as JSON")
    add_span_arguments(parser)
    add_graph_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Return the exit code.

    - 0: the explanation was printed.
    - 1: no message of the device or of RMF was heard, or the program could not join the graph.
    - 66: FILE is no readable recording.
    """
    if (args.file is None) == (args.live is None):
        complain("explain", "name either a FILE or --live DEVICE")
        return 2
    try:
        return _live(args) if args.file is None else _recorded(args)
    except BagError as error:
        return unreadable("explain", error)
    except TransportError as error:
        complain("explain", error)
        return 1
    except KeyboardInterrupt:
        return 0


# ---- explain a recording


def _recorded(args: argparse.Namespace) -> int:
    wanted = "" if "/" in (args.device or "/") else args.device  # a robot: take every device
    site = HeardDevices(wanted, args.session)
    span = RecordingSpan(args.from_, args.to)
    for heard in told_between(args.file, span, "explain", wanted):
        site.take(heard)
    site.story_from(span.begins_at)
    if args.from_ or args.to:
        site.at_its_end()
    if not site.messages:
        complain(
            "explain", f"{args.file} has nothing about RMF's lifts, doors and chargers in that time"
        )
        return 1
    if args.device is None and len(devices := site.devices()) != 1:
        return _all(site, devices, as_json=args.json)
    return _one(site, args)


def _all(site: HeardDevices, devices: list[tuple[Explained, str]], *, as_json: bool) -> int:
    """Print a line for each device, or print all devices as JSON."""
    told = [site.explain(kind, name, None, faults.for_explain()) for kind, name in devices]
    if as_json:
        print(json.dumps([asdict(one) for one in told]))
        return 0
    if not told:
        sentences = site.because(TimePhrases(site.now, None).time)
        print(*sentences, "No state of a device and no report about a robot was heard.", sep="\n")
        return 0
    shared = [text for text in told[0].now if all(text in one.now for one in told)]
    for text in shared:
        print(text)
    for one in told:
        own = next((text for text in one.now if text not in shared), one.now[-1])
        print(f"{one.kind} {one.device}: {own}")
    print("\nFor more about a device, give its name after FILE.")
    return 0


def _one(site: HeardDevices, args: argparse.Namespace) -> int:
    """Print the explanation of the named device. Without a name, explain the only device."""
    name = args.device or args.live or site.devices()[0][1]
    kinds = site.kinds(name)
    if len(kinds) > 1 and not args.kind:
        several = " and a ".join(kinds)
        complain("explain", f"'{name}' is a {several}: choose with --kind")
        return 2
    found = _explained(site, args.kind, name)
    _tell(found, as_json=args.json)
    known = found.kind == "robot" or (found.kind, name) in site.devices() or site.reports(name)
    return 0 if known else 1


def _explained(site: HeardDevices, given: Explained | None, name: str) -> Explanation:
    """Explain the device. `given`: its kind, if the user has named it."""
    known = [given] if given else site.kinds(name)
    found = site.explain(known[0] if known else "lift", name, None, faults.for_explain())
    return found if known else replace(found, kind="device")


def _tell(found: Explanation, *, as_json: bool) -> None:
    if as_json:
        print(json.dumps(asdict(found)))
        return
    size = shutil.get_terminal_size((100, SCREEN_LINES + 1))
    for line in lines(found, None, size.columns, max(24, min(SCREEN_LINES, size.lines - 1))):
        print(line)
    sys.stdout.flush()


# ---- explain the live graph


def _live(args: argparse.Namespace) -> int:
    with interruptible(), closing(open_graph(args, "rmf_bridge_explain")) as transport:
        ear = Ear(transport, (*OF_DEVICES, topics.FLEET_STATES))
        past = Ear(transport, (topics.ADAPTER_LIFT_REQUESTS,))
        site = HeardDevices("", args.session, graph=command_line(args).options)
        if args.follow:
            _follow(ear, past, site, args)
        _listen(ear, past, site, args.for_s)
        return _one(site, args)


def _listen(ear: Ear, past: Ear, site: HeardDevices, for_s: float) -> None:
    """Listen for `for_s` (s). `past` also receives the retained requests, which fleet adapters sent
    before this program began."""
    until = time.monotonic() + for_s
    site.pass_time(time.monotonic(), time.time())
    while (left_s := until - time.monotonic()) > 0:
        for heard in ear.listen(left_s):
            site.take(heard)
    site.pass_time(time.monotonic(), time.time())
    for one in past.listen(0.0):
        site.retained(one)
    site.senders = {topic: end.senders() for topic, end in ear.ends.items()}


def _follow(ear: Ear, past: Ear, site: HeardDevices, args: argparse.Namespace) -> None:
    """Print an explanation each time it changes, until Ctrl-C."""
    told: object = None
    _listen(ear, past, site, args.for_s)
    while True:
        found = _explained(site, args.kind, args.live)
        news = [SECONDS.sub("", text) for text in found.now], found.next
        if news != told:
            _tell(found, as_json=args.json)
        told = news
        _listen(ear, past, site, AGAIN_S)
