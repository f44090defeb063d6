"""`rmf-bridge judge`: check a device's node, a fleet adapter or a node's alarm against RMF's contract.

`workbench/judge/` has the laws and the plays. A law is a rule of the contract. In a play, the judge
moves the device, as RMF would. This file has the options, the graph, the clock and the verdict.

Exit codes:

- 0: the device keeps every observed law.
- 1: the device breaks a law.
- 2: the command line is wrong.
- 66: the recording cannot be read.
- 69: no message was heard, the program could not join the graph, or the play was not performed.
- 73: the file of `--junit` cannot be written.
"""

import argparse
import os
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from uuid import uuid4

from bridges.messages import topics
from bridges.messages.definitions import Message
from bridges.messages.heard import Heard
from bridges.transports.transport import Publisher, Transport, TransportError
from workbench.graph.join import (
    add_graph_arguments,
    complain,
    ended_by,
    interruptible,
    open_graph,
    seconds,
)
from workbench.graph.live import OF_DEVICES, Ear
from workbench.judge.charge_scenario import ChargeScenario
from workbench.judge.judge import KINDS, Judge, JudgedKind
from workbench.judge.judge_run import JudgeRun
from workbench.judge.law import Verdict, shown
from workbench.judge.report import Judgement, as_json, junit, markdown, report, text, verdict
from workbench.judge.scenarios import FLEET, PassageScenario, RideScenario, Scenario
from workbench.replay.recordings import RecordingSpan, add_span_arguments, unreadable, within
from workbench.replay.sources import BagError
from workbench.rmf_model import NEVER, Said

NODE_NAME = "rmf_bridge_judge"
LOOK_EVERY_S = 0.1
STATES = {
    "lift": topics.LIFT_STATES.name,
    "door": topics.DOOR_STATES.name,
    "charger": topics.CHARGER_STATES.name,
    "dispenser": topics.DISPENSER_STATES.name,
    "ingestor": topics.INGESTOR_STATES.name,
    "adapter": topics.ADAPTER_LIFT_REQUESTS.name,
    "alarm": topics.DIAGNOSTICS.name,
}
ALARMS = (topics.FIRE_ALARM_TRIGGER, topics.EMERGENCY_SIGNAL)
WIDTH = 120
BESIDE: dict[str, tuple[str, ...]] = {
    "supervisor": (
        topics.LIFT_REQUESTS.name,
        topics.DOOR_REQUESTS.name,
        topics.DOOR_SUPERVISOR_HEARTBEAT.name,
    ),
    "fleet": (topics.ADAPTER_LIFT_REQUESTS.name, topics.ADAPTER_DOOR_REQUESTS.name),
    "coordinator": (topics.CHARGER_REQUESTS.name, topics.CHARGER_CANCELS.name),
}
"""Option of `--beside` -> topics. If the user gives the option, the judge plays although another node
publishes on these topics."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options for the device, the time and the play."""
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument(
        "name",
        metavar="NAME",
        nargs="?",
        help="the device as RMF names it; an adapter: FLEET, or FLEET/ROBOT; an alarm: its node",
    )
    add_graph_arguments(parser)
    parser.add_argument(
        "--for",
        type=seconds(0.1, 7 * 86400),
        dest="for_s",
        default=NEVER,
        metavar="S",
        help="listen for S seconds, then judge (default: listen until Ctrl-C, then judge)",
    )
    parser.add_argument("--json", action="store_true", help="the verdict as one JSON object")
    parser.add_argument(
        "--junit",
        type=Path,
        metavar="FILE",
        help="write the verdict to FILE as JUnit XML, for a CI server",
    )
    parser.add_argument(
        "--laws",
        action="store_true",
        help="print the laws of this kind, with their reasons; no NAME",
    )
    parser.add_argument(
        "--recording",
        type=Path,
        metavar="FILE",
        help="judge a recording instead of the graph: MCAP (ours, or of `ros2 bag`) or .db3",
    )
    add_span_arguments(parser)
    _add_plays(parser)


