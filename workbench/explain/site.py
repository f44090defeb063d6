"""What was heard on a graph, device by device, and the explanation of each.

`Site.take` is fed in the order of time and remembers in bounds, so a day's recording takes no more
memory than a minute's.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import tzinfo
from typing import Final

from bridges.kinds.charger import refusals
from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.heard import Heard, Own
from workbench.explain import answer as common
from workbench.explain import charger, door, lift
from workbench.explain.answer import Answer, Remedies
from workbench.explain.charger_facts import ChargerFacts
from workbench.explain.device import MOST_LINES, SILENT_S, Device
from workbench.explain.door_facts import DoorFacts
from workbench.explain.explanation import Explanation, Line, Step
from workbench.explain.lift_facts import LiftFacts
from workbench.explain.noted import noted
from workbench.explain.phrases import Clock, Moment, lasted, on_graph
from workbench.explain.rows import label
from workbench.explain.timeline import Kind

MOST_DEVICES: Final = 100
"""The most devices of each kind; those heard first stay."""
STORY_LINES: Final = 40
STEP_S: Final = 2.0
MAKES: Final[Mapping[Kind, type[LiftFacts] | type[DoorFacts] | type[ChargerFacts]]] = {
    "lift": LiftFacts,
    "door": DoorFacts,
    "charger": ChargerFacts,
}


class Site:
    """All devices that were heard, or only those of this `name`.

    `session`: whose last ride's story is kept, even if others ride after it.
    """

    def __init__(
        self,
        name: str = "",
        session: str = "",
        most: int = MOST_DEVICES,
        most_lines: int = MOST_LINES,
        graph: Sequence[str] = (),
    ) -> None:
        """`most`: how many devices of each kind are remembered, and `most_lines` of what each did.
        `graph`: the options that name this graph, for commands."""
        self._most = most
        self._most_lines = most_lines
        self._graph = graph
        self.messages = 0
        self._story_from = float("-inf")
        self._name = name
        self._session = session
        self._devices: dict[tuple[Kind, str], Device] = {}
        self._names: dict[Kind, dict[str, None]] = {"lift": {}, "door": {}, "charger": {}}
        self._began: Moment | None = None
        self._now = Moment(0.0, 0.0)
        self._offset: float | None = None
        self._steps: list[tuple[Moment, float]] = []
        self._coordinator: tuple[Moment, Mapping[str, str]] | None = None

    def take(self, heard: Heard | Own) -> None:
        """The next message, or the next text of our own recorder's."""
        moment = self._moment(heard)
        if isinstance(heard, Own):
            self._note(moment, heard)
            return
        self.messages += 1
        topic, message = heard.topic.rpartition("/")[2], heard.message
        match message:
            case d.LiftState() | d.DoorState() | d.ChargerState():
                self._state(moment, message)
            case d.LiftRequest():
                found = self._device("lift", message.lift_name, moment)
                if isinstance(found, LiftFacts):
                    found.requested(moment, message, passed_on=topic == "lift_requests")
            case d.DoorRequest():
                found = self._device("door", message.door_name, moment)
                if isinstance(found, DoorFacts):
                    found.requested(moment, message, passed_on=topic == "door_requests")
            case d.SupervisorHeartbeat():
                self._heartbeat(moment, message)
            case d.ChargerRequest() | d.ChargerCancel():
                self._charger(moment, message)
            case d.DiagnosticStatus():
                self._refusal(moment, message)
            case d.DiagnosticArray():
                for status in message.status:
                    self._diagnose(moment, status)

    def story_from(self, at: float) -> None:
        """Leave everything before this time (s) out of the stories."""
        self._story_from = at

    def passed(self, at: float, wall: float) -> None:
        """Note that time has passed and nothing was heard."""
        self._now = Moment(max(at, self._now.at), wall)
        self._began = self._began or Moment(at, wall, seen=False)

    def devices(self) -> list[tuple[Kind, str]]:
        """The devices that have published a state, in the order of kinds and names."""
        shown = [key for key, one in self._devices.items() if one.last_state is not None]
        return sorted(shown, key=lambda key: (list(MAKES).index(key[0]), key[1]))

    def kinds(self, name: str) -> list[Kind]:
        """The kinds of a device of this name: by its states, or else by the requests for it."""
        found = [one for one in self._devices.values() if one.id == name]
        shown = [one.kind for one in found if one.last_state is not None]
        return shown or [one.kind for one in found]

    def explain(
        self, kind: Kind, name: str, zone: tzinfo | None, remedies: Remedies | None = None
    ) -> Explanation:
        """The device at the end of what was heard. `zone`: of the times; None: this machine's."""
        clock = Clock(self._now, zone)
        began = self._began or self._now
        device = self._devices.get((kind, name)) or MAKES[kind](name, began)
        answer = self._answer(device, clock)
        common.say_waits(answer, device, clock)
        story = self._story(device, answer)
        for_s = lasted(self._now.at - began.at)
        return Explanation(
            kind=kind,
            device=label(name),
            heard=f"{clock.date(began.wall)} to {clock.time(self._now.wall)} ({for_s})",
            now=tuple(answer.now),
            next=tuple(
                Step(step.who, on_graph(step.what, self._graph))
                for step in dict.fromkeys(answer.next)
            ),
            asks=answer.asks,
            fields=answer.fields,
            faults=tuple(
                replace(fault, do=on_graph(fault.do, self._graph))
                for fault in common.faults(device, clock, remedies or {})
            ),
            notes=(*answer.notes, *common.notes(device, clock), *self._stepped(clock)),
            story=story[-STORY_LINES:],
            left_out=max(0, len(story) - STORY_LINES),
            before=_before(device, clock),
        )

    def _answer(self, device: Device, clock: Clock) -> Answer:
        around = common.Heard(
            {kind: (*names,) for kind, names in self._names.items()}, self.messages
        )
        match device:
            case LiftFacts():
                return lift.answer(device, clock, around, self._session)
            case DoorFacts():
                return door.answer(device, clock, around, self._session)
            case ChargerFacts():
                return charger.answer(device, clock, around, self._coordinates())
        raise AssertionError(device)

    def _story(self, device: Device, answer: Answer) -> tuple[Line, ...]:
        """All that is remembered of the ride in question."""
        if isinstance(device, LiftFacts) and device.kept and not answer.asks:
            return device.kept
        return device.lines_since(max(answer.since, self._story_from))

    # ---- who hears what

    def _moment(self, heard: Heard | Own) -> Moment:
        at = max(heard.at, self._now.at) if self._began else heard.at
        offset = heard.wall - heard.at
        if self._began is None:
            self._began = Moment(at, heard.wall, seen=False)
        before = offset if self._offset is None else self._offset
        if abs(offset - before) > STEP_S and len(self._steps) < 3:
            self._steps.append((Moment(at, heard.wall), offset - before))
        self._offset = offset
        self._now = Moment(at, heard.wall)
        return self._now

    def _device(self, kind: Kind, name: str, moment: Moment) -> Device | None:
        if self._name and name != self._name:
            return None
        found = self._devices.get((kind, name))
        if found is not None or not name:
            return found
        if len(self._devices) >= 3 * self._most:
            return None
        assert self._began is not None
        made = LiftFacts(name, self._began, self._session) if kind == "lift" else None
        found = self._devices[kind, name] = made or MAKES[kind](name, self._began)
        found.lines = deque(maxlen=self._most_lines)
        return found

    def _state(self, moment: Moment, state: words.Stated) -> None:
        kind: Kind = "charger"
        if not isinstance(state, d.ChargerState):
            kind = "lift" if isinstance(state, d.LiftState) else "door"
        name = words.device(state)
        if name and len(self._names[kind]) < self._most:
            self._names[kind][label(name)] = None
        match self._device(kind, name, moment), state:
            case LiftFacts() as found, d.LiftState():
                found.stated(moment, state)
            case DoorFacts() as found, d.DoorState():
                found.stated(moment, state)
            case ChargerFacts() as found, d.ChargerState():
                found.stated(moment, state)

    def _heartbeat(self, moment: Moment, heartbeat: d.SupervisorHeartbeat) -> None:
        for device in self._devices.values():
            if isinstance(device, DoorFacts):
                device.listed(moment, heartbeat)

    def _charger(self, moment: Moment, message: d.ChargerRequest | d.ChargerCancel) -> None:
        found = self._device("charger", message.charger_name, moment)
        if isinstance(found, ChargerFacts) and isinstance(message, d.ChargerRequest):
            found.requested(moment, message)
        elif isinstance(found, ChargerFacts) and isinstance(message, d.ChargerCancel):
            found.cancelled(moment, message)

    def _refusal(self, moment: Moment, status: d.DiagnosticStatus) -> None:
        refusal = refusals.read(status)
        found = self._device("charger", refusal.charger, moment) if refusal else None
        if refusal is not None and isinstance(found, ChargerFacts):
            found.refused(moment, refusal)

    def _diagnose(self, moment: Moment, status: d.DiagnosticStatus) -> None:
        kind = next((pair.value for pair in status.values if pair.key == "kind"), "")
        of_daemon = status.name == f"{status.hardware_id}: daemon"
        if kind == "charger_coordinator" and not of_daemon:
            values = {pair.key: pair.value for pair in status.values}
            self._coordinator = moment, values
            return
        device = kind.removesuffix("_supervisor")
        for known in MAKES:
            found = self._devices.get((known, status.hardware_id)) if known == device else None
            if found is not None:
                found.diagnose(moment, status, kind)

    def _note(self, moment: Moment, own: Own) -> None:
        note = noted(own.topic.rpartition("/")[2], own.text)
        for kind in MAKES:
            found = self._devices.get((kind, note.subject)) if note else None
            if found is not None and note is not None:
                found.note(moment, note)

    def _coordinates(self) -> Mapping[str, str]:
        if self._coordinator is None or self._now.at - self._coordinator[0].at > SILENT_S:
            return {}
        return self._coordinator[1]

    def _stepped(self, clock: Clock) -> tuple[str, ...]:
        return tuple(
            f"At {clock.time(moment.wall)} the listener's clock was stepped by {by_s:+.0f} s."
            for moment, by_s in self._steps
        )


def _before(device: Device, clock: Clock) -> str:
    """What came before, in one sentence; "" if nothing did."""
    match device:
        case LiftFacts() if device.rides.ended:
            rides = device.rides
            longest = ""
            if rides.longest_at is not None:
                longest = (
                    f"; the longest wait for the car was {lasted(rides.longest_s)}, of"
                    f" {rides.longest_who} until {clock.time(rides.longest_at.wall)}"
                )
            return f"{_count(rides.ended, 'ride')} ended in this time{longest}."
        case DoorFacts() if device.passages:
            return f"{_count(device.passages, 'hold')} ended in this time."
        case ChargerFacts() if device.charges:
            return f"{_count(device.charges, 'charge')} began in this time."
    return ""


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
