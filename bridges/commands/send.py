"""`rmf-bridge send`: one request to a lift, door or charger, as RMF would send it, and its effect.

Exit code 0 when the effect was seen, 1 when not (with the reason), 2 for a wrong command line, 130
after Ctrl-C.
"""

import argparse
import sys
import time
from contextlib import closing
from dataclasses import replace
from typing import Any, TextIO
from uuid import uuid4

from bridges.commands.effects import Done, Failed, SoFar, Wish, described, step
from bridges.commands.graph import (
    Ears,
    Heard,
    add_graph_arguments,
    complain,
    interruptible,
    open_graph,
)
from bridges.commands.queueing import Queue, Withdrawal
from bridges.commands.wishes import Charge, ChargeCancel, DoorMove, LiftEnd, LiftRide
from bridges.rmf import definitions as d
from bridges.rmf import topics, words
from bridges.rmf.stamps import stamp
from bridges.rmf.transport import Publisher, Transport, TransportError

NODE_NAME = "rmf_bridge_send"
LOOK_EVERY_S = 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """`lift`, `door` and `charger`, each with the options of the graph."""
    kinds = parser.add_subparsers(dest="kind", required=True, metavar="lift|door|charger")
    _lift_arguments(kinds.add_parser("lift", help="ask for a lift, or end its session"))
    _door_arguments(kinds.add_parser("door", help="hold a door open, or let it close"))
    _charger_arguments(kinds.add_parser("charger", help="assign a charger, or cancel that"))


def _common(parser: argparse.ArgumentParser, *, direct: bool) -> None:
    add_graph_arguments(parser)
    parser.add_argument(
        "--timeout", type=_seconds, default=60.0, metavar="S", help="give up after S seconds (60)"
    )
    if direct:
        parser.add_argument(
            "--direct",
            action="store_true",
            help="speak to the node itself, not to RMF's supervisor",
        )
    parser.set_defaults(usage=parser.error)


def _seconds(text: str) -> float:
    seconds = float(text)
    if not 0 <= seconds <= 86400:
        raise argparse.ArgumentTypeError(f"{text} s: 0 to 86400")
    return seconds


def _lift_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("floor", metavar="FLOOR", nargs="?", help="as the LiftState names it")
    parser.add_argument("--session", default="", metavar="ID", help="fleet/robot, or any name")
    parser.add_argument(
        "--end",
        action="store_true",
        help="end the session (of whoever holds it, without --session)",
    )
    parser.add_argument(
        "--granted-only", action="store_true", help="wait for the session, not for the car"
    )
    _common(parser, direct=True)


def release_arguments(parser: argparse.ArgumentParser) -> None:
    """A lift's END and nothing else, for `rmf-bridge release`."""
    parser.add_argument("name", metavar="LIFT")
    parser.add_argument(
        "--session", default="", metavar="ID", help="only if this one holds it (whoever does)"
    )
    parser.set_defaults(kind="lift", end=True, floor=None, granted_only=False)
    _common(parser, direct=True)


def _door_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("action", choices=("open", "close"))
    parser.add_argument("--requester", default=NODE_NAME, metavar="ID", help=f"({NODE_NAME})")
    _common(parser, direct=True)


def _charger_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME")
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--robot", metavar="FLEET/ROBOT", help="assign the charger to this robot")
    what.add_argument("--cancel", metavar="REQUEST_ID", help="cancel the request of this id")
    parser.add_argument(
        "--queue",
        action="store_true",
        help="ask the charger coordinator, which may choose another charger; NAME may be `any`",
    )
    parser.add_argument("--request-id", metavar="ID", help="(a new one)")
    parser.add_argument(
        "--start-timeout",
        type=_seconds,
        default=0.0,
        metavar="S",
        help="cancelled when charging has not started after S seconds (the charger's own default)",
    )
    _common(parser, direct=False)


def wish_of(args: argparse.Namespace) -> Wish:
    """What the command line asks for. A contradiction in it ends in exit code 2."""
    match args.kind:
        case "lift":
            return _lift_wish(args)
        case "door":
            return DoorMove(args.name, args.action == "open", args.requester, direct=args.direct)
        case _:
            return _charger_wish(args)


