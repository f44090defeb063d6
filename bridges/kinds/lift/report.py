"""What RMF is told about a lift: the content of LiftState."""

import msgspec
from msgspec.structs import replace

from bridges.kinds.lift import drive, forgotten
from bridges.kinds.lift.memory import LiftLimits, LiftMemory, LiftSession
from bridges.kinds.lift.relays import Relays
from bridges.kinds.lift.sensing import BelievedLift
from bridges.kinds.lift.signals import Hazard, LiftOutputs, Motion
from bridges.kinds.shared.decision import Fault
from bridges.messages.definitions import LiftDoor, LiftMode, LiftMotion

NOT_FRESH = "INPUTS_NOT_FRESH"
OFFLINE = frozenset({"OUTPUTS_NOT_WRITTEN", "TWO_NODES_FOR_ONE_DEVICE"})
"""With one of these faults, or without fresh inputs, the lift is shown OFFLINE."""


class LiftReport(msgspec.Struct, frozen=True):
    """LiftState without its name, floors and stamp, and what only the status file shows.

    `floor`: RMF's name, "" when unknown. `read_at`: monotonic seconds, None before the first reading.
    `estimated`: no contact proves what `door` shows. `boarded`: a robot may be inside. `waits`: what
    the session's request waits for; "" without one, or once RMF is shown what was asked.
    """

    read_at: float | None
    floor: str
    destination: str
    door: LiftDoor
    motion: LiftMotion
    mode: LiftMode
    session: str
    faults: tuple[Fault, ...] = ()
    estimated: bool = False
    boarded: bool = False
    waits: str = ""

    @property
    def open_at(self) -> str:
        """The floor at which the door is shown open, "" when it is not."""
        return self.floor if self.door is LiftDoor.DOOR_OPEN else ""

    def news(self) -> object:
        """All but the age and the faults' details, which may change with each reading."""
        shown = (self.floor, self.destination, self.door, self.motion, self.mode, self.session)
        return *shown, self.estimated, tuple(fault.code for fault in self.faults)


def report(
    memory: LiftMemory,
    view: BelievedLift,
    wanted: LiftOutputs,
    faults: tuple[Fault, ...],
    now: float,
    limits: LiftLimits,
) -> LiftReport:
    """The state as it is shown now. `wanted`: the outputs that would be on if no relay had to rest."""
    session, relays = memory.session, memory.relays
    destination = session.destination if session else ""
    floor = limits.floor_name(view.level, destination) if view.fresh and view.level else ""
    mode = _mode(view, faults, relays)
    door, estimated = _door(session, view, floor, limits)
    if door is LiftDoor.DOOR_OPEN and not _may_enter(memory, floor, mode, wanted, faults):
        door, estimated = LiftDoor.DOOR_MOVING, False
    shown = LiftReport(
        read_at=memory.senses.read_at,
        floor=floor,
        destination=destination,
        door=door,
        motion=_motion(view, door),
        mode=mode,
        session=session.id if session else "",
        faults=(*faults, *_worn(relays, wanted, now, limits)),
        estimated=estimated,
        boarded=bool(session and session.boarded),
    )
    if session is None or (shown.open_at == destination and session.doubted is None):
        return shown
    return replace(shown, waits=_waits(session, relays, view, wanted, faults, now, limits))


def _worn(relays: Relays, wanted: LiftOutputs, now: float, limits: LiftLimits) -> tuple[Fault, ...]:
    """A relay was switched on too often, so that the lift stands. It hides no open door."""
    output, worn = relays.resting(wanted, now, limits.t)
    most = f"its relay came on {limits.t.max_cycles_per_min} times within a minute"
    return (Fault("RELAY_RESTS", f"{output}: {most}"),) if worn else ()


