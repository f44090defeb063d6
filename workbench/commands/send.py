"""`rmf-bridge send`: send one request to a device, as RMF would, and show the effect.

Exit codes:

- 0: the device showed the effect.
- 1: the device did not show the effect. The program has printed the reason.
- 2: the command line is wrong.
- 130: Ctrl-C ended the program.
"""

import argparse
import sys
import time
from contextlib import closing
from typing import TextIO
from uuid import uuid4

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics, words
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.transports.transport import Publisher, Transport, TransportError
from workbench.graph.exchange import step
from workbench.graph.join import (
    add_graph_arguments,
    command_line,
    complain,
    graph_of,
    interruptible,
    open_graph,
    seconds,
)
from workbench.graph.live import Ear
from workbench.graph.requests import Failed, Fulfilled, Request, RequestProgress
from workbench.graph.requests.charger import ChargeCancel, QueuedCancel, QueuedCharge, RobotCharge
from workbench.graph.requests.door import DoorMove
from workbench.graph.requests.lift import LiftEnd, LiftRide, aftermath
from workbench.graph.requests.workcell import Dispensing, Ingesting

NODE_NAME = "rmf_bridge_send"
LOOK_EVERY_S = 0.1
STATES = (
    topics.LIFT_STATES,
    topics.DOOR_STATES,
    topics.CHARGER_STATES,
    topics.DISPENSER_STATES,
    topics.INGESTOR_STATES,
)
"""State topics of all kinds. The program listens to all topics, because the given name may belong to a
device of another kind."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add a subcommand for each kind of device. Each subcommand also gets the options of the graph."""
    kinds = parser.add_subparsers(dest="kind", required=True, metavar="|".join(words.KINDS))
    for kind, (text, example, add) in {
        "lift": (
            "request a lift, or end a session",
            "Lift1 L3 --session fleet/robot",
            _lift_arguments,
        ),
        "door": ("hold a door open, or let it close", "ward_door open", _door_arguments),
        "charger": (
            "assign a charger, or cancel the assignment",
            "any --queue --robot fleet/robot",
            _charger_arguments,
        ),
        "dispenser": (
            "ask a dispenser for items, and wait for its result",
            "linen_store sheets --quantity 2 --compartment left",
            _workcell_arguments,
        ),
        "ingestor": (
            "ask an ingestor to take items, and wait for its result",
            "laundry_intake linen_bag",
            _workcell_arguments,
        ),
    }.items():
        example = f"example: rmf-bridge send {kind} {example}"
        add(kinds.add_parser(kind, help=text, epilog=example))


def add_shared_arguments(parser: argparse.ArgumentParser, *, direct: bool) -> None:
    """Add the options for the graph and the time. `direct` adds the option `--direct`, which bypasses
    RMF's supervisor."""
    add_graph_arguments(parser)
    parser.add_argument(
        "--timeout",
        type=seconds(0, 86400),
        default=60.0,
        metavar="S",
        help="give up after S seconds (default: 60)",
    )
    if direct:
        parser.add_argument(
            "--direct",
            action="store_true",
            help="ask the device's own daemon, not RMF's supervisor",
        )
    parser.set_defaults(usage=parser.error)


def _lift_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME", help="the lift, as RMF names it")
    parser.add_argument("floor", metavar="FLOOR", nargs="?", help="the floor's name in LiftState")
    parser.add_argument("--session", default="", metavar="ID", help="fleet/robot, or any name")
    parser.add_argument(
        "--end",
        action="store_true",
        help="end the session of --session (default: the holder's session)",
    )
    parser.add_argument(
        "--granted-only", action="store_true", help="wait for the session, not for the car"
    )
    add_shared_arguments(parser, direct=True)


def _door_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME", help="the door, as RMF names it")
    parser.add_argument("action", choices=("open", "close"))
    parser.add_argument(
        "--requester", default=NODE_NAME, metavar="ID", help=f"default: {NODE_NAME}"
    )
    add_shared_arguments(parser, direct=True)


def _charger_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME", help="the charger, as RMF names it")
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--robot", metavar="FLEET/ROBOT", help="assign the charger to this robot")
    what.add_argument("--cancel", metavar="REQUEST_ID", help="cancel the request of this id")
    parser.add_argument(
        "--queue",
        action="store_true",
        help="ask the charger coordinator, which may choose another charger; NAME may be `any`",
    )
    parser.add_argument("--request-id", metavar="ID", help="default: a new id")
    parser.add_argument(
        "--start-timeout",
        type=seconds(0, 86400),
        default=0.0,
        metavar="S",
        help="cancel if charging has not begun after S seconds (default: the charger's own limit)",
    )
    add_shared_arguments(parser, direct=False)