def _lift_wish(args: argparse.Namespace) -> Wish:
    if args.end == (args.floor is not None):
        args.usage("either a FLOOR, or --end")
    if args.end:
        if args.granted_only:
            args.usage("--granted-only goes with a FLOOR")
        return LiftEnd(args.name, args.session, direct=args.direct)
    if not args.session:
        args.usage("a lift is asked for in somebody's name: --session fleet/robot")
    return LiftRide(
        args.name, args.floor, args.session, direct=args.direct, granted_only=args.granted_only
    )


def _charger_wish(args: argparse.Namespace) -> Wish:
    if args.cancel is not None:
        return Withdrawal(args.cancel) if args.queue else ChargeCancel(args.name, args.cancel)
    fleet, slash, robot = args.robot.partition("/")
    if not (fleet and slash and robot):
        args.usage(f"--robot {args.robot!r}: say FLEET/ROBOT")
    request_id = args.request_id or f"{NODE_NAME}-{uuid4().hex[:8]}"
    wish = Queue if args.queue else Charge
    return wish(args.name, fleet, robot, request_id, args.start_timeout)


def run(args: argparse.Namespace) -> int:
    """Send and wait."""
    wish = wish_of(args)
    try:
        with interruptible(), closing(open_graph(args, NODE_NAME)) as transport:
            return send(transport, wish, args.timeout, sys.stdout)
    except TransportError as error:
        complain("send", error)
        return 1
    except KeyboardInterrupt:
        complain("send", "interrupted; the last request stands")
        return 130


def send(transport: Transport, wish: Wish, timeout_s: float, out: TextIO) -> int:
    """0 when the effect was seen within `timeout_s`, else 1."""
    errand = _Errand(transport, wish, timeout_s, out)
    while True:
        code = errand.look()
        if code is not None:
            return code


class _Errand:
    """The clock, the wire and the screen around `effects.step`."""

    def __init__(self, transport: Transport, wish: Wish, timeout_s: float, out: TextIO) -> None:
        self.wish, self.out = wish, out
        self.publisher: Publisher[Any] = transport.publisher(wish.topic)
        self.ears = Ears(transport, wish.states, topics.DOOR_SUPERVISOR_HEARTBEAT)
        self.so_far = SoFar(began_at=time.monotonic(), timeout_s=timeout_s)
        self.said: set[str] = set()
        self.described = ""

    def look(self) -> int | None:
        """Take what was heard, and do what follows from it; an exit code when it is over."""
        for heard in self.ears.listen(LOOK_EVERY_S):
            self._take(heard)
        now = time.monotonic()
        self.so_far = replace(self.so_far, listeners=self.publisher.matched())
        todo = step(self.wish, self.so_far, now)
        if todo.outcome is not None:
            return self._finish(todo.outcome)
        if todo.hint and todo.hint not in self.said:
            self.said.add(todo.hint)
            complain("send", todo.hint)
        if todo.send is not None:
            self._send(todo.send, now)
        return None

    def _take(self, heard: Heard) -> None:
        if isinstance(heard.message, d.SupervisorHeartbeat):
            self.so_far = replace(self.so_far, heartbeat=heard)
            return
        name = words.device(heard.message)
        self.so_far = replace(self.so_far, names=self.so_far.names | {name})
        if not self.wish.about(heard.message):
            return
        self.so_far = replace(self.so_far, states=(*self.so_far.states, heard))
        text = described(heard.message)
        if text != self.described:
            self.described = text
            self._line(heard.at, "state", text)

    def _send(self, request: words.Requested, now: float) -> None:
        if not isinstance(request, d.ChargerRequest | d.ChargerCancel):
            request = replace(request, request_time=stamp(time.time()))
        if self.so_far.first_sent_at is None:
            self._line(now, "request", f"{words.request(request)} on {self.wish.topic.name}")
        first = now if self.so_far.first_sent_at is None else self.so_far.first_sent_at
        self.so_far = replace(self.so_far, first_sent_at=first, last_sent_at=now)
        self.publisher.publish(request)

    def _finish(self, outcome: Done | Failed) -> int:
        if isinstance(outcome, Done):
            self._line(time.monotonic(), "done", outcome.text)
            return 0
        complain("send", outcome.text)
        return 1

    def _line(self, at: float, what: str, text: str) -> None:
        elapsed_s = max(0.0, at - self.so_far.began_at)
        name = words.printable(self.wish.name)
        self.out.write(f"{elapsed_s:8.3f} s  {what:<7}  {name}  {text}\n")
        self.out.flush()
