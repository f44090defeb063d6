"""The laws of a door's node."""

from typing import Final

from bridges.messages import definitions as d
from workbench.judge.door_history import BLIND, CLOSED, FLICKERS_S, LATE_S, OPEN, DoorHistory
from workbench.judge.law import KEPT, Doubt, Finding, Law
from workbench.judge.shared_laws import ANSWERED, ONE, RATE, STAMP, fresh, named, stamped

OPENS_WITHIN_S: Final = 30.0
SILENCE_S: Final = 10.0
"""Time (s) without a request. Faulty nodes such as lci-rmf-adapter close an open door after a shorter
time."""
ASKED: Final = 5
INSTANT: Final = 2
SHUT: Final = 3
BYPASS_S: Final = 5.0
LAPSES: Final = 2
_NUMBERS: Final = frozenset(d.DoorModeValue)


def _numbers(history: DoorHistory) -> Finding:
    if history.new is None:
        return None
    known = history.mode in _NUMBERS
    return KEPT if known else f"current_mode {history.mode}: RMF has no such number"


def _opens(history: DoorHistory) -> Finding:
    if history.new is None or not history.latched:
        return None
    if history.mode != CLOSED:
        sensed = history.mode in (OPEN, d.DoorModeValue.MODE_MOVING)
        return KEPT if sensed and history.was_closed else None
    closed_s = history.now - max(history.asked_at, history.not_closed_at)
    if closed_s < OPENS_WITHIN_S or history.openings < ASKED:
        return None
    return f"closed, though OPEN was requested {history.openings} times in {closed_s:.0f} s"


def _left_open(history: DoorHistory) -> bool:
    """Return whether the door was open for a requester in the previous state, and is not open now."""
    moves = history.mode in (CLOSED, d.DoorModeValue.MODE_MOVING)
    return history.latched and history.was_open and moves and history.mode_before == OPEN


def _bypass(history: DoorHistory) -> bool:
    return history.now - history.adapter_closed_at < BYPASS_S


def _stays(history: DoorHistory) -> Finding:
    """Check that RMF's silence does not close the door."""
    if history.new is None or not history.latched or not history.was_open:
        return None
    if not _left_open(history) or _bypass(history):
        tested = history.mode == OPEN and history.now - history.asked_last > SILENCE_S
        return KEPT if tested else None
    return _left("no longer open, though the last request was OPEN", history)


def _left(text: str, history: DoorHistory) -> Doubt:
    """Return a possible breach. It is excused if a CLOSE was still on its way. It is also excused if
    the door is soon open again, because another law covers a flickering contact.

    A CLOSE may also be lost. RMF's supervisor sends OPEN to a closed door that a robot holds
    (door_supervisor/Node.cpp). So the breach needs another OPEN, or LAPSES such doubts in a row.

    The time until then is measured by arrival and by stamps, because a busy network may deliver the
    next state late.
    """
    left_at, read_at, lapses = history.now, history.seen.stamped_at, history.lapses

    def excused() -> bool:
        shut_s = min(history.now - left_at, history.seen.stamped_at - read_at)
        forgot = not history.latched and history.lapses == lapses
        flickers = history.mode == OPEN and shut_s < FLICKERS_S
        if flickers or forgot or history.closed_at > left_at:
            return True
        sure = history.ours or history.asked_again_at > left_at or lapses + 1 >= LAPSES
        return not sure and history.now - left_at > LATE_S

    return Doubt(text, excused, LATE_S)


def _bypassed(history: DoorHistory) -> Finding:
    """Check that a fleet adapter's CLOSE does not close the door. Only the supervisor may act on this
    CLOSE."""
    if history.new is None or not history.latched or not _bypass(history):
        return None
    if not _left_open(history):
        return KEPT if history.mode == OPEN else None
    text = "no longer open after a fleet adapter's CLOSE, though the supervisor holds it open"
    return _left(text, history)


def _holds(history: DoorHistory) -> Finding:
    if history.new is None or not history.latched or history.mode != OPEN:
        return None
    if history.often(history.reopened):
        return "while it is held, the door left OPEN and was OPEN again within 1 s, 3 times"
    return KEPT if history.mode_before == OPEN else None


