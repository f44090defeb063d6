"""The session of one request, from its grant to its end. Each reading advances the session."""

from msgspec.structs import replace

from bridges.kinds.charger import pad
from bridges.kinds.charger.memory import ChargerLimits, ChargerMemory, ChargeSession
from bridges.kinds.charger.signals import (
    AT_FAULT,
    CURRENT_FLOWS,
    Activity,
    ChargeRequested,
    ChargerSample,
)
from bridges.kinds.shared.durations import NEVER

RANGE_EVERY_S = 5.0
"""The least time (s) between two range checks (Xnergy RCU: wait 5 s between two checks)."""


def granted(request: ChargeRequested, now: float, limits: ChargerLimits) -> ChargeSession:
    """Grant the station to a request. The request's `start_timeout` counts from now."""
    return ChargeSession(request, now + _patience_s(request, limits))


def taken_over(
    holder: ChargeSession, request: ChargeRequested, now: float, limits: ChargerLimits
) -> ChargeSession:
    """Continue a session that began without a request, and give it the robot's new request."""
    return replace(holder, request=request, start_by=now + _patience_s(request, limits))


def _patience_s(request: ChargeRequested, limits: ChargerLimits) -> float:
    return request.start_timeout_s or limits.t.start_timeout_s


def follow(
    holder: ChargeSession, sample: ChargerSample, now: float, limits: ChargerLimits
) -> ChargeSession | None:
    """Advance the session by one reading. Return None when the session is over and the station is
    free."""
    on_pad = pad.seen(sample, limits)
    another = on_pad.is_another(holder.request.who)
    if not on_pad.may_be(holder.request.who):
        holder = unchecked(holder)
    if sample.activity in AT_FAULT and not (another and sample.side == "robot"):
        return replace(holder, failed=True)
    if another:
        return _beside_another(holder, now, limits)
    holder = _resumed(holder, now)
    if sample.activity in CURRENT_FLOWS:
        return _flowing(holder, sample, now, limits)
    if sample.activity is Activity.HANDSHAKE and holder.started and not holder.ended:
        holder = _sought_again(holder, now, limits)
    if holder.released_at is not None:
        there = limits.receivers and on_pad.robot == holder.request.who
        gone = shown_released(holder, now, limits) and not there
        return None if gone and sample.activity is not Activity.RELEASED else holder
    return _pending(holder, sample.activity, on_pad, now)


def unchecked(holder: ChargeSession) -> ChargeSession:
    """Let the last range check prove nothing. The next one comes after RANGE_EVERY_S."""
    return replace(holder, check_is_void=True)


def shown_released(holder: ChargeSession, now: float, limits: ChargerLimits) -> bool:
    """Return whether the state has been RELEASED for at least `released_s`."""
    return holder.released_at is not None and now - holder.released_at >= limits.t.released_s


def _beside_another(
    holder: ChargeSession, now: float, limits: ChargerLimits
) -> ChargeSession | None:
    """Advance the session by a reading that shows another robot on the pad. The request's robot either
    still waits for the pad, or has left after its charge."""
    if shown_released(holder, now, limits):
        return None
    if holder.released_at is not None:
        return holder
    if holder.started or holder.over:
        return replace(holder, ended=holder.ended or "left", released_at=now)
    return holder if holder.paused_at is not None else replace(holder, paused_at=now)


def _resumed(holder: ChargeSession, now: float) -> ChargeSession:
    if holder.paused_at is None:
        return holder
    return replace(holder, start_by=holder.start_by + now - holder.paused_at, paused_at=None)


def _flowing(
    holder: ChargeSession, sample: ChargerSample, now: float, limits: ChargerLimits
) -> ChargeSession:
    percent = sample.measured.battery_percent
    full = percent is not None and percent >= limits.t.full_percent and not holder.ended
    return replace(
        holder,
        started=True,
        flowed_at=holder.flowed_at if holder.started else now,
        released_at=None,
        ended="full" if full else holder.ended,
    )


def _sought_again(holder: ChargeSession, now: float, limits: ChargerLimits) -> ChargeSession:
    """Let the session wait for a new start, because the station has lost the receiver and searches for
    it again. After a short charge only the rest of the start timeout is left."""
    patience_s = _patience_s(holder.request, limits)
    flowed_s = NEVER if holder.flowed_at is None else now - holder.flowed_at
    by = now + patience_s if flowed_s >= patience_s else holder.start_by + flowed_s
    return replace(holder, started=False, start_by=by, checked_at=None)


def _pending(
    holder: ChargeSession, activity: Activity, on_pad: pad.PadOccupant, now: float
) -> ChargeSession:
    if not holder.request.request_id and on_pad.sort == "empty":
        return replace(holder, ended=holder.ended or "left", released_at=now)
    if holder.started or (holder.failed and activity is not Activity.HANDSHAKE):
        return replace(holder, released_at=now)
    if now >= holder.start_by:
        return replace(holder, ended="start timeout", released_at=now)
    return holder


# ---- permission to start


def cleared_to_start(memory: ChargerMemory, limits: ChargerLimits) -> bool:
    """Return whether the right robot is on the pad, with its coil in range for charging. A station that
    cannot tell one of the two does not forbid the start."""
    holder, sample = memory.holder, memory.sample
    if holder is None or sample is None or memory.read_at is None:
        return False
    if not pad.seen(sample, limits).may_be(holder.request.who):
        return False
    if sample.measured.in_range is None:
        return True
    if holder.checked_at is None or holder.check_is_void:
        return False
    return memory.read_at > holder.checked_at and sample.measured.in_range


def range_checked(memory: ChargerMemory, now: float, limits: ChargerLimits) -> ChargerMemory:
    """Order a range check if nothing else forbids the start. The station then checks whether the
    robot's coil is in range for charging. The result counts only if it was read after this order."""
    holder, sample = memory.holder, memory.sample
    if holder is None or sample is None or holder.started or holder.over:
        return memory
    if sample.measured.in_range is None or sample.activity in AT_FAULT or pad.not_ready(sample):
        return memory
    if not pad.seen(sample, limits).may_be(holder.request.who):
        return memory
    asked = holder.checked_at
    if asked is not None and (now - asked < RANGE_EVERY_S or cleared_to_start(memory, limits)):
        return memory
    holder = replace(holder, checked_at=now, check_is_void=False)
    return replace(memory, holder=holder, range_checks=memory.range_checks + 1)
