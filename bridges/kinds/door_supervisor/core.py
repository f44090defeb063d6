"""The door supervisor's core, for one door: its holders (requesters that want it open), and the
requests to the door's node.

This supervisor replaces RMF's supervisor (rmf_ros2, door_supervisor/Node.cpp). Fleet adapters and web
users send their requests on `adapter_door_requests`. The supervisor sends its requests on
`door_requests`, with the requester_id "door_supervisor".

Rules:
DOOR-SUPERVISOR-1. OPEN adds its requester to the holders, or renews the holder's stamp. CLOSE removes
   the requester. A stale request (`bridges/kinds/shared/freshness.py`) has no effect.
DOOR-SUPERVISOR-2. When the first holder comes, the supervisor sends OPEN to the door's node. When the
   last holder leaves, the supervisor sends CLOSE.
   - The request is repeated when a requester repeats OPEN. The request is also repeated when the door's
     state contradicts the request: a held door is CLOSED or MOVING, or a door without holders is OPEN
     or MOVING.
   - For INSIST_S after a holder has come, OPEN is repeated at every state of the door. The first OPEN
     may have been lost, or an earlier CLOSE may be about to close the door.
   - OPEN is repeated when a held door comes back from OFFLINE, UNKNOWN or a silence, because the
     door's node may have let the door go meanwhile, as in a fire.
   - In the states OFFLINE and UNKNOWN no request is repeated because of the state.
DOOR-SUPERVISOR-3. Silence ends no hold, because a robot in the doorway is silent. After `open_alarm_s`
   a fault is shown, and the door stays open.
DOOR-SUPERVISOR-4. During the quiet start (the first `quiet_start_s`), and whenever another supervisor
   publishes, our supervisor only listens. After that it sends OPEN at once to a door with holders. It
   sends CLOSE only when a new state of the door contradicts CLOSE. There is one exception during the
   quiet start. OPEN is sent at once to a door that was held before the restart, if the door is not seen
   CLOSED and no other supervisor is there. The reason is that the door's node may have died too, with a
   robot in the doorway.
DOOR-SUPERVISOR-5. Two messages are at least GAP_S apart. An unchanged message is repeated after
   REPEAT_S at the earliest.

The heartbeat (`report.py`) lists the holders of all doors. `keep.py` saves the holders across a
restart.
"""

from typing import Final

from msgspec.structs import replace

from bridges.kinds.door_supervisor.memory import DoorSupervisorLimits, Holder, SupervisedDoor
from bridges.kinds.door_supervisor.report import DoorHoldReport, report
from bridges.kinds.door_supervisor.signals import (
    DoorStateHeard,
    Event,
    RequesterCloses,
    RequesterOpens,
)
from bridges.kinds.shared.decision import Decision, Said
from bridges.kinds.shared.durations import FORGOTTEN_S, NEVER, due_at
from bridges.kinds.shared.freshness import Rules, hear
from bridges.kinds.shared.graph_kind import MaySpeak
from bridges.messages.definitions import DoorMode, DoorModeValue, DoorRequest
from bridges.messages.topics import DOOR_REQUESTS

REQUESTER_ID: Final = "door_supervisor"
"""The requester_id of RMF's own door supervisor (door_supervisor/Node.hpp)."""
INSIST_S: Final = 5.0
UNSURE: Final = (DoorModeValue.MODE_OFFLINE, DoorModeValue.MODE_UNKNOWN)
RULES: Final = Rules(retained=False)

Decided = Decision[SupervisedDoor, None, DoorHoldReport]


def initial(door: str, started_at: float) -> SupervisedDoor:
    """Return the memory at start, before any message was heard. We may not publish yet."""
    return SupervisedDoor(door)


def idle(memory: SupervisedDoor, now: float) -> bool:
    """Return whether this door may be forgotten: it has no holders, and FORGOTTEN_S have passed without
    a message about it."""
    heard = [memory.shown_at, *(who.heard_at for who in memory.requesters.values())]
    return not memory.holders and now >= max(heard) + FORGOTTEN_S


def urgent(memory: SupervisedDoor) -> bool:
    """Return whether this door must be held at once, even during the quiet start."""
    return memory.holds_restored


def decide(
    memory: SupervisedDoor, event: Event, now: float, limits: DoorSupervisorLimits
) -> Decided:
    """Apply the event, and publish the request that is due, if any. Never raises."""
    memory, refused = _take(memory, event, now)
    publish: tuple[Said, ...] = ()
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


# --- events that come in ------------------------------------------------------------------------


def _take(memory: SupervisedDoor, event: Event, now: float) -> tuple[SupervisedDoor, str]:
    match event:
        case RequesterOpens() | RequesterCloses():
            return _hear(memory, event, now)
        case DoorStateHeard(mode):
            returns = memory.mode in UNSURE or now >= memory.silent_at
            return _see(replace(memory, mode=mode, shown_at=now), now, returns), ""
        case MaySpeak(yes, at_once, waits=passive):
            memory = replace(memory, may_speak=yes, at_once=at_once, passive=passive)
            return replace(memory, sent=None, prompted=False), ""
        case _:  # only time has passed
            return memory, ""


def _hear(
    memory: SupervisedDoor, event: RequesterOpens | RequesterCloses, now: float
) -> tuple[SupervisedDoor, str]:
    who, holders = event.requester, {holder.requester for holder in memory.holders}
    requesters, refused = hear(memory.requesters, who, event.stamp, now, RULES, holders=holders)
    memory = replace(memory, requesters=requesters)
    if refused:
        return memory, refused
    if isinstance(event, RequesterOpens):
        return _enter(memory, event, now), ""
    rest = tuple(holder for holder in memory.holders if holder.requester != who)
    return replace(memory, holders=rest), ""


def _enter(memory: SupervisedDoor, event: RequesterOpens, now: float) -> SupervisedDoor:
    """Add a holder, or note a holder's repeated OPEN."""
    before = memory.holder(event.requester)
    if before:
        after = before.repeats(event.stamp, now)
        holders = tuple(after if holder is before else holder for holder in memory.holders)
    else:
        holders = (*memory.holders, Holder(event.requester, now, now, event.stamp, event.stamp))
    return replace(memory, holders=holders, prompted=True)


def _see(memory: SupervisedDoor, now: float, returns: bool) -> SupervisedDoor:
    """Decide after a new state of the door whether the last request must be repeated. A repeat that a
    requester has asked for, and that is not due yet, stays. `returns`: the door comes back from a state
    in which it may have ended the hold."""
    insists = any(now < holder.since + INSIST_S for holder in memory.holders)
    repeats = memory.holders and memory.mode not in UNSURE and (memory.prompted or returns)
    return replace(memory, prompted=bool(memory.disagrees or insists or repeats))


# --- messages that go out -----------------------------------------------------------------------


def _request(memory: SupervisedDoor) -> DoorRequest:
    """Make the request to the door's node, without its stamp."""
    return DoorRequest(
        requester_id=REQUESTER_ID,
        door_name=memory.door,
        requested_mode=DoorMode(int(memory.wanted)),
    )


def _due_at(memory: SupervisedDoor) -> float:
    """Return the time of the next request."""
    if not memory.may_send:
        return NEVER
    return due_at(memory.sent_at, new=memory.owed, again=memory.prompted)


def _wake_at(memory: SupervisedDoor, now: float, limits: DoorSupervisorLimits) -> float:
    """Return the next time at which the decision may change without an event."""
    due = [_due_at(memory), memory.silent_at]
    due += [holder.since + limits.open_alarm_s for holder in memory.holders]
    return min((at for at in due if at > now), default=NEVER)
