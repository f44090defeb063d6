"""The door supervisor's core, for one door: who holds it open, and what its node is told.

It stands in for RMF's own (rmf_ros2, door_supervisor/Node.cpp): fleet adapters and web users ask on
`adapter_door_requests`; the door's node is told on `door_requests`, by "door_supervisor". Rules:
1. OPEN enters its requester among the holders, or renews its stamp. CLOSE strikes it off. A request
   older than what its requester has said before (`voice.py`) does neither.
2. OPEN is what the door should hear while anybody holds it, and CLOSE when nobody does. It is sent
   when the last word sent was the other one: OPEN for the first holder, CLOSE when the last one
   goes. It is repeated when a requester repeats OPEN, or when the door's state disagrees: held, but
   CLOSED or MOVING; not held, but OPEN or MOVING. For INSIST_S after a holder has come OPEN is
   repeated at every state: the one sent may be lost, and the door about to close by an earlier CLOSE.
   OFFLINE and UNKNOWN cause nothing.
3. Silence ends nothing: a robot in the doorway is silent. After `open_alarm_s` there is a fault,
   and that is all.
4. Until it may speak, and beside another supervisor, it only listens. It then begins with OPEN for a
   door that somebody holds; with CLOSE only if a state that comes afterwards asks for it.
5. Nothing is sent twice within GAP_S, and nothing again, unchanged, within REPEAT_S.
Who holds the doors is told by the heartbeat, and kept through a restart (`table.py`).
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

import msgspec
from msgspec.structs import replace

from bridges.core.decision import Decision, Fault, OperatorReset
from bridges.core.graph_kind import MaySpeak, Woken
from bridges.door_supervisor.voice import Voice
from bridges.rmf.definitions import DoorMode, DoorModeValue, DoorRequest, Message
from bridges.rmf.topics import DOOR_REQUESTS, Topic

REQUESTER_ID: Final = "door_supervisor"
"""As RMF's own signs (door_supervisor/Node.hpp)."""
GAP_S: Final = 0.1
REPEAT_S: Final = 1.0
INSIST_S: Final = 5.0
SILENT_S: Final = 3.0
"""States come at 1 Hz; after a gap as long as this the door is silent."""
VISIT_S: Final = 2.5
"""A robot that waits for a door repeats itself at 1 Hz; after so much silence it has come again."""
FORGOTTEN_S: Final = 60.0
MAX_REQUESTERS: Final = 200
NEVER: Final = math.inf

CLOSED: Final = DoorModeValue.MODE_CLOSED
MOVING: Final = DoorModeValue.MODE_MOVING
OPEN: Final = DoorModeValue.MODE_OPEN


class Limits(msgspec.Struct, frozen=True):
    """The duration (s) that the site has set."""

    open_alarm_s: float = 600.0


class Opens(msgspec.Struct, frozen=True):
    """A requester's OPEN; `stamp` is its own (ns)."""

    requester: str
    stamp: int


class Closes(msgspec.Struct, frozen=True):
    """A requester's CLOSE; `stamp` is its own (ns)."""

    requester: str
    stamp: int


class Shown(msgspec.Struct, frozen=True):
    """A DoorState."""

    mode: DoorModeValue


Event = Opens | Closes | Shown | MaySpeak | Woken | OperatorReset


class Holder(msgspec.Struct, frozen=True):
    """Who holds the door open: since when by our clock, and the `stamp` of its latest OPEN.

    `asked_at`: when that came. `visit`: the stamp of the first OPEN of its present visit, which does
    not change while it repeats itself.
    """

    requester: str
    since: float
    asked_at: float
    stamp: int
    visit: int

    def asks(self, stamp: int, now: float) -> "Holder":
        """Once more."""
        again = now > self.asked_at + VISIT_S
        return replace(self, asked_at=now, stamp=stamp, visit=stamp if again else self.visit)


class Memory(msgspec.Struct, frozen=True):
    """Everything that outlives an event.

    `holders`: in the order in which they came. `voices`: what was heard of each requester of late.
    `sent`: the last word to the door's node since we may speak; `prompted`: it is worth repeating.
    """

    door: str
    may_speak: bool = False
    holders: tuple[Holder, ...] = ()
    voices: Mapping[str, Voice] = {}
    mode: DoorModeValue | None = None
    shown_at: float = -NEVER
    sent: DoorModeValue | None = None
    sent_at: float = -NEVER
    prompted: bool = False

    @property
    def wanted(self) -> DoorModeValue:
        """What the door's node should hear."""
        return OPEN if self.holders else CLOSED

    @property
    def owed(self) -> bool:
        """The door's node has not been told yet. A CLOSE is owed only where OPEN was sent."""
        return self.wanted != self.sent and (self.wanted == OPEN or self.sent == OPEN)

    @property
    def disagrees(self) -> bool:
        """The door's state is not what is wanted, and it can be changed."""
        return self.mode == MOVING or self.mode == (CLOSED if self.holders else OPEN)

    def holder(self, requester: str) -> Holder | None:
        """This requester, if it holds the door."""
        return next((h for h in self.holders if h.requester == requester), None)


class DoorHoldReport(msgspec.Struct, frozen=True):
    """One door, for the log and the status file. Times are monotonic seconds.

    `holders`: each requester and since when. `mode`: of the door's last state, at `read_at`.
    """

    read_at: float | None
    mode: DoorModeValue | None = None
    holders: tuple[tuple[str, float], ...] = ()
    faults: tuple[Fault, ...] = ()

    def news(self) -> Any:
        """What is worth a line in the log."""
        return self.mode, tuple(requester for requester, _ in self.holders)