def _add_plays(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--active",
        action="store_true",
        help="move the device: needs --ride, --passages or --charge, and a device that is idle",
    )
    parser.add_argument(
        "--ride", nargs=2, metavar="FLOOR", help="play a robot that rides from one floor to another"
    )
    parser.add_argument(
        "--robots", type=int, choices=(1, 2), default=1, help="two robots: the second rides back"
    )
    parser.add_argument("--passages", type=int, metavar="N", help="play N passages of a door")
    parser.add_argument(
        "--charge", action="store_true", help="request a charger, and cancel the request"
    )
    parser.add_argument(
        "--robot",
        default=f"{FLEET}/robot1",
        metavar="FLEET/ROBOT",
        help="the robot to request the charger for; the charger must know this robot",
    )
    parser.add_argument(
        "--restarts",
        action="store_true",
        help="restart RMF's supervisor during the play; in a simulation only (--localhost)",
    )
    parser.add_argument(
        "--beside",
        action="append",
        choices=tuple(BESIDE),
        default=[],
        help="play although this node is on the graph; rides and passages then use the supervisor",
    )
    parser.add_argument(
        "--patience",
        type=seconds(0.1, 7 * 86400),
        default=120.0,
        metavar="S",
        help="how long a robot waits at each step (default: 120)",
    )


def performance_of(args: argparse.Namespace) -> Scenario | None:
    """Return the play. If the judge only listens, return None. Exit with code 2 if options contradict
    each other."""
    kinds: dict[JudgedKind, bool] = {
        "lift": args.ride is not None,
        "door": args.passages is not None,
        "charger": args.charge,
    }
    wanted = [kind for kind, asked in kinds.items() if asked]
    if not wanted and not args.active:
        return None
    if wanted != [args.kind]:
        args.usage(
            "--active moves a lift with --ride A B, a door with --passages N, a charger with --charge;"
            " to other nodes, judge only listens"
        )
    if not args.active:
        args.usage(f"this would move {words_of(args)}: to permit it, add --active")
    if args.restarts and not args.localhost:
        args.usage("--restarts needs --localhost: never restart a supervisor with a real device")
    through = "supervisor" in args.beside
    match args.kind:
        case "lift":
            floors = (args.ride[0], args.ride[1])
            how = {"through": through, "restarts": args.restarts}
            return RideScenario(args.name, floors, args.robots, args.patience, **how)
        case "door":
            how = {"through": through, "restarts": args.restarts}
            return PassageScenario(args.name, max(1, args.passages), args.patience, **how)
        case _:
            request_id = f"{FLEET}-{uuid4().hex[:8]}"
            return ChargeScenario(args.name, args.robot, request_id, min(args.patience, 30.0))


def words_of(args: argparse.Namespace) -> str:
    """Return the device's kind and name, for messages."""
    return f"the {args.kind} {shown(args.name)}"


def run(args: argparse.Namespace) -> int:
    """Listen, perform a play, or read a recording. Then judge, and return the exit code."""
    if args.laws:
        print(markdown(args.kind))
        return 0
    if not args.name:
        args.usage(f"which {args.kind}? Give the NAME")
    performance = performance_of(args)
    if args.recording is None:
        return _live(args, performance)
    if performance is not None:
        args.usage("with --recording, judge moves no device: delete --active")
    try:
        return _recorded(args)
    except BagError as error:
        return unreadable("judge", error)


def _recorded(args: argparse.Namespace) -> int:
    judge = Judge(args.kind, args.name)
    last: Heard | None = None
    for last in within(args.recording, RecordingSpan(args.from_, args.to), "judge"):
        judge.hear(last)
    if last is None or judge.first is None:
        complain("judge", f"{args.recording} has no message of RMF in that time")
        return os.EX_UNAVAILABLE
    return tell(report(judge, judge.end(last.at, last.wall), last.at - judge.first.at), args)


def _live(args: argparse.Namespace, performance: Scenario | None) -> int:
    judging: JudgeRun | None = None
    try:
        with interruptible(), closing(open_graph(args, NODE_NAME)) as transport:
            live = Live(transport, args.kind, args.beside, performance)
            judging = JudgeRun(Judge(args.kind, args.name), performance, args.for_s, live.strangers)
            if sys.stderr.isatty():
                complain("judge", _begins(args, performance))
            live.judge(judging)
    except TransportError as error:
        complain("judge", error)
    except KeyboardInterrupt:
        pass
    if judging is None:
        return os.EX_UNAVAILABLE
    now = time.monotonic()
    judged = judging.judge.end(now, time.time(), now - judging.began_at)
    notes = [f"not played to its end: {judging.note}"] if judging.note else []
    return tell(report(judging.judge, judged, now - judging.began_at, *notes), args)