def _workcell_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME", help="the dispenser or ingestor, as RMF names it")
    parser.add_argument("item", metavar="ITEM", nargs="?", default="", help="the item's type_guid")
    parser.add_argument("--quantity", type=int, default=1, metavar="N", help="default: 1")
    parser.add_argument("--compartment", default="", metavar="NAME", help="default: none")
    parser.add_argument(
        "--request-id",
        metavar="GUID",
        help="the request's guid; an earlier guid repeats that request (default: a new guid)",
    )
    add_shared_arguments(parser, direct=False)


def request_of(args: argparse.Namespace) -> Request:
    """Return the request of the command line. Exit with code 2 if options contradict each other."""
    match args.kind:
        case "lift":
            return _lift_request(args)
        case "door":
            opened = args.action == "open"
            return DoorMove(
                args.name, opened, args.requester, direct=args.direct, line=command_line(args)
            )
        case "charger":
            return _charger_request(args)
        case _:
            guid = args.request_id or f"{NODE_NAME}-{uuid4().hex[:8]}"
            made = Dispensing if args.kind == "dispenser" else Ingesting
            what = args.item, args.quantity, args.compartment
            return made(args.name, guid, *what, line=command_line(args))


def _lift_request(args: argparse.Namespace) -> Request:
    if args.end == (args.floor is not None):
        args.usage("give either a FLOOR or --end")
    line = command_line(args)
    if args.end:
        if args.granted_only:
            args.usage("--granted-only needs a FLOOR")
        fall = getattr(args, "falls_back", False), getattr(args, "car_empty", False)
        return LiftEnd(args.name, args.session, *fall, direct=args.direct, line=line)
    if not args.session:
        args.usage("give the session's name: --session FLEET/ROBOT, or any name")
    return LiftRide(
        args.name, args.floor, args.session, args.granted_only, direct=args.direct, line=line
    )


def _charger_request(args: argparse.Namespace) -> Request:
    line = command_line(args)
    if args.cancel is not None:
        cancel = QueuedCancel if args.queue else ChargeCancel
        return cancel(args.name, args.cancel, line=line)
    fleet, slash, robot = args.robot.partition("/")
    if not (fleet and slash and robot):
        args.usage(f"--robot '{args.robot}' is not FLEET/ROBOT")
    request_id = args.request_id or f"{NODE_NAME}-{uuid4().hex[:8]}"
    charge = QueuedCharge if args.queue else RobotCharge
    return charge(args.name, fleet, robot, request_id, args.start_timeout, line=line)


def run(args: argparse.Namespace) -> int:
    """Send the request, and wait for the effect. Return the exit code."""
    request = request_of(args)
    try:
        with interruptible(), closing(open_graph(args, NODE_NAME)) as transport:
            return send(
                transport,
                request,
                args.timeout,
                sys.stdout,
                command=args.command,
                graph=graph_of(args, transport.speaks),
            )
    except TransportError as error:
        complain(args.command, error)
        return 1
    except KeyboardInterrupt:  # the user pressed Ctrl-C before the first request
        return _interrupted(args.command, sent=False)


def _interrupted(command: str, *, sent: bool) -> int:
    rest = "the last request remains in effect" if sent else "no request was sent"
    complain(command, f"interrupted; {rest}")
    return 130


def send(
    transport: Transport,
    request: Request,
    timeout_s: float,
    out: TextIO,
    *,
    command: str = "send",
    graph: str = "",
) -> int:
    """Return the exit code.

    - 0: the device showed the effect within `timeout_s`.
    - 1: the device did not show the effect.
    - 130: Ctrl-C ended the program.

    `graph` names the graph in messages.
    """
    exchange = _Exchange(transport, request, timeout_s, out, command, graph)
    try:
        while True:
            code = exchange.look()
            if code is not None:
                return code
    except KeyboardInterrupt:
        return _interrupted(command, sent=exchange.seen.first_sent_at is not None)


