"""The timeline of one device as lanes, for `plot` and the web page.

A lane has one or more rows, such as one row for each relay. The spans of a row never overlap. Times are
on `Heard.at`'s clock. The numbers of lanes, rows and spans are limited. Each row keeps its newest
spans, and each lane keeps the rows with the latest news. `left_out` counts the dropped parts.

For a live page, `Drawing` grows message by message. For a whole recording, `lanes` draws once. Both
return a `Timeline` of plain values, which `dataclasses.asdict` converts for JSON.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from bridges.kinds.charger import refusals
from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.heard import Heard, Own
from bridges.messages.words import Kind
from bridges.observe.device import reading_age
from bridges.observe.diagnosis import Diagnosis, about, report
from bridges.observe.door import CROSSES_S, listed
from bridges.observe.door import SUPERVISOR as DOOR_SUPERVISOR
from bridges.observe.limits import MOST_NODES, REQUESTER_SILENT_S, STEP_S
from bridges.observe.requesters import Moment
from workbench.explain.noted import levels, noted
from workbench.explain.rows import LaneRow, label
from workbench.explain.state_tones import tone
from workbench.explain.timeline import LANES, Lane, LaneName, Level, Timeline, Tone

MOST_ROWS: Final = 12
"""Maximum number of a lane's rows. Without a maximum, made-up requesters or faults could fill the
page."""
STAMP: Final = "stamp"
"""Name of a row in lane `faults`. The row shows states whose stamps are too old."""
AGES: Final = {
    "": "",
    "was never read": "never read",
    "is old": "the reading is old",
    "is from the future": "the stamp is in the future",
}
SUPERVISOR: Final = "supervisor"
"""Name of a row in lane `requests`. The row shows the supervisor's requests to the device's own
daemon."""


def lanes(
    heard: Iterable[Heard | Level | Own],
    kind: Kind,
    device: str,
    from_s: float = float("-inf"),
    to_s: float = float("inf"),
) -> Timeline:
    """Return the timeline of a recording between two times. `heard` must be in the order of time."""
    drawing = Drawing(kind, device)
    for one in heard:
        if one.at > to_s:
            break
        drawing.take(one)
    return drawing.timeline(from_s, to_s)


class Drawing:
    """A growing timeline of one device. `Drawing` forgets spans that ended more than `past_s` (s)
    ago."""

    def __init__(self, kind: Kind, device: str, past_s: float = float("inf")) -> None:
        self._kind: Kind = kind
        self._device = device
        self._past_s = past_s
        self._began_at: float | None = None
        self._now = float("-inf")
        self._wall = 0.0
        self._steps = LaneRow()
        self._rows: dict[LaneName, dict[str, LaneRow]] = {name: {} for name in LANES}
        self._left_out = 0
        self._noted: set[str] = set()
        self._destination = ""
        self._heartbeat_at = float("-inf")
        self._on: dict[tuple[str, str], str] = {}
        self._said: dict[str, Diagnosis] = {}

    def take(self, heard: Heard | Level | Own) -> None:
        """Take the next message. If a recorded message is out of order, use the time of the message
        before."""
        if isinstance(heard, Own):
            note = noted(heard.topic.rpartition("/")[2], heard.text)
            if note is not None and note.subject == self._device:
                for level in levels(heard.at, note, self._on):
                    self.take(level)
            return
        self._now = max(self._now, heard.at)
        if self._began_at is None:
            self._began_at = self._now
        match heard:
            case Level():
                self._note(heard)
            case Heard():
                self._clock(heard)
                self._hear(heard.topic.rpartition("/")[2], heard.message, heard.wall)

    def timeline(self, from_s: float = float("-inf"), to_s: float = float("inf")) -> Timeline:
        """Return the timeline between these times, but no later than the last message."""
        if self._began_at is None:
            return Timeline(self._kind, self._device, 0.0, 0.0, 0.0, ())
        to_s = max(self._began_at, min(to_s, self._now))
        from_s = min(to_s, max(from_s, self._began_at))
        drawn = tuple(self._drawn(from_s, to_s))
        steps = tuple(self._steps.marks(from_s, to_s))
        wall = self._wall + from_s
        return Timeline(self._kind, self._device, from_s, to_s, wall, drawn, steps, self._left_out)

    def _drawn(self, from_s: float, to_s: float) -> Iterator[Lane]:
        for name in LANES:
            for part, row in self._rows[name].items():
                spans, marks = tuple(row.spans(from_s, to_s)), tuple(row.marks(from_s, to_s))
                if spans or marks:
                    yield Lane(name, part, spans, marks, row.left_out)

    def _clock(self, heard: Heard) -> None:
        """Compare the wall clock with the steady clock. If the wall clock was stepped, mark the
        step."""
        offset = heard.wall - heard.at
        if self._wall and abs(offset - self._wall) > STEP_S:
            self._steps.mark(
                self._now, f"the clock was stepped by {offset - self._wall:+.0f} s", "wrong"
            )
        self._wall = offset

    def _row(
        self,
        lane: LaneName,
        part: str = "",
        keeps_s: float = REQUESTER_SILENT_S,
        *,
        fills: bool = False,
    ) -> LaneRow:
        """Return the row of this name. If the lane is full, drop the row that was silent for the
        longest time."""
        rows, part = self._rows[lane], label(part)
        if part not in rows:
            if len(rows) >= MOST_ROWS:
                del rows[min(rows, key=lambda one: rows[one].heard_at)]
                self._left_out += 1
            rows[part] = LaneRow(keeps_s, fills=fills, past_s=self._past_s)
        return rows[part]

    def _say(self, lane: LaneName, text: str, looks: Tone) -> None:
        """Set the value of a lane that has only one row. The value comes from a state message."""
        self._row(lane, fills=True).say(self._now, label(text), looks)

    # ---- our daemon's notes

    def _note(self, level: Level) -> None:
        if level.lane not in self._noted:  # clear the less exact values from diagnostics
            self._noted.add(level.lane)
            self._rows[level.lane].clear()
        looks: Tone = "wrong" if level.lane == "faults" else "works"
        row = self._row(level.lane, level.name, keeps_s=float("inf"))
        row.say(self._now, label(level.value), looks)

    # ---- messages heard

    def _hear(self, topic: str, message: d.Message, wall: float) -> None:
        match message:
            case d.LiftState() | d.DoorState() | d.ChargerState():
                if self._is_it(message):
                    self._state(message, wall)
            case d.LiftRequest() | d.DoorRequest() | d.ChargerRequest() | d.ChargerCancel():
                if self._is_it(message):
                    self._request(topic, message)
            case d.SupervisorHeartbeat() if self._kind == "door":
                self._heartbeat(message)
            case d.DiagnosticStatus():
                self._refusal(message)
            case d.DiagnosticArray():
                for status in message.status:
                    self._diagnosis(status)

    def _is_it(self, message: words.Stated | words.Requested) -> bool:
        return (words.kind(message), words.device(message)) == (self._kind, self._device)

    def _state(self, state: words.Stated, wall: float) -> None:
        self._age(words.stamped_at(state), wall)
        match state:
            case d.LiftState():
                self._lift(state)
            case d.DoorState():
                mode = state.current_mode.value
                self._say("door", words.plain(d.DoorModeValue, mode), tone(d.DoorModeValue, mode))
            case d.ChargerState():
                said = words.plain(d.ChargerStateValue, state.state)
                text = f"{said}: {state.error_message}" if state.error_message else said
                self._say("sessions", words.holder(state), "held")
                self._say("mode", text, tone(d.ChargerStateValue, state.state))

    def _age(self, stamped_at: float, wall: float) -> None:
        """Show a problem of the reading as a fault of its own: old, never read, or a stamp from the
        future."""
        text = AGES[reading_age(stamped_at, wall)]
        if text or STAMP in self._rows["faults"]:
            self._row("faults", STAMP).say(self._now, text, "wrong")

    def _lift(self, state: d.LiftState) -> None:
        floor, door = state.current_floor, state.door_state
        motion, mode = state.motion_state, state.current_mode
        runs = tone(d.LiftMotion, motion)
        self._say("sessions", state.session_id, "held")
        self._say("floors", floor or "?", _floor(floor, runs))
        self._say("door", words.plain(d.LiftDoor, door), tone(d.LiftDoor, door))
        self._say("motion", words.plain(d.LiftMotion, motion), runs)
        self._say("mode", words.word(d.LiftMode, mode), tone(d.LiftMode, mode))
        if state.destination_floor not in ("", self._destination):
            to = label(f"to {state.destination_floor}")
            self._row("floors", fills=True).mark(self._now, to, "asks")
        self._destination = state.destination_floor

    def _request(self, topic: str, message: words.Requested) -> None:
        """Fill a row for each requester. Fill another row for the supervisor, which forwards
        requests."""
        match message:
            case d.LiftRequest():
                ends = message.request_type == d.LiftRequestType.REQUEST_END_SESSION
                passed_on, who = topic == "lift_requests", message.session_id
                text = "END" if ends else message.destination_floor or "no floor"
            case d.DoorRequest():
                ends = message.requested_mode.value != d.DoorModeValue.MODE_OPEN
                passed_on, who = topic == "door_requests", message.requester_id
                text = words.plain(d.DoorModeValue, message.requested_mode.value)
                late = self._now - self._heartbeat_at > CROSSES_S
                if passed_on and ends and who == DOOR_SUPERVISOR and late:
                    self._hold(set())
            case d.ChargerRequest():
                ends, passed_on = False, False
                who, text = f"{message.fleet_name}/{message.robot_name}", message.request_id
            case d.ChargerCancel():
                ends, passed_on, who, text = True, False, "cancel", message.request_id
        if passed_on and who != DOOR_SUPERVISOR:
            text = f"{text} for {who}"
        row = self._row("requests", SUPERVISOR if passed_on else who)
        once = isinstance(message, d.ChargerRequest | d.ChargerCancel)
        row.say(self._now, "" if ends or once else label(text), "asks")
        if ends or once:
            row.mark(self._now, label(text), "asks")

    def _refusal(self, status: d.DiagnosticStatus) -> None:
        refusal = refusals.read(status)
        if refusal is not None and (self._kind, refusal.charger) == ("charger", self._device):
            row = self._row("requests", refusal.robot)
            row.mark(self._now, label(f"refused: {refusal.text}"), "wrong")

    def _heartbeat(self, message: d.SupervisorHeartbeat) -> None:
        """Fill a row for each session in the door supervisor's heartbeat.

        RMF's own supervisor sends a heartbeat only after requests. Therefore a session lasts until a
        heartbeat omits the session, or the supervisor sends CLOSE.
        """
        self._heartbeat_at = self._now
        self._hold(set(map(label, listed(message, self._device))))

    def _hold(self, holders: set[str]) -> None:
        for who in holders:
            self._row("sessions", who, keeps_s=float("inf")).say(self._now, who, "held")
        for who, row in self._rows["sessions"].items():
            if who not in holders:
                row.say(self._now, "", "held")

    def _diagnosis(self, status: d.DiagnosticStatus) -> None:
        """Fill the fault rows. A device and its supervisor may report the same fault. The fault lasts
        as long as one of the two reports the fault."""
        now = Moment(self._now, self._wall + self._now)
        ours = about(status) == (self._kind, self._device)
        said = report(self._said, MOST_NODES, status, now) if ours else None
        if said is None:
            return
        news = [*said.take(now, status)]
        if "faults" not in self._noted:
            last = {code for one in self._said.values() for code in one.faults}
            over = {one.text for one in news if one.what == "fault over"} - last
            on = {code: said.values.get(code) or code for code in said.faults}
            self._levels("faults", on, over)
        if "relays" not in self._noted and "outputs" in said.values:
            on = dict(_outputs(said.values["outputs"]))
            self._levels("relays", on, self._rows["relays"].keys() - on.keys())

    def _levels(self, lane: LaneName, on: Mapping[str, str], over: Iterable[str]) -> None:
        looks: Tone = "wrong" if lane == "faults" else "works"
        for name, text in on.items():
            self._row(lane, name).say(self._now, label(text), looks)
        for name in over:
            self._row(lane, name).say(self._now, "", looks)


def _floor(floor: str, runs: Tone) -> Tone:
    """Return the tone (the meaning of the colour) of a floor. `runs` is the tone of the car's motion.
    If a lift does not report motion, a known floor means that the car stands."""
    if not floor:
        return "unknown"
    return "works" if runs == "works" else "calm"


def _outputs(told: str) -> Iterator[tuple[str, str]]:
    """Yield each output and its value from a status text, such as `agv_request yes, call L3`
    (`bridges.system.log.plain`)."""
    for part in told.split(", ") if told != "-" else ():
        name, _, value = part.partition(" ")
        if value != "0":  # a counter with the value 0 is off
            yield name, value
