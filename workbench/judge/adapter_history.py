"""The history of a fleet adapter: the requests of its robots to lifts and doors, and the states of
these lifts and doors."""

from collections import deque
from copy import copy
from dataclasses import dataclass, field
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import topics, words
from bridges.messages.heard import Heard
from bridges.messages.stamps import in_seconds
from bridges.observe.all_devices import AnyDevice, PlainGraph
from bridges.observe.door import ObservedDoor
from bridges.observe.lift import END, HAZARDS, ObservedLift
from bridges.observe.limits import GIVEN_UP_S, REQUESTER_SILENT_S, SLOWEST_S
from bridges.observe.requesters import DeviceRequester, Moment
from workbench.judge.history import NOT_YET, REMEMBERED, AnyHistory, keep

IGNORED: Final = 5
"""Number of states in a row after which an adapter counts as not answering, although its fleet is
heard. Lost messages cannot explain so many states without a request."""
ALARMS_S: Final = 60.0
"""Time (s) after the start or end of an alarm in which robots may change their route."""
BACK_S: Final = 0.5
AGAIN: Final = 2
"""Number of breaches in a row that count. A restart of the adapter or a step of its clock may explain
one breach, but not so many."""
PACE_S: Final = 0.5
MISSED: Final = 3
SLOW_S: Final = 3.2
"""A gap (s) between two requests of a wait that is longer than two lost requests explain."""
SPAM: Final = 5
"""Number of needless ENDs that is a breach, if they come at the pace of the lift's states."""
ADAPTERS: Final = (topics.ADAPTER_LIFT_REQUESTS.name, topics.ADAPTER_DOOR_REQUESTS.name)


@dataclass(slots=True)
class Wish(DeviceRequester):
    """One robot's visit to one device, from its first request to END or CLOSE.

    - `met`: when a state after the latest request first fulfilled all of RMF's conditions.
    - `whole`: whether the visit was heard from its beginning.
    - `inside`: whether the robot is in the car, because it requested another floor after `met`.
    - `came_from`: the floor that the robot requested before.
    - `held_at`: when a state last showed the robot's session.
    - `device`: the device that the robot visits.
    - `matched`: since when every state has fulfilled all of RMF's conditions for the latest request.
    - `paced`: number of repeats of the latest request after a state, or after PACE_S.
    - `unanswered`: number of states since the latest request.
    - `slow`, `slow_s`: number and time (s) of the gaps between repeats that are longer than SLOW_S.
    - `served`: whether a state may have fulfilled the latest request: the door was open, or the wish
      was met. The heartbeat that lists a robot may be lost.
    - `left`: whether the robot has used another device, or the door has closed, after `met`.
    - `named`: whether the publisher of the latest request is known.
    - `ignored`: number of states in a row without a request by the robot, although its fleet was heard.
    - `ignored_since`: when the first of these states came.
    - `lapsed`: whether the adapter ignored IGNORED states in this wait.
    - `proven`: whether the robot still waited then, as its session or a later request shows.
    - `spare`: times of the latest ENDs after the last state that showed the robot's session.
    - `passed`: whether the visit counts as a passage without CLOSE.
    - `visits`: the kind of device and the robot's name, as a key for `AdapterHistory.lapses`.
    """

    whole: bool = False
    inside: bool = False
    came_from: str = ""
    held_at: float = NOT_YET
    ignored: int = 0
    ignored_since: float = NOT_YET
    lapsed: bool = False
    proven: bool = False
    device: AnyDevice | None = None
    matched: Moment | None = None
    paced: int = 0
    unanswered: int = 0
    slow: int = 0
    slow_s: float = 0.0
    served: bool = False
    left: bool = False
    named: bool = False
    spare: deque[float] = field(default_factory=lambda: deque(maxlen=SPAM))
    passed: bool = False
    visits: str = ""

    def ignored_s(self, now: float) -> float:
        """Return the time (s) for which the robot has sent no request although states came. Return 0
        for fewer than IGNORED states."""
        return now - self.ignored_since if self.ignored >= IGNORED else 0.0

    @property
    def repeated(self) -> bool:
        """Return whether the adapter has repeated the latest request without a long gap."""
        return self.paced >= AGAIN and not (self.slow or self.lapsed)


