"""Sort a graph's messages by device, and explain each device.

Call `HeardDevices.take` in the order of time. The memory of `HeardDevices` is limited. A recording of a
day takes no more memory than a recording of a minute.
"""

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from datetime import tzinfo
from typing import ClassVar, Final

from bridges.blackbox.triggers import DIED, OPERATOR, REFUSED
from bridges.kinds.charger import refusals
from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.heard import Heard, Own
from bridges.messages.words import KINDS, Kind
from bridges.observe.alarms import ObservedAlarm
from bridges.observe.all_devices import Key, ObservedGraph
from bridges.observe.diagnosis import COORDINATOR, FLEET, Diagnosis
from bridges.observe.limits import FLAPS, MOST_DEVICES
from bridges.observe.requesters import Moment
from bridges.observe.robots import ObservedRobot, robots, waits
from workbench.explain import answer as common
from workbench.explain import (
    charger,
    daemon,
    door,
    first_causes,
    known_defects,
    lift,
    robot,
    workcell,
)
from workbench.explain.answer import Answer, FileReason, Remedies
from workbench.explain.charger_facts import ChargerFacts
from workbench.explain.charger_wishes import ChargerWishes, queue_of
from workbench.explain.device import MOST_LINES, Device
from workbench.explain.door_facts import DoorFacts
from workbench.explain.explanation import Explained, Explanation, NextStep, StoryLine
from workbench.explain.lift_facts import LiftFacts
from workbench.explain.noted import noted
from workbench.explain.phrases import TimePhrases, lasted, on_graph
from workbench.explain.rows import label
from workbench.explain.workcell_facts import DispenserFacts, IngestorFacts, WorkcellFacts

STORY_LINES: Final = 40
MOVES: Final = ("the robot", "the fleet adapter")
"""Parties that do nothing for a robot that must stand because of an alarm."""
SHOWS_S: Final = 1.5
"""Time (s) from the moment for which the recorder kept a file until the device's states show the
effect. States come at 1 Hz."""