def _begins(args: argparse.Namespace, performance: Scenario | None) -> str:
    """Return the first line of output, which tells the waiting user what the program is doing."""
    if performance is not None:
        return (
            f"moves {words_of(args)}; after Ctrl-C, judge releases the device and gives the verdict"
        )
    until = "until Ctrl-C" if args.for_s == NEVER else f"for {args.for_s:g} s"
    return f"listens to {words_of(args)} {until}"


def tell(found: Judgement, args: argparse.Namespace) -> int:
    """Print the verdict, write the file of `--junit`, and return the exit code."""
    if args.junit is not None:
        try:
            args.junit.write_text(junit(found), "utf-8")
        except OSError as error:
            complain("judge", f"{args.junit} cannot be written: {error.strerror or error}")
            return os.EX_CANTCREAT
    width = shutil.get_terminal_size((WIDTH, 50)).columns if sys.stdout.isatty() else 10**6
    print(as_json(found) if args.json else text(found, width))
    sys.stdout.flush()
    if verdict(found) is Verdict.BROKEN:
        return 1
    return os.EX_UNAVAILABLE if found.notes or not found.states else 0


class Live:
    """The live graph. `Live` hears messages in order of arrival, and publishes a play's messages."""

    def __init__(
        self,
        transport: Transport,
        kind: JudgedKind,
        beside: list[str],
        performance: Scenario | None,
    ) -> None:
        self._transport = transport
        self._publishers: dict[str, Publisher[Message]] = {}
        live = [topic.live() for topic in OF_DEVICES]
        self._ear = Ear(transport, (*live, topics.FLEET_STATES), others_only=True)
        alarms = ALARMS if kind == "alarm" else (topics.FIRE_ALARM_TRIGGER,)
        self._retained = {
            topic.name: transport.subscribe(topic, lambda message: None) for topic in alarms
        }
        allowed = {topic for name in beside for topic in BESIDE[name]}
        speaks = {topic.name for topic in performance.speaks} if performance else set()
        self._sole = sorted(speaks - allowed)
        self._states = self._ear.ends[STATES[kind]]
        self._looked_at = 0.0

    def strangers(self) -> str:
        """Name the other nodes that publish on the play's topics. Return "" if no other node does."""
        found = [name for name in self._sole if self._ear.ends[name].matched()]
        if not found:
            return ""
        who = [name for name, topics in BESIDE.items() if set(topics) & set(found)]
        beside = " ".join(f"--beside {name}" for name in who)
        return f"other nodes publish on {', '.join(found)}; to play nevertheless, add {beside}"

    def alarm_publishers(self) -> tuple[set[str], set[str]]:
        """Return the nodes that publish alarms, and those of them that are volatile on no topic. For a
        lift, only fire_alarm_trigger counts."""
        names, volatile = set[str](), set[str]()
        for topic, end in self._retained.items():
            here = {*self._ear.ends[topic].senders()}
            names |= here
            volatile |= here - {*end.senders()}
        return names, names - volatile

    def judge(self, judging: JudgeRun) -> None:
        """Run until there is a verdict. A play always releases the device before the play ends."""
        judging.begin(time.monotonic(), time.time())
        try:
            with _told_to_end() as told:
                while not judging.done:
                    if told():
                        self._say(judging.stop())
                    self._turn(judging)
        except BaseException:
            with suppress(TransportError):
                self._say(judging.stop())
            raise

    def _turn(self, judging: JudgeRun) -> None:
        waits_s = min(judging.wake_at() - time.monotonic(), LOOK_EVERY_S)
        for heard in self._ear.listen(waits_s):
            self._say(judging.hear(heard))
        now, wall = time.monotonic(), time.time()
        if now > self._looked_at + 1.0:
            self._looked_at = now
            names = self._states.senders()
            unnamed = ["?"] * (self._states.matched() - len(names))
            judging.judge.history.senders = (*names, *unnamed)
            judging.judge.alarm_ends(*self.alarm_publishers(), now, wall)
        self._say(judging.turn(now, wall))

    def _say(self, said: list[Said]) -> None:
        for topic, message in said:
            if topic.name not in self._publishers:
                self._publishers[topic.name] = self._transport.publisher(topic)
            self._publishers[topic.name].publish(message)


@contextmanager
def _told_to_end() -> Iterator[Callable[[], bool]]:
    """Yield a function that tells whether Ctrl-C, SIGTERM or SIGHUP has come. Such a signal does not
    interrupt the current step."""
    told: list[int] = []
    with ended_by(lambda number, _: told.append(number)):
        yield lambda: bool(told)
