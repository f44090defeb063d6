"""The page's memory of RMF's graph: each device's latest state, and its last ten minutes.

All functions are pure, because time comes with each message. Anybody on the network may invent names.
Therefore everything has a limit, and a new device never displaces a known device.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import tzinfo
from typing import Final, NamedTuple

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics, words
from bridges.messages.heard import Heard
from bridges.messages.topics import AnyTopic
from bridges.messages.words import KINDS, Kind, Requested, Stated
from bridges.observe.alarms import ObservedAlarm
from bridges.observe.all_devices import Key
from bridges.observe.charger import NOBODY, ObservedCharger
from bridges.observe.diagnosis import FLEET, PANEL, about, kind_in
from bridges.observe.limits import FORGOTTEN_S
from bridges.observe.requesters import Moment
from bridges.observe.robots import robots
from bridges.runtime.diagnostics import MOST
from workbench.explain import heard_devices
from workbench.explain.answer import Remedies
from workbench.explain.device import Device
from workbench.explain.device_timeline import Drawing
from workbench.explain.explanation import Explanation
from workbench.explain.timeline import Timeline
from workbench.graph.board import Board, BoardRow
from workbench.graph.live import OF_DEVICES

KEPT_S: Final = 600.0
"""Length (s) of the past that a device's page shows."""
STEP_S: Final = 10.0
"""Time (s) by which the timeline moves in each step."""
MOST_LINES: Final = 100
"""Maximum number of story lines that the page keeps for a device. A device's view shows forty lines.
With six hundred lines for each device, a large site would take 150 MB."""
MOST_ROBOTS: Final = 500

HEARD: Final[tuple[AnyTopic, ...]] = (
    *OF_DEVICES,
    topics.CHARGING_ASSIGNMENTS,
    topics.FLEET_STATES,
)


@dataclass(frozen=True, slots=True)
class RobotShown:
    """A robot, as its fleet's states describe the robot."""

    fleet: str
    state: d.RobotState
    heard: Moment


@dataclass(frozen=True, slots=True)
class Stands:
    """Time (s) for which a robot has had its charger. `at_least` means that the robot got the charger
    before the page listened."""

    for_s: float
    at_least: bool


@dataclass(frozen=True, slots=True)
class DeviceView:
    """A device ready to be drawn: the row that `watch` shows for it, and its last state, if there is
    one.

    - `stands`: how long the device's robot has had the charger.
    - `heard_wall`: when the device's last state arrived (s since the epoch; 0 means never).
    - `read_wall`: the stamp of that state (s since the epoch; 0 means never).
    """

    row: BoardRow
    state: Stated | None = None
    stands: Stands | None = None
    heard_wall: float = 0.0
    read_wall: float = 0.0


class Running(NamedTuple):
    """A daemon's process: the name of its node, and its process id, as the daemon reports both."""

    node: str
    pid: str


