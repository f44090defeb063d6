"""Explain a robot: why it stands, and who must act next.

The states of lifts, doors and chargers show what any robot waits for. The explanation of such a device
says why it does not serve the robot. The charger coordinator's queue tells what a robot waits for that
has no charger yet. Our fleet's daemon also reports each robot's place, command and faults on
`/diagnostics`.
"""

from collections.abc import Mapping
from typing import Final

from bridges.observe.requesters import Moment
from bridges.observe.robots import ObservedRobot
from workbench.explain.answer import Answer, Remedies
from workbench.explain.charger_wishes import steps
from workbench.explain.explanation import Explanation, FaultTold
from workbench.explain.phrases import TimePhrases, lasted
from workbench.explain.rows import label

STANDS: Final[Mapping[str, str]] = {
    "ROBOT_SILENT": "is silent",
    "ROBOT_NOT_READ": "cannot be read",
    "ROBOT_FAULT": "reports a fault of its own",
    "ROBOT_TAKEN_OUT": "takes no orders",
    "ROBOT_ON_OTHER_MAP": "is on a map that RMF's graph lacks",
    "ROBOT_NOT_STOPPING": "does not stop",
    "ROBOT_NOT_OBEYING": "does not obey",
    "ROBOT_PAUSED_BY_OTHERS": "is paused, and not by RMF",
    "ROBOT_ACTION_FAILED": "began its action, and failed",
    "ROBOT_ACTION_UNANSWERED": "may have begun its action, or not",
    "ROBOT_REFUSES": "refuses its command",
    "ROBOT_NOT_COMMANDED": "does not get its command",
    "ROBOT_OFF_GRAPH": "is off the graph",
    "ROBOT_NOT_CHARGING": "has docked, and gets no charge",
    "CHARGER_REPORTS_ERROR": "is at a charger in error, or was sent there",
    "ROBOT_AT_WRONG_STATION": "is at the wrong charger",
    "ROBOT_NOT_THERE": "reports an arrival, and is elsewhere",
    "ROBOT_PASSED_LIGHT": "drove on without permission of RMF's traffic light",
    "ROBOT_WITHOUT_PATH": "drives on a path that RMF does not know",
}
"""Faults because of which a robot stands, or gets no task. The fault that explains most comes first."""
OF_DAEMON: Final = ("NO_ROUTER", "TYPE_MISFIT", "NOT_PUBLISHED", "PASSIVE")
"""Faults of the fleet's daemon because of which RMF directs no robot of the fleet."""
IN_LIFT: Final = "ROBOT_ON_OTHER_MAP"
"""A fault that a robot in a lift has until it has found its place on the new floor."""
LETS: Final[Mapping[str, str]] = {
    "no answer": "has not answered about its path yet",
    "stay": "makes it stand: another robot has the way ahead, or the robots still negotiate",
    "pause": "has told it to pause for a new plan",
    "wait": "lets it drive to its next checkpoint, and holds it there",
    "error": "has an error: the robot has gone to a place for which it had no permission",
}

NOTHING: Final = "there is nothing to do"
OF_OTHERS: Final = (
    "No daemon of rmf-bridges reports on this robot, so its place, its task and its faults are not"
    " known."
)


def explanation(
    who: str,
    robot: ObservedRobot | None,
    waits: Mapping[str, Explanation],
    has: Mapping[str, Explanation],
    queued: str,
    wish: Answer,
    clock: TimePhrases,
    remedies: Remedies,
    began: Moment,
) -> Explanation:
    """Explain the robot `who` (FLEET/ROBOT).

    - `robot`: the report of our fleet's daemon; None for a robot of another node's fleet.
    - `waits`: each device that the robot waits for, in words such as `waits for lift Lift1` -> the
      device's explanation.
    - `has`: each other device that the robot has, in words such as `has lift Lift1`.
    - `queued`: the origin of the robot's wish and the reason why it gets no charger, from the
      coordinator's queue; "" if the robot is not in the queue.
    - `wish`: what was heard of a wish for a charger that no charger and no queue shows.
    """
    heard_s = lasted(clock.now.at - began.at)
    told: tuple[FaultTold, ...] = ()
    before = ""
    if robot is None:
        found = _served(Answer(notes=(OF_OTHERS,)), label(who), {**waits, **has}, queued)
        if not found.now:
            _of_others(found, label(who), wish)
    else:
        found, said = _answer(robot, waits, has, queued, wish, clock, remedies), robot.said
        told = tuple(
            FaultTold(code, detail, clock.since(moment), *remedies.get(code, ()))
            for code, (detail, moment) in said.faults.items()
        )
        before = (
            f"Its daemon's report: at {said.value('at')}, doing {said.value('doing') or 'nothing'},"
            f" battery {said.value('battery') or 'unknown'}"
        )
        tasks = said.value("new_tasks")  # missing with `control: traffic_light`
        before += f", new tasks {tasks}." if tasks else "."
    return Explanation(
        kind="robot",
        device=label(who),
        heard=f"{clock.date(began.wall)} to {clock.time(clock.now.wall)} ({heard_s})",
        now=tuple(dict.fromkeys(found.now)),
        next=tuple(dict.fromkeys(found.next)),
        faults=told,
        notes=found.notes,
        before=before,
    )


