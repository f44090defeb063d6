"""The lift's decision core. It decides on sessions, on the outputs, and on the report to RMF.

A session is the use of the lift by one robot, from its first request to its END. In AGV mode the lift's
controller obeys our calls and door commands. The hold is the output that keeps the door open. A latch
is a state that only an operator's reset ends.

Rules, in the order in which they are applied:
LIFT-1. The first request at a free lift gets a session. While an obstacle (LIFT-4) is present, no
   request gets one. Later requests of that session refresh the session, and requests of other sessions
   are refused. Only the session's own END ends the session. No hazard, fault or timeout ends the
   session. A session in HUMAN mode has no outputs.
LIFT-2. An END ends the session at once. An END that is older than the session does not count. For
   `release_grace_s` after END (the grace), AGV mode and the door's hold may stay on. During the grace
   only the ended session is granted again, even in a fire. The reason is a restarted supervisor: it
   sends END for a robot that is still inside and must get out. For the same reason
   (`bridges/kinds/lift/forgotten.py`):
   - An END on `lift_requests` does not end the session of a robot that may be inside and continues to
     send requests. Such a session ends at the robot's own END, at a person's END, or when the robot is
     silent.
   - If RMF's supervisor asks for another session, or has ended the present session, this node listens
     to the session's robot directly. The requests and the END of the robot's own fleet adapter then
     count too.
   - A restarted fleet adapter sends END in mid-ride. The lift then waits longer for that robot: until
     IN_CAR_S after the robot's last message. After `release_grace_s` every output is off.
LIFT-3. A request sets the destination and the mode. If the door is held, a request for another
   destination may have to wait (`bridges/kinds/lift/replayed.py`). `bridges/kinds/lift/drive.py` has
   the rules for the outputs.
LIFT-4. An obstacle switches every output off and never changes the session. The obstacles are the
   following. Overload is none, because it only delays the ride.
   - fire, and the latch after a fire, which outlives a restart (`bridges/kinds/lift/keep.py`);
   - code blue, earthquake, emergency, out of service, manual mode;
   - a second node for this lift;
   - inputs that cannot be believed, outputs that cannot be written. A gap in reading or writing that is
     shorter than `stale_after_s` is no obstacle.
LIFT-5. The report says OPEN when fresh inputs show that the car stands at a known floor with its door
   open. Some doors are open and not shown OPEN:
   - A session's robot is outside until OPEN has been published at the session's destination. Until then
     OPEN also needs AGV mode and no fault. A robot looks only at session, floor and door, and must not
     board a lift in a fire.
   - After that OPEN a robot may be inside. To get out, the robot must see the door's true state in any
     mode.
   - A door is not shown OPEN if its hold is wanted but the relay must rest first, or if the hold could
     not be written yet. Such a door may close by itself while a robot drives through. The same is true
     while the session waits for AGV mode or for its next try (LIFT-DRIVE-5), unless there is an
     obstacle or AGV mode has failed.
   - An open door that nobody holds is not shown OPEN under two conditions: the robot itself last
     requested this floor, and the session is about to send the car away. The reason is that RMF's
     supervisor may be repeating a request of an earlier ride. The robot would then drive in.
"""

from msgspec.structs import replace

from bridges.kinds.lift import drive, forgotten, sensing, sessions
from bridges.kinds.lift.memory import LiftLimits, LiftMemory, LiftSession
from bridges.kinds.lift.report import NOT_FRESH, LiftReport, report
from bridges.kinds.lift.sensing import HAZARDS, BelievedLift, gap, look, take, trust, unsure
from bridges.kinds.lift.signals import (
    Event,
    FromAdapter,
    Hazard,
    LiftOutputs,
    LiftRequested,
    LiftSample,
)
from bridges.kinds.shared.decision import (
    NOT_KEPT,
    STARTING,
    Decision,
    Fault,
    IoFailed,
    MemoryKept,
    MemoryNotKept,
    OperatorReset,
    RivalSeen,
    Sampled,
    Suspended,
    WriteFailed,
)
from bridges.kinds.shared.durations import NEVER, RIVAL_QUIET_S

NOT_RMFS = frozenset(
    {
        Hazard.FIRE,
        Hazard.CODE_BLUE,
        Hazard.EARTHQUAKE,
        Hazard.EMERGENCY,
        Hazard.OUT_OF_SERVICE,
        Hazard.MANUAL,
    }
)
"""Hazards that take the lift away from RMF. Overload is missing, because overload only delays the
ride."""


def initial(limits: LiftLimits, now: float) -> LiftMemory:
    """Return the memory at start: no reading, no session, every output off."""
    return LiftMemory()


