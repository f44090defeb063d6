"""What the page knows of RMF's graph: each device's latest state, and its last ten minutes.

Pure: time comes with each message. Names come from the network, where anybody may make them up, so
everything has a bound, and known devices stay whatever comes later.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics, words
from bridges.messages.heard import Heard
from bridges.messages.topics import AnyTopic
from bridges.messages.words import KINDS, Kind, Requested, Stated
from bridges.runtime import diagnostics
from workbench.explain import site
from workbench.explain.answer import Remedies
from workbench.explain.explanation import Explanation
from workbench.explain.lanes import Drawing
from workbench.explain.timeline import Timeline
from workbench.graph.board import KINDS as KIND_OF
from workbench.graph.board import Board, Device, Row

KEPT_S: Final = 600.0
"""The past that a device's page shows."""
MOST_DEVICES: Final = 300
"""The most devices of each kind; a large hospital has 200 doors."""
MOST_LINES: Final = 100
"""The most story lines of one device. Its view shows forty. With six hundred each a large site takes
150 MB."""
MOST_ROBOTS: Final = 500
UNSEEN_S: Final = 10.0
"""After a longer silence (s) of a charger it is unknown who was there."""
GONE_AFTER_S: Final = 60.0
"""When there is no room, a device that was silent for this long (s) gives way to a new one."""