def _travels(history: DoorHistory) -> Finding:
    if history.new is None or not history.opened:
        return None
    if history.instant < INSTANT:
        return None if history.instant else KEPT
    return f"OPEN within 0.3 s of the request to the closed door, {history.instant} times in a row"


def _people(history: DoorHistory) -> Finding:
    if history.new is None or not history.left:
        return None
    if history.shut < SHUT:
        return None if history.shut else KEPT
    return f"opened by people, and closed as soon as RMF sent CLOSE, {history.shut} times in a row"


def _blind(state: d.DoorState) -> bool:
    return state.current_mode.value in BLIND


DOOR_OPEN: Final = "rmf_ros2 phases/DoorOpen.cpp"
SUPERVISOR: Final = "rmf_ros2 door_supervisor/Node.cpp:148-156"

LAWS: Final[tuple[Law[DoorHistory], ...]] = (
    named(RATE, "D1.rate", reason="A fleet adapter enters only on a state that says OPEN now"),
    named(
        ANSWERED,
        "D1.answer",
        reason="RMF repeats its request after each state. If each request caused a state, the loop"
        " would never end",
        source=SUPERVISOR,
    ),
    named(ONE, "B0.one"),
    named(STAMP, "D3.stamp", check=stamped(_blind)),
    Law(
        "T1.numbers",
        "current_mode is a number of DoorMode.msg",
        "a state",
        "RMF compares numbers. An unknown number is never OPEN",
        "DoorMode.msg",
        _numbers,
    ),
    Law(
        "D2.opens",
        "OPEN opens the door: if OPEN is requested for 30 s, the door is no longer CLOSED",
        "OPEN is requested while the door is closed",
        "DoorOpen has no timeout, so the robot would wait for ever. A wrong number may be the"
        " cause: OPEN is 2 in requests and states",
        DOOR_OPEN + "; DoorMode.msg",
        _opens,
        sensed=True,
    ),
    Law(
        "D2.stays",
        "OPEN is held until CLOSE: silence closes no door",
        "the door is OPEN for a robot, and RMF is silent for 10 s",
        "After the door is OPEN, RMF sends nothing until the robot has passed the door",
        DOOR_OPEN + "; " + SUPERVISOR,
        _stays,
        sensed=True,
    ),
    Law(
        "D1.bypass",
        "A CLOSE on adapter_door_requests closes nothing; only the supervisor's CLOSE does",
        "a fleet adapter's CLOSE while the supervisor holds the door OPEN",
        "When one robot sends CLOSE, only the supervisor knows whether another robot is in the doorway",
        "rmf_ros2 door_supervisor/Node.cpp; door_adapter_template",
        _bypassed,
        sensed=True,
    ),
    Law(
        "D2.holds",
        "A door that is held stays OPEN, and does not flap",
        "two states in a row show the door OPEN for a robot",
        "A robot drives off at the first OPEN",
        DOOR_OPEN,
        _holds,
        sensed=True,
    ),
    Law(
        "D2.people",
        "CLOSE releases the door and never drives it shut: a door that people opened stays open"
        " for them",
        "people open the door, and RMF sends CLOSE",
        "RMF's supervisor sends CLOSE to every open door that no robot has requested",
        SUPERVISOR,
        _people,
        sensed=True,
    ),
    Law(
        "D3.travel",
        "A door shows OPEN when a sensor sees it fully open, not when OPEN was requested",
        "the closed door opens for a robot",
        "A robot drives off at OPEN. A leaf that still moves would be in its way",
        DOOR_OPEN,
        _travels,
        sensed=True,
    ),
    Law(
        "D3.fresh",
        "OPEN is always a new reading, never an old one: its door_time advances",
        "the door is OPEN for more than 5 s",
        "An unreachable controller may have closed the door. The node must show OFFLINE",
        "DoorState.msg, door_time",
        fresh(),
        sensed=True,
    ),
)
