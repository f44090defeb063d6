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
from workbench.explain.explanation import Explanation, FaultTold
from workbench.explain.phrases import TimePhrases, lasted
from workbench.explain.rows import label

STANDS: Final[Mapping[str, str]] = {
    "ROBOT_SILENT": "is silent",
    "ROBOT_FAULT": "reports a fault of its own",
    "ROBOT_TAKEN_OUT": "takes no orders",
    "ROBOT_ON_OTHER_MAP": "is on a map that RMF's graph lacks",
    "ROBOT_NOT_OBEYING": "does not obey",
    "ROBOT_PAUSED_BY_OTHERS": "was paused by somebody else",
    "ROBOT_ACTION_FAILED": "began its action, and failed",
    "ROBOT_ACTION_UNANSWERED": "may have begun its action, or not",
    "ROBOT_REFUSES": "refuses its command",
    "ROBOT_OFF_GRAPH": "is off the graph",
    "ROBOT_NOT_CHARGING": "has docked, and gets no charge",
    "ROBOT_AT_WRONG_STATION": "is at the wrong charger",
    "ROBOT_NOT_THERE": "reports an arrival, and is elsewhere",
    "ROBOT_PASSED_LIGHT": "drove on without permission of RMF's traffic light",
    "ROBOT_NOT_STOPPING": "does not stop",
    "ROBOT_WITHOUT_PATH": "drives on a path that RMF does not know",
}
"""Faults because of which a robot stands, or gets no task. The fault that explains most comes first."""
LETS: Final[Mapping[str, str]] = {
    "no answer": "has not answered about its path yet",
    "stay": "makes it stand: another robot has the way ahead, or the robots still negotiate",
    "pause": "has told it to pause for a new plan",
    "wait": "lets it drive to its next checkpoint, and holds it there",
    "error": "has an error: the robot has gone to a place for which it had no permission",
}

OF_OTHERS: Final = (
    "No daemon of rmf-bridges reports on this robot, so its place, its task and its faults are not"
    " known."
)


def explanation(
    who: str,
    robot: ObservedRobot | None,
    devices: Mapping[str, Explanation],
    queued: str,
    clock: TimePhrases,
    remedies: Remedies,
    began: Moment,
) -> Explanation:
    """Explain the robot `who` (FLEET/ROBOT).

    - `robot`: the report of our fleet's daemon; None for a robot of another node's fleet.
    - `devices`: each device that the robot waits for or has, in words such as `waits for lift Lift1`
      -> the device's explanation.
    - `queued`: the origin of the robot's wish and the reason why it gets no charger, from the
      coordinator's queue; "" if the robot is not in the queue.
    """
    heard_s = lasted(clock.now.at - began.at)
    told: tuple[FaultTold, ...] = ()
    before = ""
    if robot is None:
        found = _of_others(label(who), devices, queued)
    else:
        found, said = _answer(robot, devices, queued, clock, remedies), robot.said
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
        now=tuple(found.now),
        next=tuple(dict.fromkeys(found.next)),
        faults=told,
        notes=found.notes,
        before=before,
    )


def _of_others(who: str, devices: Mapping[str, Explanation], queued: str) -> Answer:
    """Explain a robot on which no daemon of ours reports."""
    found = Answer(notes=(OF_OTHERS,))
    if devices or queued:
        return _served(found, who, devices, queued)
    return found.say(
        f"{who} waits for no lift, door or charger that was heard, and has none.",
        "a person",
        "look at the robot's own fleet adapter and at RMF's tasks",
    )


def _answer(
    robot: ObservedRobot,
    devices: Mapping[str, Explanation],
    queued: str,
    clock: TimePhrases,
    remedies: Remedies,
) -> Answer:
    who, said, found = label(robot.who), robot.said, Answer()
    if not said.is_current(clock.now.at):
        for_s = lasted(clock.now.at - said.last.at)
        return found.say(
            f"The last report on {who} came at {clock.time(said.last.wall)}, {for_s} ago: its daemon is"
            " not running, or is cut off.",
            "a person",
            "run `rmf-bridge status` on the machine of the fleet's daemon",
        )
    for code in [code for code in STANDS if code in said.faults][:1]:
        detail = said.faults[code][0].rstrip(".")
        do = remedies.get(code, ("", f"mend {code}"))[1]
        found.say(f"{who} {STANDS[code]}: {detail}.", "a person", do)
    _served(found, who, devices, queued)
    if robot.daemon and "RMF_NOT_JOINED" in robot.daemon.faults:
        detail, _ = robot.daemon.faults["RMF_NOT_JOINED"]
        found.say(f"No RMF directs {who}: {detail}.", "a person", "start RMF's schedule node")
    return found if found.now else _mission(found, who, said.value("doing"))


def _served(found: Answer, who: str, devices: Mapping[str, Explanation], queued: str) -> Answer:
    """Explain what the robot waits for, and what it has."""
    for does, device in devices.items():
        if who not in device.now[0]:
            found.say(f"{who} {does}.")
        found.now += device.now
        found.next += device.next
    if queued:
        text = f"{who} waits in the coordinator's queue, {label(queued, 300)}."
        found.say(text, "the coordinator", "give it a charger that suits it and is free")
    return found


def _mission(found: Answer, who: str, doing: str) -> Answer:
    """Explain what a robot without faults does, from its mission."""
    way, _, light = doing.partition(", RMF's light: ")
    says, _, paused = light.partition(", ")
    if doing in ("", "nothing"):
        text = f"{who} has no mission: RMF has given it nothing to do."
        return found.say(text, "nobody", "there is nothing to do")
    if not light:
        text = f"{who} carries out RMF's command: {label(doing)}."
        return found.say(text, "the robot", "carry out the command")
    if says in LETS and (paused or says == "no answer"):
        text = f"{who} stands on its {label(way)}. RMF's traffic light {LETS[says]}."
        return found.say(text, "the fleet adapter", "let it go on")
    return found.say(f"{who} is on its {label(way)}.", "the robot", "drive on")
