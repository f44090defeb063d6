"""Rules for every decision of the lift's core, in any history.

The rules compare the event and the inputs with the decision: its outputs, its report and its memory.
"""

import math
from typing import Any

from bridges.kinds.lift.core import decide
from bridges.kinds.lift.memory import LiftLimits, LiftMemory
from bridges.kinds.lift.report import LiftReport
from bridges.kinds.lift.signals import (
    DoorReading,
    EndRequested,
    FromAdapter,
    Hazard,
    LiftOutputs,
    LiftRequested,
    Motion,
)
from bridges.kinds.shared.decision import IoFailed, Sampled, WriteFailed
from bridges.messages.definitions import LiftDoor
from tests.kinds.lift.walk import Step, World, reading

RIVAL_S = 5.0
MINUTE_S = 60.0
OFF = LiftOutputs()
HINDER_NOBODY = {"FORGOTTEN_BY_SUPERVISOR", "RELAY_RESTS"}


def check(step: Step) -> None:
    """Check every rule. An AssertionError names the broken rule in its traceback."""
    outputs_make_sense(step)
    nothing_is_driven_when_forbidden(step)
    sessions_end_by_end_alone(step)
    open_is_the_truth(step)
    a_request_that_waits_has_a_reason(step)
    assert step.decision.wake_at > step.now


def outputs_make_sense(step: Step) -> None:
    """Require that the outputs are possible together, and that each output is permitted.

    No output calls a landing while another output holds a door. Both need AGV mode, and a session or
    the grace after it. A call goes to the session's floor, and a door is held only there.

    On lifts with `by_call` a call brings AGV mode. Such a call needs no AGV mode, and may go to the
    car's own landing.
    """
    driven, memory, sample = step.decision.outputs, step.decision.memory, step.world.sample
    session, grace = memory.session, memory.grace
    assert driven == memory.relays.outputs()
    assert not (driven.call and driven.hold_door)
    assert driven.agv_request or not (driven.call or driven.hold_door)
    assert session or not driven.call
    assert session or grace or driven == OFF
    assert grace is None or step.now < grace.until
    standing = sample.motion in (None, Motion.STOPPED)
    if not _sampled(step):
        return
    to_bring_agv = step.limits.by_call and sample.agv is False
    if driven.call and not to_bring_agv:
        assert sample.agv is not False
        trusted = memory.senses.position.trusted
        assert not (standing and driven.call == sample.level == trusted)
    if driven.call:
        assert Hazard.OVERLOAD not in sample.hazards
        assert driven.call == session.destination
    if driven.hold_door:
        assert standing
        assert sample.agv is not False
        assert sample.level == (session or grace.session).destination


def nothing_is_driven_when_forbidden(step: Step) -> None:
    """Require that all outputs go off at once whenever driving is forbidden.

    These facts forbid driving:
    - a hazard except overload, or a latched fire,
    - a second node that publishes states of this lift,
    - no fresh reading,
    - HUMAN mode, requested by the holder of the session,
    - a fault of the session, until the core tries again.
    """
    memory, now = step.decision.memory, step.now
    session = memory.session
    forbidden = (
        bool(step.world.sample.hazards - {Hazard.OVERLOAD} and _sampled(step))
        or (memory.rival_at is not None and now < memory.rival_at + RIVAL_S)
        or memory.senses.read_at is None
        or now >= memory.senses.read_at + step.limits.t.stale_after_s
        or memory.fire_latched
        or (session is not None and not session.agv)
        or (session is not None and session.fault is not None and session.retry_at is not None)
    )
    assert not forbidden or step.decision.outputs == OFF


def sessions_end_by_end_alone(step: Step) -> None:
    """Require that sessions begin and end only as the rules permit.

    A request begins a session of a free lift. The holder's END ends the session. The session also ends
    if the supervisor has sent END and the robot's own adapter is silent. No other event ends a session.

    In the grace after END the lift goes back to a robot that may still be in the car. No other session
    gets the lift then.
    """
    before, after, event = _id(step.before), _id(step.decision.memory), step.event
    if before and _fell_silent(step):
        assert after is None or (after == before and _is_asked_for(event, before))
    elif before and _is_its_end(step, event):
        assert after is None
    elif before is None and isinstance(event, LiftRequested):
        assert after in (None, event.session_id)
        assert (after is None) == bool(step.decision.refused)
        assert after is None or not _is_kept_for_another(step, after)
    elif before is None and isinstance(event, FromAdapter):
        grace = step.before.grace
        waits = grace is not None and grace.in_car and step.now < grace.until
        given_back = waits and isinstance(event.asked, LiftRequested)
        assert after is None or (given_back and not _is_kept_for_another(step, after))
    else:
        assert after == before
    shown: LiftReport = step.decision.report
    assert shown.session == (after or "")
    assert (shown.destination == "") == (after is None)


def _is_kept_for_another(step: Step, session: str) -> bool:
    grace = step.before.grace
    return grace is not None and step.now < grace.until and grace.session.id != session


def _is_asked_for(event: object, session: str) -> bool:
    asked = event.asked if isinstance(event, FromAdapter) else event
    return isinstance(asked, LiftRequested) and asked.session_id == session


