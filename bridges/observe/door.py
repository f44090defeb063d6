"""Observation of a door: its requesters, its last request, and its holders in the supervisor's
heartbeat. It also lists the unmet conditions of RMF's DoorOpen and DoorClose."""

from collections.abc import Iterator
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.stamps import in_seconds
from bridges.observe.device import Check, ObservedDevice, Wait
from bridges.observe.limits import MOST_HOLDERS, REQUESTER_SILENT_S
from bridges.observe.news import News
from bridges.observe.requesters import DeviceRequester, Fact, Moment

OPEN: Final = "open"
CLOSED: Final = "closed"
LISTS: Final = "lists it"
LISTS_NOT: Final = "does not list it"
SUPERVISOR: Final = "door_supervisor"
"""The requester_id of RMF's supervisor (door_supervisor/Node.hpp) and of our supervisor on
`door_requests`."""
CROSSES_S: Final = 0.5
"""The longest time (s) for which a CLOSE may be on its way. A CLOSE that comes so soon after a
heartbeat may be older than the heartbeat."""


def sessions(heartbeat: d.SupervisorHeartbeat, door: str) -> list[d.Session]:
    """List the door's holders in a supervisor's heartbeat (rmf_ros2, SupervisorHasSession.cpp). A
    session has its holder's name, and the stamp of the holder's OPEN."""
    return [
        one for each in heartbeat.all_sessions if each.door_name == door for one in each.sessions
    ]


def listed(heartbeat: d.SupervisorHeartbeat, door: str) -> list[str]:
    """List the names of the door's holders in a supervisor's heartbeat."""
    return [one.requester_id for one in sessions(heartbeat, door)]


def door_open(mode: str, heartbeat: str) -> tuple[Check, ...]:
    """List the conditions of DoorOpen (rmf_ros2, DoorOpen.cpp). `heartbeat`: LISTS if the heartbeat
    lists the requester, otherwise another text."""
    return (
        Check("door", mode, OPEN, mode == OPEN),
        Check("heartbeat", heartbeat, LISTS, heartbeat == LISTS),
    )


def door_close(heartbeat: str) -> tuple[Check, ...]:
    """List the conditions of DoorClose (rmf_ros2, DoorClose.cpp). DoorClose does not look at the door
    itself."""
    return (Check("heartbeat", heartbeat, LISTS_NOT, heartbeat != LISTS),)