HEARD: Final[tuple[AnyTopic, ...]] = (
    topics.LIFT_STATES,
    topics.DOOR_STATES,
    topics.CHARGER_STATES,
    topics.LIFT_REQUESTS,
    topics.ADAPTER_LIFT_REQUESTS.live(),
    topics.DOOR_REQUESTS,
    topics.ADAPTER_DOOR_REQUESTS,
    topics.CHARGER_REQUESTS,
    topics.CHARGER_CANCELS,
    topics.ADAPTER_CHARGER_REQUESTS,
    topics.ADAPTER_CHARGER_CANCELS,
    topics.CHARGER_REFUSALS,
    topics.DOOR_SUPERVISOR_HEARTBEAT,
    topics.CHARGING_ASSIGNMENTS,
    topics.FLEET_STATES,
    topics.DIAGNOSTICS,
)


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot, as its fleet says. `place`: where the charging schedule sends it."""

    fleet: str
    state: d.RobotState
    at: float
    place: str = ""


@dataclass(frozen=True, slots=True)
class Stands:
    """How long a robot has had a charger (s). `at_least`: it had it when the page began to listen."""

    for_s: float
    at_least: bool


@dataclass(frozen=True, slots=True)
class DeviceView:
    """A device as the page draws it: its row, as `watch` has it, and its last state if it has one.

    `stands`: how long its robot has had a charger.
    """

    row: Row
    state: Stated | None = None
    stands: Stands | None = None


class Site:
    """Everything heard so far, within bounds."""

    def __init__(self, graph: Sequence[str] = ()) -> None:
        """`graph`: the options that name the page's graph, for commands."""
        self._board = Board()
        self._last_at: dict[Device, float] = {}
        self._states: dict[Device, Stated] = {}
        self._drawings: dict[Device, Drawing] = {}
        self._changed: set[Device] = set()
        self._since: dict[str, tuple[str, float, bool]] = {}
        self._robots: dict[tuple[str, str], Robot] = {}
        self._story = site.Site(most_lines=MOST_LINES, graph=graph)
        self.crowded: set[str] = set()
        self._full_until: dict[str, float] = {}
        self.heard_at: float | None = None

    def take(self, heard: Heard) -> None:
        """One message of the graph."""
        self.heard_at = heard.at
        message = heard.message
        if isinstance(message, Stated):
            self._state(heard, message)
        elif isinstance(message, d.FleetState):
            self._fleet(message, heard.at)
        elif isinstance(message, d.DiagnosticArray):
            self._diagnosed(heard, message)
        elif isinstance(message, d.DiagnosticStatus):
            self._about(("charger", message.hardware_id), heard)
        elif isinstance(message, Requested):
            self._about((_kind_of(message), words.device(message)), heard)
        else:
            self._story.take(heard)
            self._heartbeat(heard)
            self._board.take(heard)

    def devices(self, now: float, wall: float) -> list[DeviceView]:
        """All devices, coordinators and scheduled robots. `now`: monotonic s; `wall`: stamps' clock."""
        states = {(kind, words.printable(name)): s for (kind, name), s in self._states.items()}
        rows = self._board.rows(now, wall)
        stands = {("charger", words.printable(name)): self._standing(name) for name in self._since}
        keys = ((row, (row.kind, row.name)) for row in rows)
        return [DeviceView(row, states.get(key), stands.get(key)) for row, key in keys]

    def changed(self, now: float, wall: float) -> list[DeviceView]:
        """The devices that were heard of since this was asked last."""
        changed, self._changed = self._changed, set()
        known = [device for device in sorted(changed) if device in self._states]
        rows = self._board.rows_of(known, now, wall)
        return [
            DeviceView(row, self._states[device], self._standing(device[1]))
            for device, row in zip(known, rows, strict=True)
        ]

    def knows(self, kind: str, name: str) -> bool:
        """Whether the device of this printed name is still known; what has no states always is."""
        return kind not in KINDS or self._found(kind, name) is not None

    def explain(
        self, kind: str, name: str, now: float, wall: float, remedies: Remedies
    ) -> Explanation | None:
        """Why somebody waits for this device, or what it does."""
        device = self._found(kind, name)
        if device is None:
            return None
        self._story.pass_time(now, wall)
        return self._story.explain(_kind(device[0]), device[1], None, remedies)

    def timeline(self, kind: str, name: str, now: float) -> Timeline | None:
        """The last ten minutes of a device; `name` as it is shown."""
        device = self._found(kind, name)
        drawing = self._drawings.get(device) if device else None
        return drawing.timeline(now - KEPT_S) if drawing else None

    def _found(self, kind: str, name: str) -> Device | None:
        if (kind, name) in self._states:
            return (kind, name)
        every = (one for one in self._states if one[0] == kind)
        return next((one for one in every if words.printable(one[1]) == name), None)

    def robots(self) -> list[Robot]:
        """The robots that fleets report, by fleet and name."""
        return [robot for _, robot in sorted(self._robots.items())]

    def _state(self, heard: Heard, state: Stated) -> None:
        device = (KIND_OF[type(state)], words.device(state))
        if device not in self._last_at and not self._room(device[0], heard.at):
            self.crowded.add(device[0])
            return
        if isinstance(state, d.ChargerState):
            self._stood(state, heard.at)
        self._last_at[device], self._states[device] = heard.at, state
        self._board.take(heard)
        self._story.take(heard)
        self._remember(device, heard)

    def _stood(self, state: d.ChargerState, at: float) -> None:
        """Note who has the charger, and since when. What happened while it was silent is unknown."""
        who = f"{state.robot_fleet}/{state.robot_name}" if state.robot_name else ""
        before, _, _ = self._since.get(state.charger_name, ("", 0.0, False))
        last_at = self._last_at.get(("charger", state.charger_name), float("-inf"))
        unseen = at - last_at > UNSEEN_S
        if unseen or before != who:
            self._since[state.charger_name] = who, at, unseen

    def _standing(self, charger: str) -> Stands | None:
        """How long its robot has had the charger, as of the last state."""
        who, since, at_least = self._since.get(charger, ("", 0.0, False))
        last_at = self._last_at.get(("charger", charger), since)
        return Stands(last_at - since, at_least) if who else None

    def _room(self, kind: str, at: float) -> bool:
        if at <= self._full_until.get(kind, float("-inf")):
            return False
        known = [one for one in self._last_at if one[0] == kind]
        if len(known) < MOST_DEVICES:
            return True
        oldest = min(known, key=self._last_at.__getitem__)
        self._full_until[kind] = self._last_at[oldest] + GONE_AFTER_S
        if at <= self._full_until[kind]:
            return False
        for table in (self._last_at, self._states, self._drawings):
            table.pop(oldest, None)
        if kind == "charger":
            self._since.pop(oldest[1], None)
        self._board.forget(*oldest)
        return True

    def _about(self, device: Device, heard: Heard) -> None:
        """A request, a cancel or a refusal. None is kept for a device that does not exist: anybody can
        ask for anything."""
        if device in self._last_at:
            self._story.take(heard)
            self._remember(device, heard)

    def _remember(self, device: Device, heard: Heard) -> None:
        """What the device's timeline shows."""
        if device in self._last_at:
            drawing = self._drawings.get(device)
            if drawing is None:
                drawing = self._drawings[device] = Drawing(_kind(device[0]), device[1], KEPT_S)
            drawing.take(heard)
            self._changed.add(device)

    def _diagnosed(self, heard: Heard, message: d.DiagnosticArray) -> None:
        known = {name for _, name in self._last_at}
        ours = [
            status
            for status in message.status[: diagnostics.MOST + 1]
            if status.hardware_id in known or status.name.endswith(": daemon") or _is_graph(status)
        ]
        kept = replace(heard, message=replace(message, status=tuple(ours)))
        self._board.take(kept)
        self._story.take(kept)
        for status in ours:
            device = _about(status)
            if device:
                alone = replace(message, status=(status,))
                self._remember(device, replace(heard, message=alone))

    def _heartbeat(self, heard: Heard) -> None:
        if not isinstance(heard.message, d.SupervisorHeartbeat):
            return
        listed = {one.door_name: one for one in heard.message.all_sessions}
        for device in self._last_at:
            if device[0] == "door":
                own = (listed[device[1]],) if device[1] in listed else ()
                self._remember(device, replace(heard, message=d.SupervisorHeartbeat(own)))

    def _fleet(self, message: d.FleetState, at: float) -> None:
        for state in message.robots:
            key = (message.name, state.name)
            if key in self._robots or len(self._robots) < MOST_ROBOTS:
                self._robots[key] = Robot(message.name, replace(state, path=()), at)


def _kind(name: str) -> Kind:
    return next(one for one in KINDS if one == name)


def _is_graph(status: d.DiagnosticStatus) -> bool:
    return _kind_in(status).endswith(("supervisor", "coordinator"))


def _about(status: d.DiagnosticStatus) -> Device | None:
    kind = _kind_in(status).removesuffix("_supervisor")
    found = next((known for known in KINDS if known == kind), None)
    return (found, status.hardware_id) if found else None


def _kind_in(status: d.DiagnosticStatus) -> str:
    return next((pair.value for pair in status.values if pair.key == "kind"), "")


def _kind_of(message: Requested) -> str:
    match message:
        case d.LiftRequest():
            return "lift"
        case d.DoorRequest():
            return "door"
        case _:
            return "charger"