Decided = Decision[Memory, None, DoorHoldReport]


def initial(door: str, started_at: float) -> Memory:
    """Nobody was heard of; we may not speak yet."""
    return Memory(door)


def idle(memory: Memory, now: float) -> bool:
    """Nobody holds this door, and nothing has been heard of it in a while."""
    heard = [memory.shown_at, *(voice.heard_at for voice in memory.voices.values())]
    return not memory.holders and now >= max(heard) + FORGOTTEN_S


def decide(memory: Memory, event: Event, now: float, limits: Limits) -> Decided:
    """Take the event in, and send what is due: one message at the most. Never raises."""
    memory, refused = _take(memory, event, now)
    publish: tuple[tuple[Topic[Any], Message], ...] = ()
    if now >= _due_at(memory):
        publish = ((DOOR_REQUESTS, _request(memory)),)
        memory = replace(memory, sent=memory.wanted, sent_at=now, prompted=False)
    return Decision(
        memory,
        None,
        _report(memory, now, limits),
        _wake_at(memory, now, limits),
        refused,
        publish,
    )


# --- what is heard -----------------------------------------------------------------------------


def _take(memory: Memory, event: Event, now: float) -> tuple[Memory, str]:
    match event:
        case Opens() | Closes():
            return _hear(memory, event, now)
        case Shown(mode):
            return _see(replace(memory, mode=mode, shown_at=now), now), ""
        case MaySpeak(yes):
            return replace(memory, may_speak=yes, sent=None, prompted=False), ""
        case _:  # only time has passed
            return memory, ""


def _hear(memory: Memory, event: Opens | Closes, now: float) -> tuple[Memory, str]:
    who, voices = event.requester, _remembered(memory, now)
    if who not in voices and len(voices) >= MAX_REQUESTERS:
        return memory, "too many requesters"
    voice = voices.get(who, Voice(event.stamp, now))
    voices[who], counts = voice.hears(event.stamp, now)
    memory = replace(memory, voices=voices)
    if not counts:
        return memory, "stale request"
    if isinstance(event, Opens):
        return _enter(memory, event, now), ""
    rest = tuple(holder for holder in memory.holders if holder.requester != who)
    return replace(memory, holders=rest), ""


def _remembered(memory: Memory, now: float) -> dict[str, Voice]:
    """The voices but those of requesters long gone."""
    return {
        who: voice
        for who, voice in memory.voices.items()
        if now < voice.heard_at + FORGOTTEN_S or memory.holder(who)
    }


def _enter(memory: Memory, event: Opens, now: float) -> Memory:
    """One more holder, or one that repeats itself."""
    before = memory.holder(event.requester)
    if before:
        after = before.asks(event.stamp, now)
        holders = tuple(after if holder is before else holder for holder in memory.holders)
    else:
        holders = (*memory.holders, Holder(event.requester, now, now, event.stamp, event.stamp))
    return replace(memory, holders=holders, prompted=True)


def _see(memory: Memory, now: float) -> Memory:
    """A state: is a word worth repeating?"""
    insists = any(now < holder.since + INSIST_S for holder in memory.holders)
    return replace(memory, prompted=memory.disagrees or insists)


# --- what is sent ------------------------------------------------------------------------------


def _request(memory: Memory) -> DoorRequest:
    """What the door's node is told, without its stamp."""
    return DoorRequest(
        requester_id=REQUESTER_ID,
        door_name=memory.door,
        requested_mode=DoorMode(int(memory.wanted)),
    )


def _due_at(memory: Memory) -> float:
    """When to send it: at once if it is new, later if it is only worth repeating."""
    if not memory.may_speak:
        return NEVER
    if memory.owed:
        return memory.sent_at + GAP_S
    return memory.sent_at + REPEAT_S if memory.prompted else NEVER


# --- what is told ------------------------------------------------------------------------------


def _report(memory: Memory, now: float, limits: Limits) -> DoorHoldReport:
    return DoorHoldReport(
        read_at=None if memory.mode is None else memory.shown_at,
        mode=memory.mode,
        holders=tuple((holder.requester, holder.since) for holder in memory.holders),
        faults=tuple(_faults(memory, now, limits)),
    )


def _faults(memory: Memory, now: float, limits: Limits) -> Iterator[Fault]:
    late = [h.requester for h in memory.holders if now >= h.since + limits.open_alarm_s]
    if late:
        yield Fault("DOOR_HELD_OPEN", f"longer than {limits.open_alarm_s:g} s by {', '.join(late)}")
    if now >= _silent_at(memory):
        yield Fault("DOOR_SILENT", "no DoorState comes")


def _silent_at(memory: Memory) -> float:
    """When the door will have been silent for too long, for those who hold it."""
    if not memory.holders:
        return NEVER
    return max(memory.shown_at, memory.holders[0].since) + SILENT_S


def _wake_at(memory: Memory, now: float, limits: Limits) -> float:
    """When time alone may change something."""
    due = [_due_at(memory), _silent_at(memory)]
    due += [holder.since + limits.open_alarm_s for holder in memory.holders]
    return min((at for at in due if at > now), default=NEVER)