class LiveSite:
    """Everything that the page has heard up to now, within limits."""

    def __init__(self, graph: Sequence[str] = ()) -> None:
        """Begin without messages. `graph` has the command-line options that name the page's graph.
        Commands that the page proposes get these options."""
        self._story = heard_devices.HeardDevices(most_lines=MOST_LINES, graph=graph)
        self._board = Board(self._story)
        self._drawings: dict[Key, Drawing] = {}
        self._changed: set[Key] = set()
        self._robots: dict[tuple[str, str], RobotShown] = {}
        self.heard_at: float | None = None

    @property
    def crowded(self) -> set[Kind]:
        """Return the kinds that have dropped devices, because there were too many."""
        return self._story.crowded

    def take(self, heard: Heard) -> None:
        """Take a message of the graph."""
        self.heard_at = heard.at
        message = heard.message
        if isinstance(message, Stated):
            self._story.take(heard)
            self._remember((words.kind(message), words.device(message)), heard)
        elif isinstance(message, d.FleetState):
            self._fleet(message, Moment(heard.at, heard.wall))
        elif isinstance(message, d.DiagnosticArray):
            self._diagnosed(heard, message)
        elif isinstance(message, d.DiagnosticStatus):
            self._about(("charger", message.hardware_id), heard)
        elif isinstance(message, Requested):
            self._about((words.kind(message), words.device(message)), heard)
        else:
            self._story.take(heard)
            self._heartbeat(heard)
            self._board.note(heard)

    def devices(self, now: float, wall: float) -> list[DeviceView]:
        """Return the devices, the charger coordinators, and the robots that have an assigned charger.

        `now` is the steady clock (s). `wall` is the present time (s since the epoch), by the clock that
        stamps the messages.
        """
        every, rows = self._story.stated(), self._board.rows(now, wall)
        shown = {f"{one.kind} {words.printable(one.id)}": one for one in every}
        return [_view(row, shown.get(f"{row.kind} {row.name}")) for row in rows]

    def changed(self, now: float, wall: float) -> list[DeviceView]:
        """Return the devices that got messages after the last call."""
        changed, self._changed = self._changed, set()
        known = [found for key in sorted(changed) if (found := self._device(key))]
        rows = self._board.rows_of(known, now, wall)
        return [_view(row, device) for row, device in zip(rows, known, strict=True)]

    def explain(
        self,
        kind: str,
        name: str,
        now: float,
        wall: float,
        remedies: Remedies,
        zone: tzinfo | None = None,
    ) -> Explanation | None:
        """Explain a device or robot: why a robot waits for the device, what the device does, or why the
        robot stands. Return None if it is unknown. `zone` is the time zone of the texts."""
        device = self._found(kind, name)
        if device is None and not (kind == "robot" and self._story.robot(name)):
            return None
        self._story.pass_time(now, wall)
        if device is None:
            return self._story.explain("robot", name, zone, remedies)
        return self._story.explain(device.kind, device.id, zone, remedies)

    def alarms(self) -> list[ObservedAlarm]:
        """Return the alarms of all nodes."""
        return self._story.alarms()

    def reporters(self, kind: str, name: str) -> set[Running]:
        """Return the daemons that report on a device or robot on the graph. `name` is printable."""
        device = self._found(kind, name)
        said = [one for one in device.said if one.kind == kind] if device else []
        if kind == "robot":
            said = [one.said for one in robots(self._story.nodes) if one.who == name]
        daemons = filter(None, map(self._story.daemon_of, said))
        return {Running(one.subject[1], pid) for one in daemons if (pid := one.value("pid"))}

    def timeline(self, kind: str, name: str, now: float) -> Timeline | None:
        """Return the last ten minutes of a device. `name` is the device's printable name.

        The end of the timeline is rounded up to a multiple of STEP_S. Thus the picture shifts only once
        in STEP_S, and between two shifts the browser gets only the new parts.
        """
        device = self._found(kind, name)
        drawing = self._drawings.get((device.kind, device.id)) if device else None
        if drawing is None:
            return None
        found = drawing.timeline((now - KEPT_S) // STEP_S * STEP_S)
        return dataclasses.replace(found, to_s=(found.to_s // STEP_S + 1) * STEP_S)

    def _found(self, kind: str, name: str) -> Device | None:
        """Return the device with this printable name."""
        for known in (one for one in KINDS if one == kind):
            every = (one for one in self._story.stated(known) if words.printable(one.id) == name)
            return self._device((known, name)) or next(every, None)
        return None

    def _device(self, key: Key) -> Device | None:
        """Return the device, if it has published a state."""
        found = self._story.known.get(key)
        return found if found is not None and found.state is not None else None

    def robots(self) -> list[RobotShown]:
        """Return the robots in fleet states, sorted by fleet and name."""
        return [robot for _, robot in sorted(self._robots.items())]

    def _about(self, key: Key, heard: Heard) -> None:
        """Take a request, a cancel or a refusal. Drop a message for an unknown device, because anybody
        can send requests with any name."""
        if self._device(key):
            self._story.take(heard)
            self._remember(key, heard)

    def _remember(self, key: Key, heard: Heard) -> None:
        """Remember a message for the device's timeline."""
        if not self._device(key):
            return
        if key not in self._drawings:
            for gone in self._drawings.keys() - self._story.known.keys():
                del self._drawings[gone]
            self._drawings[key] = Drawing(*key, KEPT_S + STEP_S)
        self._drawings[key].take(heard)
        self._changed.add(key)

    def _diagnosed(self, heard: Heard, message: d.DiagnosticArray) -> None:
        known = {one.id for one in self._story.stated()}
        ours = [
            status
            for status in message.status[: MOST + 1]
            if status.hardware_id in known or status.name.endswith(": daemon") or _is_graph(status)
        ]
        kept = replace(heard, message=replace(message, status=tuple(ours)))
        self._story.take(kept)
        for status in ours:
            if device := about(status):
                alone = replace(message, status=(status,))
                self._remember(device, replace(heard, message=alone))

    def _heartbeat(self, heard: Heard) -> None:
        if not isinstance(heard.message, d.SupervisorHeartbeat):
            return
        listed = {one.door_name: one for one in heard.message.all_sessions}
        for door in self._story.stated("door"):
            own = (listed[door.id],) if door.id in listed else ()
            self._remember(("door", door.id), replace(heard, message=d.SupervisorHeartbeat(own)))

    def _fleet(self, message: d.FleetState, now: Moment) -> None:
        """Take a fleet's robots. If the table is full, a new robot replaces the robot that was silent
        for the longest time, but only after a silence of FORGOTTEN_S or more."""
        for state in message.robots:
            key = (message.name, state.name)
            if self._robots.pop(key, None) is None and len(self._robots) >= MOST_ROBOTS:
                longest = next(iter(self._robots))
                if now.at - self._robots[longest].heard.at < FORGOTTEN_S:
                    continue
                del self._robots[longest]
            self._robots[key] = RobotShown(message.name, replace(state, path=()), now)


def _view(row: BoardRow, device: Device | None) -> DeviceView:
    """Return the view to draw. A robot's time at its charger counts only up to the last state heard.
    Thus the time does not grow during a silence."""
    stands = None
    if isinstance(device, ObservedCharger) and device.last_state and device.robot.value != NOBODY:
        since = device.robot.since
        stands = Stands(device.last_state.at - since.at, at_least=not since.seen)
    last = device.last_state.wall if device and device.last_state else 0.0
    read = device.stamped_at if device else 0.0
    return DeviceView(row, device.state if device else None, stands, last, read)


def _is_graph(status: d.DiagnosticStatus) -> bool:
    return kind_in(status).endswith(("supervisor", "coordinator", PANEL, FLEET))