def decide(
    memory: LiftMemory, event: Event, now: float, limits: LiftLimits
) -> Decision[LiftMemory, LiftOutputs, LiftReport]:
    """Apply the event, judge the inputs, and derive the outputs and the report."""
    memory, refused = _take(sessions.lapse(memory, now, limits), event, now, limits)
    view = look(memory.senses, now, limits)
    memory = _latch(memory, view, now, limits)
    allowed = not obstacles(memory, view, now, limits)
    memory, outputs = _drive(memory, view, allowed, now, limits)
    return Decision(
        memory,
        memory.relays.outputs(),
        report(memory, view, outputs, _faults(memory, view, now, limits), now, limits),
        _wake_at(memory, view, outputs, now, limits),
        refused,
    )


def published(memory: LiftMemory, shown: LiftReport) -> LiftMemory:
    """Note in the memory that this report was sent. After a report with OPEN at the destination, a
    robot may be inside."""
    session = memory.session
    if session is None or not shown.open_at:
        return memory
    boarded = session.boarded or shown.open_at == session.destination
    robot = session.robot
    robot = replace(robot, opened=robot.opened or shown.open_at == robot.floor)
    return replace(memory, session=replace(session, boarded=boarded, robot=robot))


def repeated(memory: LiftMemory, now: float) -> LiftMemory:
    """Return the memory after the same reading came once more. The caller has checked that only the
    times of the reading differ."""
    return replace(memory, senses=sensing.read_again(memory.senses, now))


def obstacles(
    memory: LiftMemory, view: BelievedLift, now: float, limits: LiftLimits
) -> tuple[Fault, ...]:
    """List the present obstacles to all outputs, most serious first."""
    found = []
    if memory.fire_latched and Hazard.FIRE not in view.hazards:
        found.append(Fault("FIRE_LATCHED", "run rmf-bridge reset when the lift is safe"))
    found += [Fault(h.name) for h in HAZARDS if h in NOT_RMFS and h in view.hazards]
    if memory.rival_at is not None:
        found.append(Fault("TWO_NODES_FOR_ONE_DEVICE", "another node publishes this lift's states"))
    if not view.fresh:
        why = view.blind if view.restless else memory.io_fault or view.blind
        found.append(Fault(NOT_FRESH, why))
    if now >= _unwritten_at(memory, limits):
        found.append(Fault("OUTPUTS_NOT_WRITTEN", memory.io_fault))
    return tuple(found)


def _unwritten_at(memory: LiftMemory, limits: LiftLimits) -> float:
    """Return the time when failed writes become an obstacle; NEVER after a successful write."""
    since = memory.unwritten_since
    return NEVER if since is None else since + limits.t.stale_after_s


def _drive(
    memory: LiftMemory, view: BelievedLift, allowed: bool, now: float, limits: LiftLimits
) -> tuple[LiftMemory, LiftOutputs]:
    """Switch each relay towards its wanted state, as far as the relay's limits allow now. Also return
    the wanted outputs."""
    session, grace, relays = memory.session, memory.grace, memory.relays
    outputs = LiftOutputs()
    if session and drive.serves(session, allowed, now, limits):
        session = drive.advance(session, view, relays, now, limits)
        outputs = drive.wanted(session, view, relays, now, limits)
    elif session:
        session = drive.paused(session)
    elif grace and now >= grace.until:
        grace = None
    elif grace and allowed:
        outputs = drive.stays_on(grace, relays, view, now, limits)
    relays = relays.step(outputs, now, limits.t)
    if session and relays.call.on and relays.call.written and session.call_at is None:
        session = replace(session, call_at=now)
    return replace(memory, session=session, grace=grace, relays=relays), outputs


def _take(
    memory: LiftMemory, event: Event, now: float, limits: LiftLimits
) -> tuple[LiftMemory, str]:
    match event:
        case Sampled(sample):
            return _read(memory, sample, now, limits), ""
        case Suspended(reason):
            return replace(memory, senses=unsure(memory.senses, now), io_fault=reason), ""
        case WriteFailed(reason):
            since = now if memory.unwritten_since is None else memory.unwritten_since
            return replace(memory, io_fault=reason, unwritten_since=since, write_failed=True), ""
        case IoFailed(reason):
            return replace(memory, senses=gap(memory.senses, now), io_fault=reason), ""
        case RivalSeen():
            return replace(memory, rival_at=now), ""
        case MemoryKept():
            return replace(memory, not_kept=""), ""
        case MemoryNotKept(reason):
            return replace(memory, not_kept=reason), ""
        case OperatorReset():
            return _reset(memory, now, limits), ""
        case LiftRequested():
            return sessions.ask(memory, event, now, lambda: _why_not(memory, now, limits))
        case FromAdapter():
            return sessions.hear_adapter(memory, event.asked, now, limits), ""
    return sessions.end(memory, event, now, limits)


