"""A lift's report to RMF: the content of LiftState."""

import msgspec
from msgspec.structs import replace

from bridges.kinds.lift import drive, forgotten
from bridges.kinds.lift.memory import LiftLimits, LiftMemory, LiftSession
from bridges.kinds.lift.relays import Relays
from bridges.kinds.lift.sensing import BelievedLift
from bridges.kinds.lift.signals import Hazard, LiftOutputs, Motion, Side
from bridges.kinds.shared.decision import NOT_KEPT, AlarmInputs, Fault
from bridges.messages.definitions import LiftDoor, LiftMode, LiftMotion

NOT_FRESH = "INPUTS_NOT_FRESH"
OFFLINE = frozenset({"OUTPUTS_NOT_WRITTEN", "TWO_NODES_FOR_ONE_DEVICE"})
"""Faults that show the lift as OFFLINE. Without fresh inputs the lift is OFFLINE too."""


class LiftReport(msgspec.Struct, frozen=True):
    """The report of a lift: LiftState without name, floors and stamp, and more facts for the status
    file.

    `read_at`: monotonic seconds, None before the first reading. `floor`: RMF's name, "" when unknown.
    `estimated`: no contact proves `door`. `boarded`: a robot may be inside. `waits`: the reason why the
    session's request is not fulfilled yet; "" if no request waits. `alarm`: the present hazards of
    `alarm_on`.
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
    alarm: AlarmInputs = AlarmInputs()

    @property
    def open_at(self) -> str:
        """The floor at which the door is shown OPEN; "" if no door is shown OPEN."""
        return self.floor if self.door is LiftDoor.DOOR_OPEN else ""

    def news(self) -> object:
        """Return the facts whose change is news. The age and the faults' details are left out, because
        they may change at each reading."""
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
    """Report the present state. `wanted`: the outputs that would be on if no relay had to rest."""
    session, relays = memory.session, memory.relays
    destination = session.destination if session else ""
    floor = _floor(session, view, limits) if view.fresh and view.level else ""
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
        alarm=AlarmInputs(frozenset(map(str, limits.alarm_on & view.hazards)), view.fresh),
    )
    fulfilled = shown.open_at and shown.open_at == destination
    if session is None or (fulfilled and session.doubted is None):
        return shown
    return replace(shown, waits=_waits(session, memory, view, wanted, faults, now, limits))


def _floor(session: LiftSession | None, view: BelievedLift, limits: LiftLimits) -> str:
    """Name the car's landing. A landing with two doors has two names. Its name is the session's
    destination. Without a session it is the floor whose door is open."""
    assert view.level
    if session:
        return limits.floor_name(view.level, session.destination)
    return limits.floor_name(view.level, "", [side for side in Side if view.door(side).open])


def _worn(relays: Relays, wanted: LiftOutputs, now: float, limits: LiftLimits) -> tuple[Fault, ...]:
    """Return a fault if a relay was switched on too often and now rests."""
    output, worn = relays.resting(wanted, now, limits.t)
    most = f"its relay came on {limits.t.max_cycles_per_min} times within a minute"
    return (Fault("RELAY_RESTS", f"{output}: {most}"),) if worn else ()


def _waits(
    session: LiftSession,
    memory: LiftMemory,
    view: BelievedLift,
    wanted: LiftOutputs,
    faults: tuple[Fault, ...],
    now: float,
    limits: LiftLimits,
) -> str:
    """Explain why a request is not fulfilled yet."""
    if session.doubted:
        floor = session.doubted.destination
        return f"for the robot itself to ask for {floor}: the request may be from an earlier ride"
    if not session.agv:
        return "for END: in HUMAN mode people call the lift"
    if not view.fresh:
        return f"for its inputs: {view.blind}"
    if wanted == LiftOutputs() and drive.silent(session, now, limits):
        return f"for a request of {session.id}"
    if wanted != LiftOutputs() and memory.unwritten_since is not None:
        return f"for its outputs to be written: {memory.io_fault}"
    if output := memory.relays.resting(wanted, now, limits.t)[0]:
        return f"for {output}: its relay must rest"
    if wanted.agv_request and session.waiting:
        at = f" at {session.destination}"
        if session.waiting == "floor" and drive.is_not_seen_to_stand(session, view, limits):
            return f"for the car to be seen to stand{at}"
        return {"agv": "for AGV mode", "floor": f"for the car{at}", "door": f"for the door{at}"}[
            session.waiting
        ]
    return f"for the end of {', '.join(f.code for f in faults if f.code != forgotten.CODE)}"


def _may_enter(
    memory: LiftMemory,
    floor: str,
    mode: LiftMode,
    wanted: LiftOutputs,
    faults: tuple[Fault, ...],
) -> bool:
    """Return whether an open door may be shown as OPEN. A robot that sees OPEN drives through.

    - The door is not shown OPEN if the hold is wanted and its relay must rest, or if the write of the
      hold has failed. Nothing holds such a door, so it would close on the robot.
    - The door is not shown OPEN if the lift is about to send the car away from the floor that the
      session's robot itself last requested. RMF's supervisor may be repeating a request of an earlier
      ride.
    - The door is not shown OPEN while the session waits for AGV mode, or for its next try
      (LIFT-DRIVE-5). Nothing holds that door, and the session soon will. But if a hazard or another
      obstacle is present, if AGV mode has failed, or after the last try, the door is shown as it is,
      because no other way leads out.
    - Before a robot has boarded, OPEN is shown only if the lift serves the session in AGV mode, without
      a fault. The faults FORGOTTEN_BY_SUPERVISOR and NOT_KEPT (a full disk) do not matter.
    """
    session, hold = memory.session, memory.relays.hold
    held = hold.on is not None and (hold.written or memory.unwritten_since is None)
    if wanted.hold_door is not None and not held:
        return False
    if session is None:
        return True
    served = mode is LiftMode.MODE_AGV and wanted.agv_request
    if served and not held and memory.own.get(session.id) == floor:
        return False
    if drive.holds_later(session) and mode in (LiftMode.MODE_AGV, LiftMode.MODE_HUMAN):
        return False
    hinders = any(fault.code not in (forgotten.CODE, NOT_KEPT) for fault in faults)
    return session.boarded or (served and not hinders)


def _mode(view: BelievedLift, faults: tuple[Fault, ...], relays: Relays) -> LiftMode:
    """Return RMF's mode. If no status line for AGV mode is wired, the lift counts as in AGV mode while
    our output requests this mode."""
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
    """Return the door's state from the inputs, and True if that state is an estimate.

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
    """Return the motion from the motion lines. Without motion lines, a car with an open door at a floor
    counts as stopped."""
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