def _of_others(found: Answer, who: str, wish: Answer) -> None:
    """Explain a robot on which no daemon of ours reports, and which no device explains."""
    found.now, found.next = [*wish.now], [*wish.next]
    if not wish.next:
        found.say(
            f"{who} waits for no lift, door or charger that was heard, and has none.",
            "a person",
            "look at the robot's own fleet adapter and at RMF's tasks",
        )


def _answer(
    robot: ObservedRobot,
    waits: Mapping[str, Explanation],
    has: Mapping[str, Explanation],
    queued: str,
    wish: Answer,
    clock: TimePhrases,
    remedies: Remedies,
) -> Answer:
    who, said, found = label(robot.who), robot.said, Answer()
    if not said.is_current(clock.now.at):
        for_s = lasted(clock.now.at - said.last.at)
        found.say(
            f"The last report on {who} came at {clock.time(said.last.wall)}, {for_s} ago: its daemon is"
            " not running, or is cut off.",
            "a person",
            "run `rmf-bridge status` on the machine of the fleet's daemon",
        )
        return _served(found, who, {**waits, **has}, queued)
    say_stands(found, robot, clock, remedies)
    _served(found, who, waits, queued)
    _of_daemon(found, robot, remedies)
    if not found.now:
        found.now, found.next = [*wish.now], [*wish.next]
    if not found.now:
        _mission(found, who, said.value("doing"))
    _served(found, who, has, "")
    if any(step.who != "nobody" for step in found.next):
        found.next = [step for step in found.next if step.what != NOTHING]
    return found


def say_stands(
    found: Answer, robot: ObservedRobot, clock: TimePhrases, remedies: Remedies, normal: str = ""
) -> None:
    """Add the fault because of which the robot stands. It cannot do what the answer so far asks of it.
    `normal`: a fault that is left out, because it is normal there."""
    who, said = label(robot.who), robot.said
    code = next((code for code in STANDS if code in said.faults and code != normal), "")
    if code and said.is_current(clock.now.at):
        detail, do = said.faults[code][0].rstrip("."), remedies.get(code, ("", f"mend {code}"))[1]
        found.next = [step for step in found.next if not step.what.startswith(f"{who} has to ")]
        found.say(f"{who} {STANDS[code]}: {label(detail, 300)}.", "a person", do)


def _of_daemon(found: Answer, robot: ObservedRobot, remedies: Remedies) -> None:
    """Say why RMF does not direct the robot, from the faults of the fleet's daemon."""
    who = label(robot.who)
    for code, told in robot.daemon.every_fault if robot.daemon else ():
        detail, do = label(told, 300), remedies.get(code, ("", f"mend {code}"))[1]
        name, _, why = detail.partition(": ")
        if code == "RMF_NOT_JOINED":
            found.say(f"No RMF directs {who}: {detail}.", "a person", "start RMF's schedule node")
        elif code == "RMF_TAKES_NO_ROBOT" and name == label(robot.said.subject[1]):
            found.say(f"RMF's adapter does not take {who}: {why.rstrip('.')}.", "a person", do)
        elif code in OF_DAEMON:
            text = f"The daemon of {who} has the fault {code}: {detail.rstrip('.')}."
            found.say(text, "a person", do)


def _served(found: Answer, who: str, devices: Mapping[str, Explanation], queued: str) -> Answer:
    """Explain what the robot waits for, and what it has."""
    for does, device in devices.items():
        if f"{who} " not in device.now[0]:  # a list of the robots heard may end with this robot
            found.say(f"{who} {does}.")
        found.now += device.now
        found.next += device.next
    if queued:
        text = f"{who} waits in the coordinator's queue, {label(queued, 300)}."
        found.say(text)
        found.next += steps(queued)
    return found


def _mission(found: Answer, who: str, doing: str) -> Answer:
    """Explain what a robot without faults does, from its mission."""
    way, _, light = doing.partition(", RMF's light: ")
    says, _, paused = light.partition(", ")
    if doing in ("", "nothing"):
        text = f"{who} has no mission: RMF has given it nothing to do."
        return found.say(text, "nobody", NOTHING)
    if not light:
        text = f"{who} carries out RMF's command: {label(doing)}."
        return found.say(text, "the robot", "carry out the command")
    if says in LETS and (paused or says == "no answer"):
        text = f"{who} stands on its {label(way)}. RMF's traffic light {LETS[says]}."
        return found.say(text, "the fleet adapter", "let it go on")
    return found.say(f"{who} is on its {label(way)}.", "the robot", "drive on")
