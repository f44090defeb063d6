"""The laws of a door's node."""

from collections.abc import Callable
from typing import Final

from bridges.messages import definitions as d
from workbench.judge.door_history import CLOSED, OPEN, DoorScene
from workbench.judge.law import KEPT, Doubt, Finding, Law
from workbench.judge.shared_laws import ANSWERED, ONE, RATE, STAMP, fresh, named, stamped

OPENS_WITHIN_S: Final = 30.0
ASKED: Final = 5
INSTANT: Final = 2
SHUT: Final = 3
REOPENED: Final = 3
REOPENED_WITHIN_S: Final = 30.0
BYPASS_S: Final = 5.0
FLICKERS_S: Final = 0.9
"""No door can close and open again in this time."""


def _numbers(scene: DoorScene) -> Finding:
    if scene.new is None:
        return None
    known = scene.mode in list(d.DoorModeValue)
    return KEPT if known else f"current_mode {scene.mode}: RMF has no such number"


def _opens(scene: DoorScene) -> Finding:
    if scene.new is None or not scene.latched:
        return None
    if scene.mode != CLOSED:
        return KEPT
    closed_s = scene.now - max(scene.asked_at, scene.not_closed_at)
    if closed_s < OPENS_WITHIN_S or scene.openings < ASKED:
        return None
    return f"closed, though OPEN was requested {scene.openings} times in {closed_s:.0f} s"


def _left_open(scene: DoorScene) -> bool:
    """Was it open for a requester, and has it just ceased to be?"""
    moves = scene.mode in (CLOSED, d.DoorModeValue.MODE_MOVING)
    return scene.latched and scene.was_open and moves and scene.mode_before == OPEN


def _bypass(scene: DoorScene) -> bool:
    return scene.now - scene.adapter_closed_at < BYPASS_S


def _stays(scene: DoorScene) -> Finding:
    """Silence must not close it."""
    if scene.new is None or not scene.latched or not scene.was_open:
        return None
    if not _left_open(scene) or _bypass(scene):
        return KEPT if scene.mode == OPEN else None
    return Doubt("no longer open, though the last request was OPEN", _comes_back(scene))


def _comes_back(scene: DoorScene) -> Callable[[], bool]:
    """Excused if a CLOSE was on its way, or if the contact only flickered: another law judges that."""
    left_at = scene.now

    def excused() -> bool:
        flickered = scene.mode == OPEN and scene.now - left_at < FLICKERS_S
        return flickered or not scene.latched

    return excused


def _bypassed(scene: DoorScene) -> Finding:
    """A fleet adapter's CLOSE is for the supervisor."""
    if scene.new is None or not scene.latched or not _bypass(scene):
        return None
    if not _left_open(scene):
        return KEPT if scene.mode == OPEN else None
    text = "no longer open after a fleet adapter's CLOSE, though the supervisor holds it open"
    return Doubt(text, _comes_back(scene))


def _holds(scene: DoorScene) -> Finding:
    if scene.new is None or not scene.latched or scene.mode != OPEN:
        return None
    often = len(scene.reopened) == REOPENED
    if often and scene.now - scene.reopened[0] < REOPENED_WITHIN_S:
        return f"open, not open and open again within 1 s, {REOPENED} times while it is held"
    return KEPT


def _travels(scene: DoorScene) -> Finding:
    if scene.new is None or not scene.opened:
        return None
    if scene.instant < INSTANT:
        return KEPT
    return f"closed, and OPEN within 0.3 s of the request, {scene.instant} times in a row"


def _people(scene: DoorScene) -> Finding:
    if scene.new is None or not scene.left:
        return None
    if scene.shut < SHUT:
        return KEPT
    return f"opened by people, and closed as soon as RMF sent CLOSE, {scene.shut} times in a row"


def _opened(state: d.DoorState) -> bool:
    return state.current_mode.value == OPEN


def _blind(state: d.DoorState) -> bool:
    blind = (d.DoorModeValue.MODE_OFFLINE, d.DoorModeValue.MODE_UNKNOWN)
    return state.current_mode.value in blind


DOOR_OPEN: Final = "rmf_ros2 phases/DoorOpen.cpp"
SUPERVISOR: Final = "rmf_ros2 door_supervisor/Node.cpp:148-156"

LAWS: Final[tuple[Law[DoorScene], ...]] = (
    named(RATE, "D1.rate", reason="A fleet adapter enters only on a state that says OPEN now"),
    named(
        ANSWERED,
        "D1.answer",
        reason="The supervisor repeats itself at each state: a state for each request would never end",
        source=SUPERVISOR,
    ),
    named(ONE, "B0.one"),
    named(STAMP, "D3.stamp", check=stamped(_blind)),
    Law(
        "T1.numbers",
        "current_mode is a number of DoorMode.msg",
        "RMF compares numbers: a number that it does not know is never OPEN",
        "DoorMode.msg",
        _numbers,
    ),
    Law(
        "D2.opens",
        "OPEN opens the door: after 30 s of requests it is no longer CLOSED",
        "DoorOpen has no timeout: the robot waits for ever. OPEN is 2, in requests and states alike",
        DOOR_OPEN + "; DoorMode.msg",
        _opens,
        sensed=True,
    ),
    Law(
        "D2.stays",
        "OPEN is held until CLOSE: silence closes no door",
        "Once the door is OPEN, RMF says nothing while the robot drives through",
        DOOR_OPEN + "; " + SUPERVISOR,
        _stays,
        sensed=True,
    ),
    Law(
        "D1.bypass",
        "A CLOSE on adapter_door_requests closes nothing; only the supervisor's CLOSE does",
        "It is from one robot: only the supervisor knows whether another stands in the doorway",
        "rmf_ros2 door_supervisor/Node.cpp; door_adapter_template",
        _bypassed,
        sensed=True,
    ),
    Law(
        "D2.holds",
        "A door that is held stays OPEN, and does not flap",
        "A robot drives off at the first OPEN",
        DOOR_OPEN,
        _holds,
        sensed=True,
    ),
    Law(
        "D2.people",
        "CLOSE releases the door and never drives it shut: people keep a door that they opened",
        "RMF's supervisor sends CLOSE to every open door that no robot has requested",
        SUPERVISOR,
        _people,
        sensed=True,
    ),
    Law(
        "D3.travel",
        "OPEN is what a sensor sees at the end of the travel, not what was requested",
        "A robot drives off at OPEN, and the door leaf would still be in its way",
        DOOR_OPEN,
        _travels,
        sensed=True,
    ),
    Law(
        "D3.fresh",
        "OPEN is never a remembered state: its door_time advances",
        "A controller that cannot be reached may have closed the door: show OFFLINE",
        "DoorState.msg, door_time",
        fresh(_opened),
        sensed=True,
    ),
)
