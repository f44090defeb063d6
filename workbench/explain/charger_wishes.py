"""The wishes of robots for a charger, and the next steps for a robot in the coordinator's queue. The
steps follow from the reasons in the queue (`bridges/kinds/charger_coordinator/reasons.py`)."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, TypeVar

from bridges.kinds.charger import refusals
from bridges.kinds.shared.graph_kind import LISTENS
from bridges.messages import definitions as d
from bridges.observe.diagnosis import Diagnosis
from bridges.observe.limits import MOST_SPEAKERS
from bridges.observe.requesters import Moment
from workbench.explain.answer import Answer
from workbench.explain.charger import REFUSED_LATELY_S as LATELY_S
from workbench.explain.explanation import NextStep, Who
from workbench.explain.phrases import TimePhrases, lasted, listed
from workbench.explain.rows import label

V = TypeVar("V")
STANDS: Final = r"(.+) stands at (.+)"
GONE: Final = r"(.+) was last seen at (.+) and its fleet says nothing .+"
FORMS: Final[Sequence[tuple[str, Who, str]]] = (
    (r"(.+) is silent", "a person", "start the daemon of {0}, or end what cuts it off"),
    (r"(.+) takes no request", "a person", "read in the daemon's log why {0} takes no request"),
    (r"(.+) is out of service", "a person", "mend {0}: its error text says what is wrong"),
    (STANDS, "a person", "drive {0} away from {1}"),
    (GONE, "a person", "look whether {0} has left {1}; if so, reset the coordinator"),
    ("the charging schedule has no .+", "a person", "give the robot a station in the schedule"),
    ("while .+", "a person", "stop one of the two nodes that publish the coordinator's topics"),
    (LISTENS, "the coordinator", "finish its quiet start, and assign a charger"),
    (r"(.+?) (?:charges|is assigned to) (.+)", "nobody", "{1} leaves {0}"),
    (r"(.+) is not free yet", "nobody", "{0} is free"),
)
"""The forms of a reason's clauses, each with the next step. For `nobody`, the step is to wait."""


@dataclass(frozen=True, slots=True)
class AskedCharge:
    """The last request for a charger for one robot, or its refusal. `do`: what a person should do after
    the refusal."""

    text: str
    at: Moment
    request: str
    do: str = ""


class ChargerWishes:
    """The wishes of robots for a charger, and the robots of the fleets.

    - `last`: FLEET/ROBOT -> its last wish, until a charger takes the robot
    - `members`: the robots (FLEET/ROBOT) in the states of fleets
    """

    def __init__(self) -> None:
        self.last: dict[str, AskedCharge] = {}
        self.members: dict[str, None] = {}

    def hear(self, message: d.Message, moment: Moment) -> None:
        """Take the next message from the graph."""
        match message:
            case d.FleetState():
                for one in message.robots:
                    _keep(self.members, f"{message.name}/{one.name}", None)
            case d.ChargerRequest():
                who, bay = f"{message.fleet_name}/{message.robot_name}", message.charger_name
                text = f"{f'Charger {label(bay)}' if bay else 'A charger'} was requested for"
                _keep(
                    self.last, who, AskedCharge(f"{text} {label(who)}", moment, message.request_id)
                )
            case d.ChargerState() if self.last:
                self.last.pop(label(f"{message.robot_fleet}/{message.robot_name}"), None)
            case d.ChargerCancel():
                kept = self.last.items()
                self.last = {who: one for who, one in kept if one.request != message.request_id}
            case d.DiagnosticStatus() if told := refusals.read(message):
                text = f"A request of {label(told.robot)} was refused ({label(told.text, 300)})"
                do = "compare the request with the settings: the refusal says what differs"
                if told.reason == refusals.OCCUPIED:
                    do = "request the charger again when it is free"
                _keep(self.last, told.robot, AskedCharge(text, moment, told.request_id, do))

    def told(
        self, who: str, coordinator: Diagnosis | None, clock: TimePhrases, *, ours: bool
    ) -> Answer:
        """Say what was heard of the robot's wish, if no charger and no queue shows the wish. Also say
        for whom the robot is in the way.

        - `coordinator`: the coordinator's last report, which may be old.
        - `ours`: one of our daemons reports on the robot, so an old wish explains nothing. A robot of
          another fleet may have told its wish in its fleet's state.
        """
        found, wish, queue = Answer(), self.last.get(who), queue_of(coordinator)
        current = coordinator is not None and coordinator.is_current(clock.now.at)
        if wish and ours and clock.now.at - wish.at.at > LATELY_S and (current or not coordinator):
            wish = None
        if wish is not None:
            found.say(f"{wish.text} at {clock.time(wish.at.wall)}.")
        if wish is not None and wish.do:
            found.acts("a person", wish.do)
        elif coordinator and not current and (wish or who in queue or not ours):
            at, for_s = coordinator.last, lasted(clock.now.at - coordinator.last.at)
            found.say(
                f"The last report of the charger coordinator came at {clock.time(at.wall)}, {for_s}"
                " ago: it is not running, or is cut off. Meanwhile it gives no robot a charger.",
                "a person",
                "look at the coordinator's daemon: `rmf-bridge status` on its machine",
            )
        elif wish is not None:
            lacks = "No coordinator lists" if current else "No coordinator reports on"
            found.say(
                f"{lacks} this request, so what became of it is not known.",
                "a person",
                "look at the node that assigns the chargers, and at its log",
            )
        for other, why in queue.items() if current else ():
            for robot, bay in (m.groups() for f in (STANDS, GONE) for m in _clauses(why, f)):
                if label(robot) == who:
                    text = f"{who} stands at {label(bay)}, for which {label(other)} waits."
                    found.say(text, "a person", f"drive {who} away from {label(bay)}")
        return found


def _keep(known: dict[str, V], who: str, told: V) -> None:
    """Note what was told of this robot. Forget the robot of which nothing was told for longest."""
    known.pop(label(who), None)
    known[label(who)] = told
    if len(known) > MOST_SPEAKERS:
        del known[next(iter(known))]


def queue_of(coordinator: Diagnosis | None) -> dict[str, str]:
    """Return robot -> the origin of its wish and the reason why it waits, by the coordinator."""
    told = coordinator.value("queue").split("; ") if coordinator else []
    parts = (text.partition(" by ") for text in told)
    return {who: f"{by}{rest}".strip() for who, by, rest in parts if by}


def steps(queued: str) -> list[NextStep]:
    """Return the steps that let a robot have a charger. `queued`: the robot's entry in the queue. What
    a person can do comes before what ends by itself."""
    found, until = list[NextStep](), list[str]()
    for form, who, do in FORMS:
        for match in _clauses(queued, form):
            text = do.format(*map(label, match.groups()))
            if who == "nobody":
                until.append(text)
            else:
                found.append(NextStep(who, text))
    if until:
        found.append(NextStep("nobody", f"wait until {listed(until, 'or')}"))
    return found or [NextStep("a person", "look at the coordinator's log")]


def _clauses(queued: str, form: str) -> Iterator[re.Match[str]]:
    """Yield each clause of the reason that has this form."""
    for clause in queued.partition(": ")[2].split(", "):
        if match := re.fullmatch(form, clause):
            yield match