class ObservedDoor(ObservedDevice[d.DoorState]):
    """A door, as observed.

    - `holders`: the requesters that the supervisor's heartbeat lists, and the time since when it lists
      each
    - `forgotten`: the requesters that the supervisor has dropped although they sent no CLOSE, and the
      time of that. A restart of the supervisor is the reason.
    - `asked`: the mode that the last request on `door_requests` asks for
    - `sender`: the sender of that request, who last repeated it at `asked_last`
    - `released`: the time when the last holder left, or when `asked` became CLOSED
    - `unanswered`: the first request of an adapter since the supervisor's last message. A living
      supervisor answers a request with a heartbeat within a second.
    - `stamps`: the stamp (s) of each holder's OPEN, by the heartbeat
    """

    kind = "door"

    def __init__(self, name: str, began: Moment) -> None:
        super().__init__(name, began)
        self.mode = Fact("", began)
        self.holders: dict[str, Moment] = {}
        self.forgotten: dict[str, Moment] = {}
        self.last_heartbeat: Moment | None = None
        self.asked: Fact | None = None
        self.asked_last = began
        self.sender = ""
        self.released: Moment | None = None
        self.unanswered: Moment | None = None
        self.stamps: dict[str, float] = {}

    def facts(self, state: d.DoorState) -> dict[str, str]:
        """Return the mode that the state shows."""
        return {"mode": words.plain(d.DoorModeValue, state.current_mode.value)}

    def checks(self, one: DeviceRequester) -> tuple[Check, ...]:
        """List the conditions of this requester's DoorOpen or DoorClose."""
        heartbeat = LISTS if one.who in self.holders else LISTS_NOT
        if self.last_heartbeat is None:
            heartbeat = "not heard"
        return door_open(self.mode.value, heartbeat) if one.wants == OPEN else door_close(heartbeat)

    def asking(self, now: Moment) -> list[DeviceRequester]:
        """List the requesters that still repeat an unfulfilled request, the earliest first."""
        asks = [one for one in self.requesters if one.asks(now) and not self.matches(one)]
        return sorted(asks, key=lambda one: one.since.at)

    def asks_now(self, now: Moment) -> bool:
        """Return whether a node still sends requests on `door_requests`."""
        return self.asked is not None and now.at - self.asked_last.at <= REQUESTER_SILENT_S

    def waits(self, now: Moment) -> Iterator[Wait]:
        """Yield each requester's wait for OPEN, and also a supervisor's wait. If no heartbeat was ever
        heard, a requester's wait ends when the door is open."""
        opened = self.mode.value == OPEN
        for one in self.asking(now):
            if one.wants == OPEN and not (opened and self.last_heartbeat is None):
                yield Wait(one.who, "OPEN", one.since)
        asked = self.asked is not None and self.asked.value == OPEN
        if self.asked and asked and not opened and self.asks_now(now):
            yield Wait(self.sender, "OPEN", self.asked.since)

    def _hear_other(self, moment: Moment, topic: str, message: d.Message) -> Iterator[News]:
        match message:
            case d.DoorRequest():
                yield from self._hear_request(moment, topic, message)
            case d.SupervisorHeartbeat():
                yield from self._hear_heartbeat(moment, message)

    def _hear_request(self, moment: Moment, topic: str, request: d.DoorRequest) -> Iterator[News]:
        wants = words.plain(d.DoorModeValue, request.requested_mode.value)
        who = self.text(request.requester_id)
        if topic == "door_requests":
            self.sender, self.asked_last = who, moment
            if self.asked is None:
                self.asked = Fact(wants, moment)
            elif self.asked.say(wants, moment):
                yield News("passed on", moment, who, wants)
            if wants == CLOSED:
                self.released = self.asked.since
            if who == SUPERVISOR:
                self.unanswered = None
            if wants == CLOSED and who == SUPERVISOR:
                yield from self._told_to_close(moment)
            return
        self.unanswered = self.unanswered or moment
        self.forgotten.pop(who, None)
        one, new = self.requesters.ask(who, wants, moment, stands=self.is_silent(moment))
        one.stamp(moment, request.request_time)
        if new:
            yield News("asks", moment, who, requester=one)

    def _told_to_close(self, moment: Moment) -> Iterator[News]:
        """Drop the holders. A supervisor sends CLOSE only to a door without holders, but RMF's
        supervisor sends a heartbeat only after an adapter's request (door_supervisor/Node.cpp)."""
        last = self.last_heartbeat
        if last is not None and moment.at - last.at > CROSSES_S:
            for who in [*self.holders]:
                yield self._drop(moment, who)

    def _drop(self, moment: Moment, who: str) -> News:
        """Drop a holder. If it sent no CLOSE, the supervisor has forgotten it."""
        one, held_s = self.requesters.get(who), moment.at - self.holders.pop(who).at
        self.released = moment
        if one is not None and one.wants == OPEN:
            if len(self.forgotten) >= MOST_HOLDERS:
                del self.forgotten[next(iter(self.forgotten))]
            self.forgotten[who] = moment
        return News("lost", moment, who, gap_s=held_s)

    def _hear_heartbeat(self, moment: Moment, heartbeat: d.SupervisorHeartbeat) -> Iterator[News]:
        first, self.last_heartbeat = self.last_heartbeat is None, moment
        self.unanswered = None
        held = sessions(heartbeat, self.id)[:MOST_HOLDERS]
        self.stamps = {self.text(one.requester_id): in_seconds(one.request_time) for one in held}
        found = [*self.stamps]
        seen = not first or moment.at - self.began.at > REQUESTER_SILENT_S
        since = Moment(moment.at, moment.wall, seen)
        for who in [who for who in self.holders if who not in found]:
            yield self._drop(moment, who)
        for who in found:
            self.forgotten.pop(who, None)
            if who not in self.holders:
                self.holders[who] = since
                if seen:
                    yield News("has", moment, who)

    def _settle(self, moment: Moment) -> Iterator[News]:
        if self.changed and self.before is not None:
            yield News("changed", moment)
        for one in self.requesters:
            if one.wants == OPEN and one.met is None and self.matches(one):
                one.met = moment
                yield News("met", moment, one.who, requester=one)
            if not one.asks(moment) and one.who not in self.holders and not self._may_hold(one):
                self.requesters.drop(one.who)

    def _may_hold(self, one: DeviceRequester) -> bool:
        """Return whether this silent requester may hold the door, because no heartbeat tells who holds
        it."""
        asked = self.asked is not None and self.asked.value == OPEN
        return asked and self.last_heartbeat is None and one.wants == OPEN
