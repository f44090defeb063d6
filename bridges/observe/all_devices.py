"""All observed devices of a graph. The number of devices is bounded, even if somebody on the network
invents names."""

from collections import OrderedDict, deque
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar, Generic, TypeVar

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.heard import Heard, Own
from bridges.observe.alarms import ObservedAlarm, PublishedAlarms, alarms
from bridges.observe.charger import ObservedCharger
from bridges.observe.device import ObservedDevice
from bridges.observe.diagnosis import SIMULATED, Diagnosis, about, of_node, report
from bridges.observe.door import ObservedDoor
from bridges.observe.lift import END, ObservedLift
from bridges.observe.limits import (
    FORGOTTEN_S,
    MOST_DAEMONS,
    MOST_DEVICES,
    MOST_SPEAKERS,
    SILENT_S,
    STEP_S,
)
from bridges.observe.news import News
from bridges.observe.requesters import Moment
from bridges.observe.workcell import ObservedDispenser, ObservedIngestor

AnyDevice = ObservedDevice[Any]
D = TypeVar("D", bound=AnyDevice)
Key = tuple[words.Kind, str]
"""A device's kind, and its name on the graph."""


class ObservedGraph(Generic[D]):
    """All observed devices of RMF's ROS graph.

    `known` maps a kind and a name to the device. For each kind, `known` has at most `most` devices.
    Above this number, only a device that publishes states is added. The new device replaces a device
    that has no states, or whose states stopped FORGOTTEN_S ago.

    - `crowded`: the kinds of which a device could not be added
    - `steps`: the times at which the listener's wall clock was set, and the change (s) each time
    - `nodes`: the reports of our daemons and coordinators on themselves, by the name `<node>: <device>`
    - `published`: the alarms that nodes have published
    - `spoke`: the time of the last message of each fleet adapter. The key is `FLEET/ROBOT` for a
      robot's request, `FLEET` for the end of a robot's request, and `FLEET/` for a state of the fleet.
    """

    makes: ClassVar[Mapping[words.Kind, Callable[[str, Moment], Any]]]

    def __init__(self, most: int = MOST_DEVICES) -> None:
        self.known: dict[Key, D] = {}
        self.began: Moment | None = None
        self.now = Moment(0.0, 0.0)
        self.steps: list[tuple[Moment, float]] = []
        self.crowded: set[words.Kind] = set()
        self.nodes: dict[str, Diagnosis] = {}
        self.published = PublishedAlarms()
        self.spoke: OrderedDict[str, Moment] = OrderedDict()
        self._most = most
        self._offset: float | None = None
        self._heartbeat: Heard | None = None
        self._full_until: dict[tuple[words.Kind, bool], float] = {}

    def hear(self, heard: Heard) -> list[tuple[D, list[News]]]:
        """Take a message. Return the devices that the message is about, with the news of each
        device."""
        moment, message = self.moment(heard), heard.message
        topic = heard.topic.rpartition("/")[2]
        if isinstance(message, d.SupervisorHeartbeat):
            self._heartbeat = heard
        if isinstance(message, d.DiagnosticArray):
            return [*self._diagnosed(message, moment)]
        self._speaks(topic, message, moment)
        self.published.hear(heard, moment, self.began.at if self.began else 0.0)
        found = [*self._about(message, moment)]
        if isinstance(message, words.Stated):
            for device in found:
                device.published_by(heard.sender, moment)
        return [(device, device.hear(moment, topic, message)) for device in found]

    def _speaks(self, topic: str, message: d.Message, moment: Moment) -> None:
        match message:
            case d.FleetState():
                who, ends = f"{message.name}/", False
            case d.LiftRequest() if topic == "adapter_lift_requests":
                who, ends = message.session_id, message.request_type == END
            case d.DoorRequest() if topic == "adapter_door_requests":
                opens = message.requested_mode.value == d.DoorModeValue.MODE_OPEN
                who, ends = message.requester_id, not opens
            case _:
                return
        self.spoke.pop(who, None)
        said = who.rpartition("/")[0] if ends else who
        self.spoke[said] = moment
        self.spoke.move_to_end(said)
        if len(self.spoke) > MOST_SPEAKERS:
            self.spoke.popitem(last=False)

    def moment(self, heard: Heard | Own) -> Moment:
        """Return the message's time. If a recording has the messages out of order, return the latest
        time so far."""
        at = heard.at if self.began is None else max(heard.at, self.now.at)
        offset = heard.wall - heard.at
        if self.began is None:
            self.began = Moment(at, heard.wall, seen=False)
        by_s = offset - (offset if self._offset is None else self._offset)
        if abs(by_s) > STEP_S and len(self.steps) < 3:
            self.steps.append((Moment(at, heard.wall), by_s))
        self._offset = offset
        self.now = Moment(at, heard.wall)
        return self.now

    def pass_time(self, at: float, wall: float) -> None:
        """Advance the present time while no message arrives."""
        self.now = Moment(max(at, self.now.at), wall)
        self.began = self.began or Moment(at, wall, seen=False)

    def stated(self, kind: words.Kind | None = None) -> list[D]:
        """List the devices of this kind that have published a state. The order is that of their first
        messages."""
        every = self.known.values()
        return [one for one in every if kind in (None, one.kind) and one.state is not None]

    def alarms(self) -> list[ObservedAlarm]:
        """Return the alarms of all nodes, as of the last message."""
        return [*alarms(self.nodes, self.published, self.now.at)]

    def daemon_of(self, said: Diagnosis) -> Diagnosis | None:
        """Return what the daemon behind this report said of itself at that time; None if unknown."""
        daemon = self.nodes.get(f"{said.name.partition(': ')[0]}: daemon")
        return daemon if daemon and daemon.is_current(said.last.at) else None

    def simulated(self, said: Diagnosis) -> bool:
        """Return whether the daemon behind this report moves no hardware."""
        daemon = self.daemon_of(said)
        if daemon is None:
            return False
        # A fault of the daemon takes the place of SIMULATED in its message.
        return daemon.value("simulated") == "yes" or SIMULATED in daemon.message

    def is_simulated(self, device: AnyDevice) -> bool:
        """Return whether the device's own daemon moves no hardware, as of the device's last state."""
        return any(said.kind == device.kind and self.simulated(said) for said in device.said)

    def make(self, kind: words.Kind, name: str) -> D:
        """Make a device that has not yet heard a message."""
        made: D = self.makes[kind](name, self.began or self.now)
        return made

    def _diagnosed(
        self, message: d.DiagnosticArray, moment: Moment
    ) -> Iterator[tuple[D, list[News]]]:
        for status in message.status:
            if of_node(status):
                late = self.began is not None and moment.at - self.began.at > SILENT_S
                seen = status.name in self.nodes or late
                if node := report(self.nodes, MOST_DAEMONS, status, moment):
                    deque(node.take(Moment(moment.at, moment.wall, seen), status), 0)
            elif (key := about(status)) in self.known:
                yield self.known[key], self.known[key].diagnose(moment, status)

    def _about(self, message: d.Message, moment: Moment) -> Iterator[D]:
        if isinstance(message, d.SupervisorHeartbeat):
            yield from (one for one in self.known.values() if one.kind == "door")
        elif isinstance(message, words.Stated | words.Requested | words.WorkcellResulted):
            stated = isinstance(message, words.Stated)
            found = self.device(words.kind(message), words.device(message), moment, stated=stated)
            if found is not None:
                yield found

    def device(
        self, kind: words.Kind, name: str, moment: Moment, *, stated: bool = False
    ) -> D | None:
        """Return the device of this name. If the device is unknown, add a new device. Return None if
        there is no room for a new device."""
        found = self.known.get((kind, name))
        if found is not None or not name:
            return found
        if not self._makes_room(kind, moment.at, stated=stated):
            self.crowded |= {kind} if stated else set()
            return None
        made = self.known[kind, name] = self.make(kind, name)
        if self._heartbeat is not None:  # the next heartbeat may come late: only after a request
            at, wall = self._heartbeat.at, self._heartbeat.wall
            made.hear(Moment(at, wall, seen=False), "", self._heartbeat.message)
        return made

    def _makes_room(self, kind: words.Kind, now: float, *, stated: bool) -> bool:
        if now <= self._full_until.get((kind, stated), float("-inf")):
            return False
        of_kind = [one for one in self.known.values() if one.kind == kind]
        if len(of_kind) < self._most:
            return True
        oldest = min(of_kind, key=_heard_at)
        until = _heard_at(oldest) + FORGOTTEN_S if stated else now + SILENT_S
        if now <= until:
            self._full_until[kind, stated] = until
            return False
        del self.known[oldest.kind, oldest.id]
        return True


def _heard_at(device: AnyDevice) -> float:
    """Return the time (s) of the device's last state."""
    return device.last_state.at if device.last_state else float("-inf")


class PlainGraph(ObservedGraph[AnyDevice]):
    """Every device, with only the facts that this package observes."""

    makes: ClassVar = {
        "lift": ObservedLift,
        "door": ObservedDoor,
        "charger": ObservedCharger,
        "dispenser": ObservedDispenser,
        "ingestor": ObservedIngestor,
    }
