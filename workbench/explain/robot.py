"""Explain a robot of our fleet's daemon: why it stands, and who must act next.

The robot's daemon reports its place, its command and its faults on `/diagnostics`. The states of lifts,
doors and chargers show what the robot waits for. The explanation of such a device says why it does not
serve the robot.
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


def explanation(
    robot: ObservedRobot,
    waits: Mapping[str, Explanation],
    clock: TimePhrases,
    remedies: Remedies,
    began: Moment,
) -> Explanation:
    """Explain the robot. `waits` maps each thing that the robot waits for, in words, to the explanation
    of that lift, door or charger."""
    said = robot.said
    found = _answer(robot, waits, clock, remedies)
    faults = (
        FaultTold(code, detail, clock.since(moment), *remedies.get(code, ()))
        for code, (detail, moment) in said.faults.items()
    )
    heard_s = lasted(clock.now.at - began.at)
    return Explanation(
        kind="robot",
        device=label(robot.who),
        heard=f"{clock.date(began.wall)} to {clock.time(clock.now.wall)} ({heard_s})",
        now=tuple(found.now),
        next=tuple(dict.fromkeys(found.next)),
        faults=tuple(faults),
        before=f"Its daemon's report: at {said.value('at')}, doing {said.value('doing') or 'nothing'},"
        f" battery {said.value('battery') or 'unknown'}, new tasks {said.value('new_tasks')}.",
    )


def _answer(
    robot: ObservedRobot, waits: Mapping[str, Explanation], clock: TimePhrases, remedies: Remedies
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
    for wish, device in waits.items():
        if who not in device.now[0]:
            found.say(f"{who} waits for {wish}.")
        found.now += device.now
        found.next += device.next
    if robot.daemon and "RMF_NOT_JOINED" in robot.daemon.faults:
        detail, _ = robot.daemon.faults["RMF_NOT_JOINED"]
        found.say(f"No RMF directs {who}: {detail}.", "a person", "start RMF's schedule node")
    return found if found.now else _mission(found, who, said.value("doing"))


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