class HeardDevices(ObservedGraph[Device]):
    """All devices heard, or only the devices with one name.

    - `session`: the session that the user asked about. The story keeps this session's last ride, even
      if other sessions ride later.
    - `senders`: topic -> the nodes that publish the topic on a live graph. `senders` is None if the
      nodes are unknown. If `senders` is known, the listener also hears FLEET_STATES.
    """

    makes: ClassVar = {
        "lift": LiftFacts,
        "door": DoorFacts,
        "charger": ChargerFacts,
        "dispenser": DispenserFacts,
        "ingestor": IngestorFacts,
    }

    def __init__(
        self,
        name: str = "",
        session: str = "",
        most_lines: int = MOST_LINES,
        graph: Sequence[str] | None = None,
    ) -> None:
        """Make an empty collection.

        - `name`: the name of the devices to explain; "" for all devices.
        - `most_lines`: maximum number of story lines for each device.
        - `graph`: command-line options that name this live graph; None for a recording. Commands that
          a sentence proposes get these options.
        """
        super().__init__()
        self._most_lines = most_lines
        self._graph, self._live = graph or (), graph is not None
        self.messages = 0
        self._story_from = float("-inf")
        self._name = name
        self._session = session
        self._others: dict[Kind, dict[str, None]] = {kind: {} for kind in KINDS}
        self._reason: dict[str, FileReason] = {}
        self._due: dict[str, float] = {}
        self._then: dict[Key, tuple[Moment, Device, Mapping[str, Moment]]] = {}
        self.senders: Mapping[str, Sequence[str]] | None = None
        self._wishes = ChargerWishes()

    def take(self, heard: Heard | Own) -> None:
        """Take the next message from the graph, or the next note of our recorder."""
        for name in [name for name, at in self._due.items() if heard.at > at]:
            del self._due[name]
            self._keep(name)
        if isinstance(heard, Own):
            self._note(self.moment(heard), heard)
            return
        self.messages += 1
        self.hear(heard)
        self._wishes.hear(heard.message, self.now)
        if isinstance(heard.message, d.DiagnosticStatus):
            self._refusal(self.now, heard.message)

    def retained(self, heard: Heard) -> None:
        """Take a request that a fleet adapter sent before we listened.

        The request matters only for a lift that publishes no states. The adapter sends nothing more to
        such a lift, because an adapter repeats a request only at a state.
        """
        if isinstance(heard.message, d.LiftRequest):
            found = self.device("lift", heard.message.lift_name, self.now)
            if isinstance(found, LiftFacts) and found.state is None:
                self.messages += 1
                found.retain(heard.message, self.now)

    def at_its_end(self) -> None:
        """Explain the devices at the end of the recording. Without this call, `explain` explains the
        moment for which our recorder kept the file."""
        self._reason.clear()
        self._then.clear()

    def story_from(self, at: float) -> None:
        """Leave all events before this time (s) out of the stories."""
        self._story_from = at

    def devices(self) -> list[tuple[Explained, str]]:
        """Return the devices that have published a state, by kind and name. After the devices come the
        robots that our daemons report."""
        found: list[tuple[Explained, str]] = []
        for kind in KINDS:
            found += [(kind, one) for one in sorted(d.id for d in self.stated(kind))]
        return [*found, *(("robot", one.who) for one in robots(self.nodes))]

    def because(self, clock: Callable[[float], str]) -> list[str]:
        """Return a sentence for each alarm that makes robots stand. `clock(wall)` returns a time as
        text."""
        return [one.because(clock) for one in self.alarms() if one.stands]

    def kinds(self, name: str) -> list[Explained]:
        """Return the kinds of the devices with this name. If such a device has published a state,
        return only the kinds with a state. Otherwise return the kinds for which requests were heard."""
        found: list[Explained] = [kind for kind in KINDS if (kind, name) in self.known]
        stated = [kind for kind in found if self.known[kind, name].state is not None]  # type: ignore[index]
        if self.robot(name):
            stated.append("robot")
        listed: list[Explained] = ["charger"] if self._lists(name) else []
        return stated or found or listed or (["robot"] if self.asking(name) else [])

    def robot(self, name: str) -> ObservedRobot | None:
        """Return the robot of this name, FLEET/ROBOT or ROBOT alone."""
        every = (one for one in robots(self.nodes) if name in (one.who, one.who.rpartition("/")[2]))
        return next(every, None)

    def reports(self, name: str) -> list[Diagnosis]:
        """Return the reports on a daemon, alarm panel or coordinator of this name, if no device and no
        robot with this name was heard."""
        if self.kinds(name):
            return []
        return [one for one in self.nodes.values() if name in _names(one)]

    def asking(self, name: str) -> str:
        """Find a robot (FLEET/ROBOT, or ROBOT alone) by its requests, by the lift or charger that it
        has, or by the coordinator's queue. Return FLEET/ROBOT, or "" if there is no such robot."""
        return next((w for w in self._askers() if name in (w, w.rpartition("/")[2])), "")

    def _askers(self) -> Iterator[str]:
        """Yield the robots that `asking` finds."""
        holders = (_holder(one) for one in self.stated())
        queue = queue_of(self._coordinator(silent=True))
        every = (*self.spoke, *holders, *queue, *self._wishes.last, *self._wishes.members)
        return (who for who in every if all(who.rpartition("/")[::2]))

    def explain(
        self, kind: Explained, name: str, zone: tzinfo | None, remedies: Remedies | None = None
    ) -> Explanation:
        """Explain the device or robot at the time of the last message. `zone` is the time zone of the
        texts, or None for this machine's zone."""
        clock = TimePhrases(self.now, zone)
        if kind != "robot":
            if reports := self.reports(name):
                told = daemon.explanation(name, reports, self._heard(clock), clock, remedies or {})
            else:
                told = self._explain(kind, name, zone, remedies)
            return self._alarmed(told, [one for one in self.alarms() if one.stands], clock)
        one = self.robot(name)
        who = one.who if one else self.asking(name)
        told = self._explain_robot(who, one, clock, remedies or {})
        fleet, every = who.rpartition("/")[0], [one for one in self.alarms() if one.stands]
        mine = [one for one in every if not one.fleets or fleet in one.fleets.split(", ")]
        return self._alarmed(told, mine, clock)

    def _alarmed(
        self, told: Explanation, alarms: Sequence[ObservedAlarm], clock: TimePhrases
    ) -> Explanation:
        """Say first which alarms make robots stand. If otherwise nobody has to act, or only a robot
        that must stand, the next step is the end of the alarms."""
        waits = ("nobody", *(MOVES if told.kind == "robot" else ()))
        ends = [
            NextStep(who, on_graph(what, self._graph)) for who, what in (a.ends for a in alarms)
        ]
        acts = bool(alarms) and all(step.who in waits for step in told.next)
        return replace(
            told,
            now=(*(one.because(clock.time) for one in alarms), *told.now),
            next=tuple(ends) if acts else told.next,
        )

    def _explain_robot(
        self, who: str, one: ObservedRobot | None, clock: TimePhrases, remedies: Remedies
    ) -> Explanation:
        assert who
        waiting, has = dict[str, Device](), dict[str, Device]()
        for device, wait in waits(self.stated(), who, self.now):
            does = f"waits for {device.kind} {device.name} ({label(wait.wants)})"
            waiting[f"{does} {clock.since(wait.since)}"] = device
        for device, since in self._unstated(who):
            waiting[f"has asked for {device.kind} {device.name} {clock.since(since)}"] = device
        for device in self.stated():
            if _holder(device) == who and device not in waiting.values():
                has[f"has {device.kind} {device.name}"] = device
        asked, held = (
            {does: self._explain(o.kind, o.id, clock.zone, remedies) for does, o in found.items()}
            for found in (waiting, has)
        )
        queued, began = queue_of(self._coordinator()).get(who, ""), self.began or self.now
        wish = self._wishes.told(who, self._coordinator(silent=True), clock, ours=one is not None)
        return robot.explanation(who, one, asked, held, queued, wish, clock, remedies, began)

    def _unstated(self, who: str) -> Iterator[tuple[Device, Moment]]:
        """Yield each lift, door and charger without a state that this robot has requested, and the time
        of the request. Nothing repeats some of these requests."""
        for device in self.known.values():
            for one in device.requesters if device.state is None else ():
                asks = one.ended is None and (device.kind != "charger" or one.asks(self.now))
                if asks and who == (one.wants if device.kind == "charger" else one.who):
                    yield device, one.since

    def _explain(
        self, kind: Kind, name: str, zone: tzinfo | None, remedies: Remedies | None
    ) -> Explanation:
        """Explain the device at the time of the last message. `zone` is the time zone of the texts, or
        None for this machine's zone."""
        last = self.known.get((kind, name)) or self.make(kind, name)
        at_end = self.now, last, self.spoke
        now, device, spoke = self._then.get((kind, name), at_end)
        reason = self._reason.get(name) or self._reason.get("")
        if reason and reason.fault in first_causes.OFFLINE and len(last.flaps(self.now)) >= FLAPS:
            now, device, spoke = at_end  # one moment cannot show repeated changes
        clock = TimePhrases(now, zone)
        around = self._around(spoke, reason, remedies or {})
        answer = self._answer(device, clock, around)
        if reason is not None:
            answer.now.insert(0, reason.told(clock))
            _act_on(answer, reason, around.remedies)
        met = bool(answer.fields) and all(field.met for field in answer.fields)
        if answer.because is None and not met:
            common.say_waits(answer, device, clock)
        for one in robots(self.nodes) if device is last else ():
            if one.who == _holder(device):
                robot.say_stands(answer, one, clock, around.remedies, robot.IN_LIFT)
        if device is not last and last.state is not None:
            held = "" if kind == "door" else f"; held by {words.holder(last.state) or 'nobody'}"
            later = f"{words.condition(last.state)}{held}"
            answer.say(f"At the end of the file, at {clock.time(self.now.wall)}: {label(later)}.")
        story = self._story(device, answer)
        return Explanation(
            kind=kind,
            device=label(name),
            heard=self._heard(clock),
            now=tuple(answer.now),
            next=tuple(
                NextStep(step.who, on_graph(step.what, self._graph))
                for step in dict.fromkeys(answer.next)
            ),
            asks=answer.asks,
            fields=answer.fields,
            faults=tuple(
                replace(fault, do=on_graph(fault.do, self._graph))
                for fault in common.faults(device, clock, around.remedies, answer.because)
            ),
            notes=(
                *answer.notes,
                *known_defects.notes(device, clock.now),
                *common.notes(device, clock),
                *self._stepped(clock),
            ),
            story=story[-STORY_LINES:],
            left_out=max(0, len(story) - STORY_LINES),
            before=_before(device, clock),
        )

    def _heard(self, clock: TimePhrases) -> str:
        """Return the span of time of the messages, as text."""
        began = self.began or self.now
        for_s = lasted(self.now.at - began.at)
        return f"{clock.date(began.wall)} to {clock.time(self.now.wall)} ({for_s})"

    def _around(
        self, spoke: Mapping[str, Moment], reason: FileReason | None, remedies: Remedies
    ) -> common.OthersHeard:
        names: dict[Explained, tuple[str, ...]] = {
            kind: (*self._others[kind], *(label(one.id) for one in self.stated(kind)))
            for kind in KINDS
        }
        reported = (one.who for one in robots(self.nodes))
        names["robot"] = tuple(dict.fromkeys((*reported, *map(label, self._askers()))))
        live = self._live or self.senders is not None
        named = dict.fromkeys(name for one in self.nodes.values() for name in _names(one))
        return common.OthersHeard(
            names, self.messages, spoke, remedies, reason, self.senders, (*named,), live
        )

    def _answer(self, device: Device, clock: TimePhrases, around: common.OthersHeard) -> Answer:
        match device:
            case LiftFacts():
                return lift.answer(device, clock, around, self._session)
            case DoorFacts():
                return door.answer(device, clock, around, self._session)
            case ChargerFacts():
                return charger.answer(device, clock, around, self._coordinator())
            case WorkcellFacts():
                return workcell.answer(device, clock, around)
        raise AssertionError(device)

    def _story(self, device: Device, answer: Answer) -> tuple[StoryLine, ...]:
        """Return the story of the ride that the answer explains."""
        if isinstance(device, LiftFacts) and device.kept and not answer.asks:
            return device.kept
        return device.lines_since(max(answer.since, self._story_from))

    # ---- sort messages by device

    def make(self, kind: Kind, name: str) -> Device:
        """Make a device of which no message was heard yet."""
        made = super().make(kind, name)
        made.focus = self._session
        made.lines = deque(maxlen=self._most_lines)
        return made

    def device(
        self, kind: Kind, name: str, moment: Moment, *, stated: bool = False
    ) -> Device | None:
        """Return the device of this name. Return None if this collection does not explain the
        device."""
        if self._name in ("", name):
            return super().device(kind, name, moment, stated=stated)
        if stated and name and len(self._others[kind]) < MOST_DEVICES:
            self._others[kind][label(name)] = None
        return None

    def _refusal(self, moment: Moment, status: d.DiagnosticStatus) -> None:
        refusal = refusals.read(status)
        found = self.device("charger", refusal.charger, moment) if refusal else None
        if refusal is not None and isinstance(found, ChargerFacts):
            found.refused(moment, refusal)

    def _note(self, moment: Moment, own: Own) -> None:
        note = noted(own.topic.rpartition("/")[2], own.text)
        if note is None:
            return
        if note.kept_for is not None and not self._reason:
            self._reason[note.subject] = reason = FileReason(*note.kept_for, moment)
            if reason.code != DIED:
                self._due[note.subject] = moment.at + SHOWS_S
        elif note.kept_for is not None and note.kept_for[0] == OPERATOR:
            self._reason = {k: replace(v, wrote=note.kept_for[1]) for k, v in self._reason.items()}
        for kind in KINDS:
            if (kind, note.subject) in self.known:
                self.known[kind, note.subject].note(moment, note)

    def _keep(self, name: str) -> None:
        """Remember a copy of the present state of the devices with this name. With "", copy all
        devices."""
        for key, device in self.known.items():
            if name in ("", device.id) and key not in self._then:
                self._then[key] = self.now, deepcopy(device), {**self.spoke}

    def _lists(self, name: str) -> bool:
        coordinator = self._coordinator()
        return coordinator is not None and name in coordinator.values

    def _coordinator(self, *, silent: bool = False) -> Diagnosis | None:
        """Return the latest report of a coordinator; with `silent`, also of a silent one."""
        found = [one for one in self.nodes.values() if one.kind == COORDINATOR]
        said = [one for one in found if not one.name.endswith(": daemon")]
        now = [one for one in said if silent or one.is_current(self.now.at)]
        return max(now, key=lambda one: one.last.at, default=None)

    def _stepped(self, clock: TimePhrases) -> tuple[str, ...]:
        return tuple(
            f"At {clock.time(moment.wall)} the listener's clock was stepped by {by_s:+.0f} s."
            for moment, by_s in self.steps
        )


