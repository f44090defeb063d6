"""The door supervisor's core, for one door: who holds it open, and what its node is told.

It stands in for RMF's own (rmf_ros2, door_supervisor/Node.cpp): fleet adapters and web users ask on
`adapter_door_requests`; the door's node is told on `door_requests`, by "door_supervisor". Rules:
1. OPEN enters its requester among the holders, or renews its stamp. CLOSE strikes it off. A stale
   request (`bridges/core/freshness.py`) does neither.
2. While anybody holds the door its node is told OPEN, and when nobody does CLOSE: OPEN for the first
   holder, CLOSE when the last one goes. The request is repeated when a requester repeats OPEN, and
   when the door's state disagrees: held, but CLOSED or MOVING; not held, but OPEN or MOVING. For
   INSIST_S after a holder has come, OPEN is repeated at every state: the first one may be lost, and
   the door about to close by an earlier CLOSE. The states OFFLINE and UNKNOWN cause nothing.
3. Silence ends nothing: a robot in the doorway is silent. After `open_alarm_s` there is a fault,
   and that is all.
4. Until it may speak, and beside another supervisor, it only listens. It then begins with OPEN for a
   door that somebody holds; with CLOSE only if a state that comes afterwards asks for it.
5. Nothing is sent twice within GAP_S, and nothing again, unchanged, within REPEAT_S.
The heartbeat (`report.py`) tells who holds the doors, and a restart does not forget it (`keep.py`).
"""

from typing import Any, Final

from msgspec.structs import replace

from bridges.core.decision import Decision
from bridges.core.durations import FORGOTTEN_S, NEVER, due_at
from bridges.core.freshness import Rules, hear
from bridges.core.graph_kind import MaySpeak
from bridges.door_supervisor.memory import Holder, Limits, Memory
from bridges.door_supervisor.report import DoorHoldReport, report
from bridges.door_supervisor.signals import CloseRequested, Event, OpenRequested, StateHeard
from bridges.rmf.definitions import DoorMode, DoorRequest, Message
from bridges.rmf.topics import DOOR_REQUESTS, Topic

REQUESTER_ID: Final = "door_supervisor"
"""As RMF's own signs (door_supervisor/Node.hpp)."""
INSIST_S: Final = 5.0
RULES: Final = Rules(retained=False)

Decided = Decision[Memory, None, DoorHoldReport]


def initial(door: str, started_at: float) -> Memory:
    """Nobody was heard of; we may not speak yet."""
    return Memory(door)


def idle(memory: Memory, now: float) -> bool:
    """Nobody holds this door, and nothing has been heard of it in a while."""
    heard = [memory.shown_at, *(who.heard_at for who in memory.requesters.values())]
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
        report(memory, now, limits),
        _wake_at(memory, now, limits),
        refused,
        publish,
    )


# --- what is heard -----------------------------------------------------------------------------


def _take(memory: Memory, event: Event, now: float) -> tuple[Memory, str]:
    match event:
        case OpenRequested() | CloseRequested():
            return _hear(memory, event, now)
        case StateHeard(mode):
            return _see(replace(memory, mode=mode, shown_at=now), now), ""
        case MaySpeak(yes):
            return replace(memory, may_speak=yes, sent=None, prompted=False), ""
        case _:  # only time has passed
            return memory, ""


def _hear(memory: Memory, event: OpenRequested | CloseRequested, now: float) -> tuple[Memory, str]:
    who, holders = event.requester, {holder.requester for holder in memory.holders}
    requesters, refused = hear(memory.requesters, who, event.stamp, now, RULES, holders=holders)
    memory = replace(memory, requesters=requesters)
    if refused:
        return memory, refused
    if isinstance(event, OpenRequested):
        return _enter(memory, event, now), ""
    rest = tuple(holder for holder in memory.holders if holder.requester != who)
    return replace(memory, holders=rest), ""


def _enter(memory: Memory, event: OpenRequested, now: float) -> Memory:
    """Add a holder, or note that one has repeated its OPEN."""
    before = memory.holder(event.requester)
    if before:
        after = before.repeats(event.stamp, now)
        holders = tuple(after if holder is before else holder for holder in memory.holders)
    else:
        holders = (*memory.holders, Holder(event.requester, now, now, event.stamp, event.stamp))
    return replace(memory, holders=holders, prompted=True)


def _see(memory: Memory, now: float) -> Memory:
    """A state has come: is the last request worth repeating?"""
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
    """When to send it."""
    if not memory.may_speak:
        return NEVER
    return due_at(memory.sent_at, new=memory.owed, again=memory.prompted)


def _wake_at(memory: Memory, now: float, limits: Limits) -> float:
    """When the decision may change though nothing is heard."""
    due = [_due_at(memory), memory.silent_at]
    due += [holder.since + limits.open_alarm_s for holder in memory.holders]
    return min((at for at in due if at > now), default=NEVER)