class AdapterHistory(AnyHistory):
    """The history of one fleet adapter. A visit is a robot's use of one device (`Wish`).

    Other nodes also send END for a fleet's robots: rmf-web does so for every known robot (rmf-web
    PR#808), and `rmf-bridge release` for the holder. Therefore only requests of the fleet's adapter
    count, if the wire names the publishers. The adapter has asked for a robot's lift or door. If one of
    several such nodes also publishes the fleet's states, this node is the adapter.

    - `name`: a fleet, or fleet/robot.
    - `device`: the device that the latest request names.
    - `wish`: the visit to which the latest request belongs.
    - `was`: a copy of this visit from before the request.
    - `stated`: the visits to the device that published the latest state.
    - `met`: the visits whose wish was met since the last check.
    - `listed`: the robots in the fleet's states. `present`: the robots in the latest of these states.
    - `lists`: number of fleet states heard.
    - `back`: when the stamps of the latest request's kind and robot last went back (AGAIN times).
    - `lapses`: `Wish.visits` -> number of waits in a row in which the adapter ignored IGNORED states.
    - `overstays`: robot -> number of passages in a row in which OPEN was repeated for SLOWEST_S after
      the door was open for the robot.
    - `unclosed`: robot -> number of passages in a row without CLOSE.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.fleet = name.partition("/")[0]
        self.graph = PlainGraph()
        self.device: AnyDevice | None = None
        self.wish: Wish | None = None
        self.was: Wish | None = None
        self.stated: list[Wish] = []
        self.listed: set[str] = set()
        self.present: set[str] = set()
        self.lists = 0
        self.stamped = self.stepped = False
        self.back: deque[float] = deque(maxlen=AGAIN)
        self._backs: dict[str, deque[float]] = {}
        self.lapses: dict[str, int] = {}
        self.unclosed: dict[str, int] = {}
        self.met: list[Wish] = []
        self.overstays: dict[str, int] = {}
        self._wishes: dict[str, Wish] = {}
        self._asking: dict[str, None] = {}
        self._stating: dict[str, None] = {}
        self._tasks: dict[str, tuple[str, float]] = {}
        self._stamps: dict[str, tuple[float, deque[d.Message]]] = {}
        self._alarms: dict[tuple[str, ...], bool] = {}
        self._began = self._alive_at = self._alarm_at = NOT_YET

    def take(self, heard: Heard, own: bool = False) -> bool:
        """Take a message of any device or fleet."""
        if heard.at - self._any_at > SLOWEST_S:
            self._forget(heard.at)
        self._begin(heard, own)
        self.wish = self.was = None
        self.stated = []
        message, moment = heard.message, Moment(heard.at, heard.wall)
        if isinstance(message, d.LiftRequest | d.DoorRequest):
            if heard.topic in ADAPTERS and (
                self._is_of_another(heard, message) or self._is_replayed(message)
            ):
                return False
        elif isinstance(message, d.FleetState):
            if heard.sender and heard.sender.node and message.name == self.fleet:
                keep(self._stating, heard.sender.node, None)
        else:
            self._other_at = heard.at
        found = [device for device, _ in self.graph.hear(heard)]
        match message:
            case d.FleetState():
                self._list(message)
            case d.EmergencySignal():
                self._hear_alarm(message.fleet_names, message.is_emergency)
            case d.Bool():
                self._hear_alarm(("", heard.topic), message.data)
            case d.LiftRequest() | d.DoorRequest() if found and heard.topic in ADAPTERS:
                named = bool(heard.sender and heard.sender.node)
                return self._ask(found[0], message, moment, named)
            case d.LiftState() | d.DoorState() if found:
                return self._show(found[0], moment)
            case d.SupervisorHeartbeat():
                for device in found:
                    self._meet(device, moment)
        return False

    def checked(self) -> None:
        """Forget how long the network was silent, after the laws have checked the latest message."""
        self.network_s = 0.0
        self.met = []

    def is_ours(self, who: str) -> bool:
        """Return whether this requester is the judged robot, or a robot of the judged fleet."""
        return who == self.name or who.startswith(f"{self.name}/")

    def excused(self, wish: Wish) -> bool:
        """Return whether the robot may change its route. A hazard, an alarm, or a new task since the
        robot's request is a good reason."""
        state = wish.device.state if wish.device else None
        hazard = isinstance(state, d.LiftState) and state.current_mode in HAZARDS
        alarm = any(self._alarms.values()) or self.now - self._alarm_at < ALARMS_S
        return hazard or alarm or self._tasked_at(wish) >= wish.since.at

    def _tasked_at(self, wish: Wish) -> float:
        """Return when the robot's present task began."""
        return self._tasks.get(wish.who, ("", NOT_YET))[1]

    def _hear_alarm(self, source: tuple[str, ...], on: bool) -> None:
        if on != self._alarms.get(source, False):
            self._alarm_at = self.now
        if source in self._alarms or len(self._alarms) < REMEMBERED:
            self._alarms[source] = on

    def _forget(self, now: float) -> None:
        """Forget the visits. Nothing was heard on the whole network for a while, so the listener may
        have missed messages."""
        self._began = now
        self._wishes.clear()

    def _list(self, fleet: d.FleetState) -> None:
        if fleet.name != self.fleet:
            return
        self.lists, self._alive_at = self.lists + 1, self.now
        self.present = {f"{fleet.name}/{robot.name}" for robot in fleet.robots}
        for robot in fleet.robots:
            who = f"{fleet.name}/{robot.name}"
            if len(self.listed) < REMEMBERED:
                self.listed.add(who)
            if self._tasks.get(who, ("",))[0] != robot.task_id:
                keep(self._tasks, who, (robot.task_id, self.now))

    # ---- requests

    def _is_of_another(self, heard: Heard, message: d.LiftRequest | d.DoorRequest) -> bool:
        """Return whether another node than the fleet's adapter sent this request. Without a name of the
        publisher nobody knows."""
        node = heard.sender.node if heard.sender else ""
        if node and self.is_ours(_who(message)) and not _ends(message):
            keep(self._asking, node, None)
        adapters = self._asking.keys() & self._stating.keys() or self._asking.keys()
        return bool(node and adapters) and node not in adapters

    def _is_replayed(self, message: d.LiftRequest | d.DoorRequest) -> bool:
        """Return whether this is an old message that its publisher retained for late listeners.
        Otherwise remember the message's stamp."""
        key, at = f"{words.kind(message)} {_who(message)}", in_seconds(message.request_time)
        newest, recent = self._stamps.get(key, (0.0, deque(maxlen=100)))
        older = 0.0 < at < newest - BACK_S
        again = 0.0 < at < newest and message in recent
        if again or (older and self.now - self._began < GIVEN_UP_S):
            return True
        recent.append(message)
        self.stamped, self.stepped = at > 0.0, older
        if isinstance(message, d.LiftRequest) and _ends(message):
            self.stamped, at = False, newest  # perhaps of another node, with another clock
        if at > 0.0:
            keep(self._stamps, key, (at, recent))
        self.back = self._backs.get(key) or deque(maxlen=AGAIN)
        if older and self.stamped:
            self.back.append(self.now)
            keep(self._backs, key, self.back)
        return False

    def _ask(
        self,
        device: AnyDevice,
        message: d.LiftRequest | d.DoorRequest,
        now: Moment,
        named: bool,
    ) -> bool:
        who, ends = _who(message), _ends(message)
        if isinstance(message, d.LiftRequest):
            wants = message.destination_floor
        else:
            wants = words.plain(d.DoorModeValue, message.requested_mode.value)
        if not self.is_ours(who):
            fleet = who.partition("/")[0]
            if fleet != self.fleet and len(self.others) < REMEMBERED:
                self.others.add(fleet)
            return False
        self.states, self._alive_at, self.device = self.states + 1, self.now, device
        key = f"{device.kind} {device.id} {who}"
        old = self._wishes.get(key)
        self.was = copy(old)
        for other in self._wishes.values():
            other.left |= other.who == who and other is not old and other.met is not None
        if old is None or (not ends and self._is_new_visit(device, old)):
            heard_long = now.at - self._began > REQUESTER_SILENT_S
            old = Wish(
                who,
                wants,
                now,
                now,
                now,
                now,
                whole=heard_long and not _holds(device, who),
                visits=f"{device.kind} {who}",
                device=device,
            )
            self._begin_passage(old, device)
            keep(self._wishes, key, old)
        self.wish, old.named = old, named
        self._say(old, "" if ends else wants, now)
        return True

    def _say(self, wish: Wish, wants: str, now: Moment) -> None:
        """Update the visit after a request. `wants` is empty for END and CLOSE."""
        gap_s = now.at - wish.last.at
        self._prove(wish, gap_s > SLOWEST_S and self._tasked_at(wish) < wish.last.at)
        if not wants:
            self._leave(wish)
            wish.ended = wish.ended or now
            wish.spare.append(now.at)
            if isinstance(self.device, ObservedDoor):
                self.unclosed[wish.who] = 0
        elif wants != wish.wants:
            wish.inside = wish.inside or wish.met is not None
            wish.came_from, wish.wants, wish.since, wish.times = wish.wants, wants, now, 0
            wish.met = wish.matched = None
            wish.lapsed = wish.proven = wish.served = False
            wish.paced = wish.slow = 0
            wish.slow_s = 0.0
        elif wish.times and not wish.served:
            wish.paced += wish.unanswered > 0 or gap_s > PACE_S
            timed = isinstance(self.device, ObservedDoor)  # a door's requests come each second
            if gap_s > SLOW_S and (timed or wish.unanswered >= MISSED):
                wish.slow, wish.slow_s = wish.slow + 1, wish.slow_s + gap_s
        wish.times += bool(wants)
        wish.last, wish.ignored, wish.unanswered = now, 0, 0

    def _prove(self, wish: Wish, waited: bool) -> None:
        """Count the wait if the adapter ignored IGNORED states in it, although the robot waited."""
        if wish.lapsed and waited and not wish.proven:
            wish.proven = True
            keep(self.lapses, wish.visits, self.lapses.get(wish.visits, 0) + 1)

    def _leave(self, wish: Wish) -> None:
        """Note how long OPEN was repeated after the door was open for the robot."""
        if isinstance(self.device, ObservedDoor) and wish.met and not wish.ended:
            late = wish.matched is not None and wish.last.at - wish.matched.at > SLOWEST_S
            keep(self.overstays, wish.who, self.overstays.get(wish.who, 0) + 1 if late else 0)

    def _is_new_visit(self, device: AnyDevice, wish: Wish) -> bool:
        silent_s = self.now - wish.last.at
        if wish.ended or not isinstance(device, ObservedLift):
            gone_s = REQUESTER_SILENT_S if wish.served or wish.met else GIVEN_UP_S
            return wish.ended is not None or silent_s > gone_s
        return silent_s > GIVEN_UP_S and not _holds(device, wish.who)

    def _begin_passage(self, begun: Wish, device: AnyDevice) -> None:
        """When the robot asks for a door, count its earlier passages for which no CLOSE was heard."""
        if not isinstance(device, ObservedDoor) or begun.wants != "open":
            return
        for key, wish in self._wishes.items():
            if not key.startswith("door ") or wish.who != begun.who or wish.ended:
                continue
            if wish.met and wish.left and not wish.passed:
                keep(self.unclosed, wish.who, self.unclosed.get(wish.who, 0) + 1)
                wish.passed = True

    # ---- states

    def _of(self, device: AnyDevice) -> list[Wish]:
        begin = f"{device.kind} {device.id} "
        return [wish for key, wish in self._wishes.items() if key == begin + wish.who]

    def _show(self, device: AnyDevice, now: Moment) -> bool:
        holder = device.session.value if isinstance(device, ObservedLift) else ""
        key = f"{device.kind} {device.id} {holder}"
        if self.is_ours(holder) and key not in self._wishes:
            keep(self._wishes, key, Wish(holder, "", now, now, now, now, device=device))
        self.stated = self._of(device)
        before = now.at - device.gap_s
        for wish in self.stated:
            self._count(wish, before)
            opened = isinstance(device, ObservedDoor) and device.mode.value == "open"
            wish.served |= opened
            wish.left |= isinstance(device, ObservedDoor) and wish.met is not None and not opened
            if _holds(device, wish.who):
                wish.held_at = self.now
                wish.spare.clear()
            elif wish.held_at > NOT_YET and self.now - wish.last.at > REQUESTER_SILENT_S:
                wish.ended = wish.ended or now  # we must have missed the END
        self._meet(device, now)
        return bool(self.stated)

    def _count(self, wish: Wish, before: float) -> None:
        """If the robot has sent no request since the previous state, count that state as ignored. A
        restarted adapter knows nothing of a robot that its fleet's states do not list."""
        if wish.last.at >= before or (self.lists and wish.who not in self.present):
            wish.ignored = 0
        elif self._alive_at > before:
            wish.ignored_since = wish.ignored_since if wish.ignored else before
            wish.ignored += 1
        wish.unanswered += 1
        waits = wish.times and not (wish.met or wish.served or wish.ended)
        wish.lapsed |= bool(waits and wish.ignored_s(self.now) > SLOWEST_S)
        holds = wish.device is not None and _holds(wish.device, wish.who)
        self._prove(wish, bool(waits) and holds and wish.ignored > 0)

    def _meet(self, device: AnyDevice, now: Moment) -> None:
        for wish in self._of(device):
            if wish.ended or not device.matches(wish):
                wish.matched = None
                continue
            wish.matched, wish.served = wish.matched or now, True
            if wish.met is None:
                wish.met = now
                self.met.append(wish)
                if wish.repeated:
                    self.lapses[wish.visits] = 0


def _who(message: d.LiftRequest | d.DoorRequest) -> str:
    return message.session_id if isinstance(message, d.LiftRequest) else message.requester_id


def _ends(message: d.LiftRequest | d.DoorRequest) -> bool:
    """Return whether this is END or CLOSE."""
    if isinstance(message, d.LiftRequest):
        return message.request_type == END
    return message.requested_mode.value == d.DoorModeValue.MODE_CLOSED


def _holds(device: AnyDevice, who: str) -> bool:
    return isinstance(device, ObservedLift) and device.session.value == who