def _fell_silent(step: Step) -> bool:
    """Return whether the supervisor has sent END for the session, and its robot has been silent for
    five seconds."""
    session = step.before.session
    assert session is not None
    disowned = session.forgotten is not None and session.forgotten.disowned
    return disowned and step.now >= session.robot.asked_at + 5.0


def _is_its_end(step: Step, event: object) -> bool:
    """Return whether the event is an END that must end the session.

    A person's END must end it. The supervisor's END must end it if the robot no longer repeats its
    request. An END from the robot's own adapter must end it if this adapter or the supervisor has sent
    END before.
    """
    session = step.before.session
    assert session is not None
    forgotten, robot, ends = session.forgotten, session.robot, session.ends
    if isinstance(event, FromAdapter):
        heard_once = forgotten is not None and (forgotten.ended or forgotten.disowned)
        return heard_once and event.asked == EndRequested(session.id)
    if not isinstance(event, EndRequested) or event.session_id != session.id:
        return False
    if 0 < event.stamp < ends.newest * 1e9 and step.now < ends.doubted_since + 1.0:
        return False
    if 0 < event.stamp < ends.newest * 1e9 and ends.doubted_since == -math.inf:
        return False
    just_asked = robot.ended_at < robot.asked_at and step.now < robot.asked_at + 5.0
    goes_on = session.boarded and just_asked and step.now >= robot.ended_at + 3.0
    return event.by_person or not goes_on


def open_is_the_truth(step: Step) -> None:
    """If the report shows OPEN, require a car that stands at a known floor with its door open.

    While the lift has a fault, the report must not show OPEN to a robot that is outside.
    """
    shown: LiftReport = step.decision.report
    if shown.door is not LiftDoor.DOOR_OPEN:
        return
    sample, session = step.world.sample, step.decision.memory.session
    assert step.now < step.decision.memory.senses.read_at + step.limits.t.stale_after_s
    if _sampled(step):
        assert sample.door is DoorReading.OPEN
        assert sample.motion in (None, Motion.STOPPED)
        assert shown.floor == sample.level != ""
    if session and step.decision.outputs.agv_request and shown.mode.name == "MODE_AGV":
        asked_here = step.decision.memory.own.get(session.id) == shown.floor
        assert step.decision.outputs.hold_door or not asked_here
    if session and not session.boarded:
        assert {fault.code for fault in shown.faults} <= HINDER_NOBODY
        assert shown.mode.name == "MODE_AGV"
        elsewhere = shown.floor != shown.destination
        assert step.decision.outputs.hold_door or elsewhere or not session.agv
        if _sampled(step):
            assert sample.agv is not False
            assert not sample.hazards


def a_request_that_waits_has_a_reason(step: Step) -> None:
    """Require a reason in the report for each request that waits.

    A request waits if it has the session and the lift does not show OPEN at the requested floor. If the
    reason is a relay that has switched on too often, the rule also requires a fault.
    """
    shown, session = step.decision.report, step.decision.memory.session
    event = step.event
    waits = session is not None and (
        shown.open_at != session.destination
        or (isinstance(event, LiftRequested) and event.session_id == session.id
            and event.destination != session.destination)
    )  # fmt: skip
    assert bool(shown.waits) >= waits, shown
    assert not shown.waits.endswith(": "), shown
    assert session is not None or not shown.waits
    worn = "RELAY_RESTS" in {fault.code for fault in shown.faults}
    assert worn <= any(_worn(channel, step) for channel in _relays(step))
    written = all(channel.written for channel in _relays(step))
    if shown.waits.endswith("must rest") and written and not worn:
        t = step.limits.t
        rested_at = max(channel.off_at for channel in _relays(step)) + max(
            t.min_off_s, t.dead_time_s
        )
        assert step.now < rested_at


def _relays(step: Step) -> tuple[Any, ...]:
    relays = step.decision.memory.relays
    return relays.agv, relays.call, relays.hold


def _worn(channel: Any, step: Step) -> bool:
    lately = [at for at in channel.ons if step.now - at < MINUTE_S]
    return channel.on is None and len(lately) >= step.limits.t.max_cycles_per_min


def nothing_changes_before_wake_at(world: World, limits: LiftLimits) -> None:
    """Scan now, and scan again right before the core's `wake_at` with the same inputs. Require that the
    outputs and the report stay the same."""
    now = _scan(world, world.memory, 0.0, limits)
    until = min(now.wake_at, 1e4)
    later = _scan(world, now.memory, until * (1.0 - 1e-6), limits)
    assert later.outputs == now.outputs
    assert later.report.news() == now.report.news()
    assert later.report.faults == now.report.faults


def _scan(world: World, memory: LiftMemory, now: float, limits: LiftLimits) -> Any:
    decision = decide(memory, reading(world), now, limits)
    if world.writable:
        return decision
    return decide(decision.memory, WriteFailed("timeout"), now, limits)


def _sampled(step: Step) -> bool:
    """Return whether the step has a reading that counts at once, because this lift has no debounce."""
    read = step.world.readable and not isinstance(step.event, IoFailed)
    return step.exact and (read or isinstance(step.event, Sampled))


def _id(memory: LiftMemory) -> str | None:
    return memory.session.id if memory.session else None