def _names(said: Diagnosis) -> tuple[str, ...]:
    """Return the names of the daemon and of the panel or site that a report is about. A robot's name is
    left out, because robots are found by FLEET/ROBOT."""
    node, _, subject = said.name.partition(": ")
    return (label(node),) if subject == "daemon" or said.kind == FLEET else (label(node), subject)


def _holder(device: Device) -> str:
    """Return the session that has the lift, or the robot that has the charger; "" for other devices."""
    match device:
        case LiftFacts():
            return device.session.value
        case ChargerFacts():
            return device.robot.value
    return ""


def _act_on(answer: Answer, reason: FileReason, remedies: Remedies) -> None:
    """Propose a step that fits the recorder's reason to keep the file. Do so only if the device's state
    alone calls for no step."""
    if any(step.who != "nobody" for step in answer.next):
        return
    do = remedies[reason.fault][1] if reason.fault in remedies else ""
    if reason.code == REFUSED:
        do = "compare the refused request with the device's settings: the refusal says what differs"
    if do:
        harmless = do.startswith(first_causes.HARMLESS)
        answer.next = [NextStep("nobody" if harmless else "a person", do)]


def _before(device: Device, clock: TimePhrases) -> str:
    """Summarise the earlier events in one sentence. Return "" if there were none."""
    match device:
        case LiftFacts() if device.rides.ended:
            rides = device.rides
            longest = ""
            if rides.longest_at is not None:
                longest = (
                    f"; the longest wait for the car was {lasted(rides.longest_s)}"
                    f" ({rides.longest_who}, until {clock.time(rides.longest_at.wall)})"
                )
            return f"{_count(rides.ended, 'ride')} ended in the time heard{longest}."
        case DoorFacts() if device.passages:
            return f"{_count(device.passages, 'hold')} ended in the time heard."
        case ChargerFacts() if device.charges:
            return f"{_count(device.charges, 'charge')} began in the time heard."
    return ""


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