def _waits(
    session: LiftSession,
    relays: Relays,
    view: BelievedLift,
    wanted: LiftOutputs,
    faults: tuple[Fault, ...],
    now: float,
    limits: LiftLimits,
) -> str:
    """What a request waits for that RMF does not see fulfilled."""
    if session.doubted:
        return f"for the robot to ask for {session.doubted.destination} itself: it may have ridden"
    if not session.agv:
        return "for END: a lift in HUMAN mode is called by people"
    if not view.fresh:
        return f"for its inputs: {view.blind}"
    if wanted == LiftOutputs() and drive.silent(session, now, limits):
        return f"for a request of {session.id}"
    if output := relays.resting(wanted, now, limits.t)[0]:
        return f"for {output}: its relay must rest"
    if wanted.agv_request and session.waiting:
        at = f" at {session.destination}"
        return {"agv": "for AGV mode", "floor": f"for the car{at}", "door": f"for the door{at}"}[
            session.waiting
        ]
    return f"until this is over: {', '.join(f.code for f in faults if f.code != forgotten.CODE)}"


def _may_enter(
    memory: LiftMemory,
    floor: str,
    mode: LiftMode,
    wanted: LiftOutputs,
    faults: tuple[Fault, ...],
) -> bool:
    """May an open door be shown as OPEN? A robot that sees OPEN drives through.

    Not while the hold is wanted and its relay must rest: the door stands open only for its own dwell
    time, and would then close on the robot. Nor, while the session is served, at the floor that the
    robot itself asks for, if the car is about to leave it: RMF's supervisor may be passing on an
    earlier ride. A session that has not boarded must also be served, in AGV mode, and without a fault;
    being forgotten by RMF's supervisor does not count as one.
    """
    session, held = memory.session, memory.relays.hold.on is not None
    if wanted.hold_door is not None and not held:
        return False
    if session is None:
        return True
    served = mode is LiftMode.MODE_AGV and wanted.agv_request
    if served and not held and memory.own.get(session.id) == floor:
        return False
    hinders = any(fault.code != forgotten.CODE for fault in faults)
    return session.boarded or (served and not hinders)


def _mode(view: BelievedLift, faults: tuple[Fault, ...], relays: Relays) -> LiftMode:
    """RMF's mode. If no AGV mode status is wired, our own request for it counts as the status."""
    codes = {fault.code for fault in faults}
    if codes & {"FIRE", "FIRE_LATCHED"}:
        return LiftMode.MODE_FIRE
    if codes & OFFLINE or not view.fresh:
        return LiftMode.MODE_OFFLINE
    if view.hazards & {Hazard.CODE_BLUE, Hazard.EARTHQUAKE, Hazard.EMERGENCY}:
        return LiftMode.MODE_EMERGENCY
    if view.hazards & {Hazard.OUT_OF_SERVICE, Hazard.MANUAL}:
        return LiftMode.MODE_OFFLINE
    agv = relays.agv.on if view.agv is None else view.agv
    return LiftMode.MODE_AGV if agv else LiftMode.MODE_HUMAN


def _door(
    session: LiftSession | None, view: BelievedLift, floor: str, limits: LiftLimits
) -> tuple[LiftDoor, bool]:
    """The door as the inputs show it, and whether that is an estimate.

    With a session and a known floor, only the door that serves that floor counts.
    """
    if not view.fresh:
        return LiftDoor.DOOR_MOVING, False
    seen = [side for side in (view.front, view.rear) if side]
    if session and floor:
        seen = [view.door(limits.side(floor))]
    opened = [side for side in seen if side.open]
    if opened:
        proven = view.stopped and floor
        door = LiftDoor.DOOR_OPEN if proven else LiftDoor.DOOR_MOVING
        return door, bool(proven) and all(side.estimated for side in opened)
    closed = all(side.closed for side in seen)
    estimated = closed and any(side.estimated for side in seen)
    return (LiftDoor.DOOR_CLOSED if closed else LiftDoor.DOOR_MOVING), estimated


def _motion(view: BelievedLift, door: LiftDoor) -> LiftMotion:
    """From the motion lines. Without them, a car with an open door at a floor is stopped."""
    if not view.fresh:
        return LiftMotion.MOTION_UNKNOWN
    if view.motion is None:
        open_there = door is LiftDoor.DOOR_OPEN
        return LiftMotion.MOTION_STOPPED if open_there else LiftMotion.MOTION_UNKNOWN
    return {
        Motion.STOPPED: LiftMotion.MOTION_STOPPED,
        Motion.UP: LiftMotion.MOTION_UP,
        Motion.DOWN: LiftMotion.MOTION_DOWN,
    }.get(view.motion, LiftMotion.MOTION_UNKNOWN)