class _Exchange:
    """A loop around `exchange.step` that supplies the clock, the transport and the terminal."""

    def __init__(
        self,
        transport: Transport,
        request: Request,
        timeout_s: float,
        out: TextIO,
        command: str = "send",
        graph: str = "",
    ) -> None:
        self.command = command
        self.request, self.out, self.transport = request, out, transport
        self.publishers: dict[str, Publisher[d.Message]] = {}
        self.publisher = self._publisher(request.topic)
        self.ear = Ear(transport, (*STATES, *request.answers, topics.DIAGNOSTICS))
        self.supervisor = (
            None
            if request.supervisor is None
            else transport.subscribe(request.supervisor, lambda message: None)
        )
        self.seen = RequestProgress(began_at=time.monotonic(), timeout_s=timeout_s, graph=graph)
        self.asked: set[str] = set()
        self.described = ""
        self.watches_until: float | None = None
        self._last_before = 0

    def look(self) -> int | None:
        """Take the messages heard, and do the next step. Return an exit code at the end, and None
        before."""
        for heard in self.ear.listen(LOOK_EVERY_S):
            self._take(heard)
        now = time.monotonic()
        if self.watches_until is not None:
            return self._watch(now)
        self.seen = replace(self.seen, listeners=self._listeners())
        todo = step(self.request, self.seen, now)
        if todo.outcome is not None:
            return self._finish(todo.outcome)
        if todo.hint and todo.hint not in self.seen.hinted:
            left_s = max(0.0, self.seen.began_at + self.seen.timeout_s - now)
            self.seen = replace(self.seen, hinted=self.seen.hinted | {todo.hint})
            complain(self.command, f"waits {left_s:.0f} s more: {todo.hint}")
        if todo.send is not None:
            self._send(todo.send, now, self.request.own if todo.direct else self.request.topic)
        return None

    def _publisher(self, topic: topics.AnyTopic) -> Publisher[d.Message]:
        if topic.name not in self.publishers:
            self.publishers[topic.name] = self.transport.publisher(topic)
        return self.publishers[topic.name]

    def _listeners(self) -> int:
        """Count the nodes that listen to the request. Return 0 if the node that forwards the request is
        missing."""
        if self.supervisor is not None and not self.supervisor.matched():
            return 0
        return self.publisher.matched()

    def _take(self, heard: Heard) -> None:
        if isinstance(heard.message, d.DiagnosticArray):
            if told := _told(heard.message, self.request):
                self.seen = replace(self.seen, told=told, told_at=heard.at)
            return
        before, self.seen = self.seen, self.seen.hears(heard, self.request.about)
        if self.seen.states == before.states:
            return
        text = words.described(self.seen.states[-1])
        if text != self.described:
            self.described = text
            self._line(heard.at, "state", text)

    def _send(self, message: words.Requested, now: float, topic: topics.AnyTopic) -> None:
        if isinstance(message, d.LiftRequest | d.DoorRequest):
            message = replace(message, request_time=stamp(time.time()))
        if topic.name not in self.asked:
            self.asked.add(topic.name)
            self._line(now, "request", f"{words.request(message)} on {topic.name}")
        self.seen = self.seen.sends(now)
        self._publisher(topic).publish(message)

    def _finish(self, outcome: Fulfilled | Failed) -> int | None:
        """Print the outcome. Return the exit code, or None if the program watches the lift a little
        longer."""
        if isinstance(outcome, Failed):
            complain(self.command, outcome.text)
            return 1
        now = time.monotonic()
        self._line(now, "done", outcome.text)
        if not self.request.watched_s or self.seen.first_sent_at is None:
            return 0
        self.watches_until = now + self.request.watched_s
        self._last_before = len(self.seen.states) - 1
        return None

    def _watch(self, now: float) -> int | None:
        """Print the lift's movements when the watching time is over. Return the exit code then, and
        None before."""
        if self.watches_until is None or now < self.watches_until:
            return None
        self._line(now, "after", aftermath(self.seen.states_of(d.LiftState)[self._last_before :]))
        return 0

    def _line(self, at: float, what: str, text: str) -> None:
        elapsed_s = max(0.0, at - self.seen.began_at)
        line = f"{elapsed_s:8.3f} s  {what:<7}  {self.request.name}  {text}"
        self.out.write(words.printable(line) + "\n")
        self.out.flush()


def _told(message: d.DiagnosticArray, request: Request) -> dict[str, str]:
    """Return the values in the diagnostics of the request's device; {} for other diagnostics."""
    for status in message.status:
        values = {value.key: value.value for value in status.values}
        if (status.hardware_id, values.get("kind")) == (request.name, request.kind):
            return values
    return {}