def _read(memory: LiftMemory, sample: LiftSample, now: float, limits: LiftLimits) -> LiftMemory:
    """Add a reading to the memory. If no write has failed since the last reading, note that the outputs
    were written."""
    relays = memory.relays if memory.write_failed else memory.relays.confirm(now)
    return replace(
        memory,
        relays=relays,
        senses=take(memory.senses, sample, now, limits),
        io_fault=memory.io_fault if memory.write_failed else "",
        unwritten_since=memory.unwritten_since if memory.write_failed else None,
        write_failed=False,
    )


def _why_not(memory: LiftMemory, now: float, limits: LiftLimits) -> str:
    """Return the obstacle because of which the free lift must not be granted; "" if no obstacle is
    present."""
    view = look(memory.senses, now, limits)
    why_not = obstacles(memory, view, now, limits)
    if not why_not:
        return ""
    starting = view.settling and not memory.io_fault and why_not[0].code == NOT_FRESH
    return STARTING if starting else why_not[0].code


def _reset(memory: LiftMemory, now: float, limits: LiftLimits) -> LiftMemory:
    """Clear the latches at an operator's order. The latch of a fire stays while the inputs are not
    fresh."""
    session = memory.session
    if session and session.fault:
        session = replace(drive.paused(session), tries=0, retry_at=None, fault=None)
    # If the inputs are fresh, clear the latch of a fire. If the fire is still present, it latches again
    # in this same decision. If the inputs are stale, they may hide a fire, so the latch stays.
    unseen = not look(memory.senses, now, limits).fresh
    return replace(
        memory,
        session=session,
        fire_latched=unseen and memory.fire_latched,
        senses=trust(memory.senses),
    )


def _latch(memory: LiftMemory, view: BelievedLift, now: float, limits: LiftLimits) -> LiftMemory:
    """Latch a fire if `fire_reset` is `manual`. Forget a rival, which is a second node for this lift,
    when it has been silent for RIVAL_QUIET_S."""
    burning = Hazard.FIRE in view.hazards
    manual = limits.fire_reset == "manual"
    rival_at = memory.rival_at
    return replace(
        memory,
        fire_latched=manual and (burning or memory.fire_latched),
        rival_at=None if rival_at is None or now >= rival_at + RIVAL_QUIET_S else rival_at,
    )


def _faults(
    memory: LiftMemory, view: BelievedLift, now: float, limits: LiftLimits
) -> tuple[Fault, ...]:
    session = memory.session
    found = [*obstacles(memory, view, now, limits)]
    if view.settling and not memory.io_fault:
        found = [fault for fault in found if fault.code != NOT_FRESH]
    if session and session.fault:
        found.append(session.fault)
    if Hazard.OVERLOAD in view.hazards:
        found.append(Fault("OVERLOAD", "waits until the car is lighter"))
    if session:
        found += _faults_of_rmf(session, now, limits)
    elif memory.grace and memory.grace.in_car:
        found.append(Fault("ROBOT_LEFT_IN_CAR", f"{memory.grace.session.id} was ended in mid-ride"))
    if memory.not_kept and limits.fire_reset == "manual":
        told = "a restart would not know whether the lift waits for a reset after a fire"
        found.append(Fault(NOT_KEPT, f"{told}: {memory.not_kept}"))
    return (*found, *view.faults)


def _faults_of_rmf(session: LiftSession, now: float, limits: LiftLimits) -> list[Fault]:
    """List the faults on RMF's side. If RMF's supervisor has forgotten the session, its fault explains
    the silence. So such a session has no fault RMF_SILENT."""
    if session.forgotten:
        fault = forgotten.fault(session, now)
        return [fault] if fault else []
    if drive.silent(session, now, limits):
        return [Fault("RMF_SILENT", f"no request from {session.id}")]
    return []


def _wake_at(
    memory: LiftMemory, view: BelievedLift, outputs: LiftOutputs, now: float, limits: LiftLimits
) -> float:
    due = [
        view.changes_at,
        memory.relays.changes_at(outputs, now, limits.t),
        memory.relays.read_at(),
        _unwritten_at(memory, limits),
    ]
    if memory.session:
        session = memory.session
        due += [*drive.next_at(session, limits), forgotten.named_at(session)]
        due.append(forgotten.lapses_at(session))
    if memory.grace:
        grace = memory.grace
        due += [drive.let_go_at(grace, limits), grace.off_at, grace.until]
    if memory.rival_at is not None:
        due.append(memory.rival_at + RIVAL_QUIET_S)
    return min((at for at in due if at > now), default=NEVER)
