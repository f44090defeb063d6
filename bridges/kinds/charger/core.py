"""The charger's decision core. It decides on requests, on the station's power, and on the report to
RMF.

CHARGER-1. The states are IDLE → ASSIGNED → CHARGING → RELEASED → IDLE, and ERROR from any of them. A
   request can change the state only to ASSIGNED. The station's readings cause every other change.
   CHARGING lasts as long as current flows, even if the current is already ramping down. In RELEASED the
   station is disconnected from its robot, and the pad is not clear yet.
CHARGER-2. A request is granted only in the state IDLE. A repeat of a granted request changes nothing,
   even after the request has ended. Every other request is refused until the station is IDLE. One
   exception: if the station can identify the robot on the pad, a request for that robot may be granted
   (`pad.py`).
CHARGER-3. `start_timeout` counts from the grant. If no charge starts within this time, the request
   ends, and the state goes through RELEASED to IDLE. If the station loses the robot during the charge
   and searches for it again, the rest of this time counts on. Only a charge that has lasted for
   `start_timeout` makes it begin anew. A fault shows the reason, because RMF leaves the error message
   blank in every state but ERROR.
CHARGER-4. A cancel ends only the request that the cancel names. If current flows, the power is switched
   off, and the state stays CHARGING until the station has stopped. A full battery ends a request in the
   same way. A cancel may arrive before its request, because they have two topics. The request is
   then refused.
CHARGER-5. The station is energised only for its assigned robot. That robot must be on the pad and in
   range, and a movable pad must be at its height. If another robot is on the pad, it gets no power. The
   state is then ERROR, and the error message names that other robot. The request stays assigned and
   waits.
CHARGER-6. At a fault the core first switches the power off and then reports the fault. Only a new
   request brings power back. A station is out of service (PROTECTION) if it reports a fault, or if it
   does not stop charging within `stop_timeout_s` of an order to stop. This time begins only when the
   order was written, and again after `misses` failed polls or failed commands. The state is then ERROR
   until the errors have been cleared and a good reading follows. A fault of the robot does not take
   the station out of service.
CHARGER-7. A failed poll does not show whether the charge goes on. After `misses` failed polls the state
   is ERROR, but the robot and the request stay. Only a good reading ends a request, frees a station
   or begins a charge.
   An operator can free a silent station after `peer_internal_timeout_s`, because by then it must have
   switched itself off.
CHARGER-8. A charge may be under way when the daemon starts, or when it reaches the station again. Such
   a charge is shown and not stopped. The next request takes that charge over only if the request's
   robot is seen on the pad. Any other charge without a request is stopped, unless `serve_known` grants
   the station to the robot that is seen on the pad.
CHARGER-9. Errors are cleared when an operator orders it. The daemon itself clears errors at most
   `clear_errors_per_h` times an hour.
CHARGER-10. If another node publishes states under this charger's name, the power is off, no error is
   cleared, and the state is ERROR.
"""

from msgspec.structs import replace

from bridges.kinds.charger import pad, report, sensing, session
from bridges.kinds.charger.memory import (
    ChargerLimits,
    ChargerMemory,
    ChargeSession,
    rivalled,
    unreachable,
)
from bridges.kinds.charger.refusals import OCCUPIED
from bridges.kinds.charger.report import ChargerReport
from bridges.kinds.charger.signals import (
    AT_FAULT,
    CURRENT_FLOWS,
    Activity,
    Cancelled,
    ChargeRequested,
    ChargerOutputs,
    ChargerSample,
    Event,
)
from bridges.kinds.shared.debounce import forget
from bridges.kinds.shared.decision import (
    Decision,
    IoFailed,
    OperatorReset,
    RivalSeen,
    Sampled,
    WriteFailed,
)
from bridges.kinds.shared.durations import AGES_AGO, NEVER, RIVAL_QUIET_S

REMEMBERED = 8
"""The number of ended requests that a charger remembers, in order to refuse late repeats."""
CLEARED_WITHIN_S = 30.0
"""The time (s) after an order to clear errors. A good reading within this time proves that the order
succeeded."""


def initial(limits: ChargerLimits, now: float) -> ChargerMemory:
    """Return the memory at start, before any reading or request."""
    return ChargerMemory()


def decide(
    memory: ChargerMemory, event: Event, now: float, limits: ChargerLimits
) -> Decision[ChargerMemory, ChargerOutputs, ChargerReport]:
    """Apply the event, and derive the outputs and the report."""
    memory, refused = _take(memory, event, now, limits)
    memory = replace(memory, power=_power(memory, now, limits))
    outputs = ChargerOutputs(memory.power, memory.clear_errors, memory.range_checks)
    changes = memory.rival_at + RIVAL_QUIET_S, sensing.settles_at(memory, limits)
    wake_at = min((at for at in changes if at > now), default=NEVER)
    return Decision(memory, outputs, report.report(memory, now, limits), wake_at, refused)


def _take(
    memory: ChargerMemory, event: Event, now: float, limits: ChargerLimits
) -> tuple[ChargerMemory, str]:
    match event:
        case Sampled(sample):
            return _sampled(memory, sample, now, limits), ""
        case WriteFailed(reason):
            misses = memory.write_misses + 1
            memory = replace(memory, write_misses=misses, write_failed=True, write_fault=reason)
            if misses >= limits.t.misses:
                memory = replace(memory, disobeyed_since=None)
            return _unordered(memory), ""
        case IoFailed(reason):
            return _missed(memory, reason, limits), ""
        case RivalSeen():
            return replace(memory, rival_at=now), ""
        case OperatorReset():
            return _reset(memory, now, limits)
        case ChargeRequested():
            return _request(memory, event, now, limits)
        case _:
            return _cancel(memory, event, now)


def _unordered(memory: ChargerMemory) -> ChargerMemory:
    """Let no later reading prove an order that this scan could not write: to check the range, or to
    clear errors."""
    holder, read_at = memory.holder, memory.read_at
    if read_at is None:
        return memory
    if holder and holder.checked_at is not None and holder.checked_at >= read_at:
        memory = replace(memory, holder=session.unchecked(holder))
    return replace(memory, clear_by=AGES_AGO) if memory.cleared_at >= read_at else memory


def _missed(memory: ChargerMemory, reason: str, limits: ChargerLimits) -> ChargerMemory:
    """Count a failed poll. The debounce restarts after it."""
    memory = replace(memory, misses=memory.misses + 1, io_fault=reason)
    if unreachable(memory, limits):
        return replace(memory, contacts=None, disobeyed_since=None)
    return replace(memory, contacts=forget(memory.contacts))


# ---- a good reading


def _sampled(
    memory: ChargerMemory, sample: ChargerSample, now: float, limits: ChargerLimits
) -> ChargerMemory:
    came, written = unreachable(memory, limits), not memory.write_failed
    sample = pad.judged(sample)
    if limits.debounce:
        contacts = sensing.settled(memory.contacts, sample, now, limits)
        memory = replace(memory, contacts=contacts)
        if contacts.value is None:
            return memory
        sample = sensing.as_settled(sample, contacts.value)
    memory = replace(
        memory,
        sample=sample,
        read_at=now,
        misses=0,
        io_fault="",
        write_misses=memory.write_misses if memory.write_failed else 0,
        write_failed=False,
    )
    if memory.holder:
        holder = session.unchecked(memory.holder) if came else memory.holder
        memory = _held(memory, session.follow(holder, sample, now, limits))
    flows = memory.holder is None and sample.activity in CURRENT_FLOWS
    memory = replace(memory, adopted=flows and (came or memory.adopted))
    memory = _protected(_watched(memory, written, now), now, limits)
    memory = session.range_checked(_served(memory, now, limits), now, limits)
    if sample.activity is Activity.ERROR and _may_clear(memory, now, limits):
        memory = _clear(memory, now)
    return memory


def _held(memory: ChargerMemory, holder: ChargeSession | None) -> ChargerMemory:
    """Replace the session (the request that has the station) by `holder`. If `holder` is None, remember
    the id of the ended request in `over`."""
    if holder or not memory.holder:
        return replace(memory, holder=holder)
    ended = memory.holder.request.request_id
    return _with_over(replace(memory, holder=None), ended)


def _with_over(memory: ChargerMemory, request_id: str) -> ChargerMemory:
    """Remember that this request is over; "" is no request."""
    over = (*memory.over, request_id)[-REMEMBERED:] if request_id else memory.over
    return replace(memory, over=over)


def _watched(memory: ChargerMemory, written: bool, now: float) -> ChargerMemory:
    """Note the time since which the station has charged in spite of an order to stop. `written`: no
    command of the last scan has failed."""
    sample = memory.sample
    charges = sample and (sample.activity is Activity.CHARGING or sample.charges)
    if memory.power is not False or not charges:
        return replace(memory, disobeyed_since=None)
    since = memory.disobeyed_since
    return replace(memory, disobeyed_since=now if since is None and written else since)


def _protected(memory: ChargerMemory, now: float, limits: ChargerLimits) -> ChargerMemory:
    """Put the station out of service if the station itself is at fault. A good reading after an order
    to clear errors puts the station back into service."""
    sample, since = memory.sample, memory.disobeyed_since
    assert sample
    if not limits.can_stop:
        return memory
    if since is not None and now - since >= limits.t.stop_timeout_s:
        what = "station: it goes on charging after an order to stop; cut its supply"
        return replace(memory, protection=what)
    if sample.activity is Activity.ERROR and sample.side != "robot":
        return replace(memory, protection=report.error_text(sample))
    if now <= memory.clear_by and sample.activity not in AT_FAULT | CURRENT_FLOWS:
        return replace(memory, protection="", clear_by=AGES_AGO)
    return memory


def _served(memory: ChargerMemory, now: float, limits: ChargerLimits) -> ChargerMemory:
    """Grant the station to a known robot that stands on its pad without a request. This is done only if
    `unrequested` is `serve_known` and no request has the station."""
    who = pad.seen(memory.sample, limits).robot
    if limits.unrequested != "serve_known" or who is None or memory.holder:
        return memory
    wrong = [f for f in report.errors(memory, now, limits) if f.code != pad.WRONG_DOCKING]
    if wrong:
        return memory
    request = ChargeRequested("", who.fleet, who.name)
    flows = memory.sample is not None and memory.sample.activity in CURRENT_FLOWS
    holder = replace(session.granted(request, now, limits), started=flows)
    return replace(memory, holder=holder, adopted=False)


# ---- requests and the operator


def _request(
    memory: ChargerMemory, request: ChargeRequested, now: float, limits: ChargerLimits
) -> tuple[ChargerMemory, str]:
    holder = memory.holder
    if holder and holder.request.request_id == request.request_id:
        return memory, "" if holder.request.who == request.who else "request_id of another robot"
    if request.request_id in memory.over:
        return memory, "request is over"
    if limits.receivers and request.who not in limits.receivers.values():
        return memory, "robot has no receiver here"
    on_pad = pad.seen(memory.sample, limits).robot == request.who
    if _in_the_way(memory, on_pad, now, limits):
        return memory, "charger in error"
    if holder is None:
        return _granted(memory, request, on_pad, now, limits)
    if on_pad and not holder.request.request_id and not holder.over:
        return replace(memory, holder=session.taken_over(holder, request, now, limits)), ""
    if on_pad and session.shown_released(holder, now, limits):
        again = session.granted(request, now, limits)
        return replace(_held(memory, None), holder=again), ""
    return memory, OCCUPIED


def _granted(
    memory: ChargerMemory, request: ChargeRequested, on_pad: bool, now: float, limits: ChargerLimits
) -> tuple[ChargerMemory, str]:
    holder = session.granted(request, now, limits)
    if memory.adopted and on_pad:
        return replace(memory, holder=replace(holder, started=True), adopted=False), ""
    if report.state(memory) is not report.IDLE:
        return memory, OCCUPIED
    return replace(memory, holder=holder), ""


def _in_the_way(memory: ChargerMemory, on_pad: bool, now: float, limits: ChargerLimits) -> bool:
    """Return whether an error forbids a grant of this request. If the request's robot is on the pad
    (`on_pad`), the error WRONG_DOCKING does not count."""
    found = report.errors(memory, now, limits)
    return any(not (on_pad and fault.code == pad.WRONG_DOCKING) for fault in found)


def _cancel(memory: ChargerMemory, cancelled: Cancelled, now: float) -> tuple[ChargerMemory, str]:
    holder = memory.holder
    if holder is None or holder.request.request_id != cancelled.request_id:
        if cancelled.request_id in memory.over:
            return memory, ""
        return _with_over(memory, cancelled.request_id), "request not assigned here"
    at = holder.released_at
    if at is None and not holder.started:
        at = now
    ended = holder.ended or "cancelled"
    return replace(memory, holder=replace(holder, ended=ended, released_at=at)), ""


def _reset(memory: ChargerMemory, now: float, limits: ChargerLimits) -> tuple[ChargerMemory, str]:
    if rivalled(memory, now):
        return memory, "two nodes for one device"
    if memory.sample is None or unreachable(memory, limits):
        return _freed(memory, now, limits)
    if memory.sample.activity is not Activity.ERROR and not memory.protection:
        return memory, "the charger reports no error to clear"
    return _clear(memory, now), ""


def _freed(memory: ChargerMemory, now: float, limits: ChargerLimits) -> tuple[ChargerMemory, str]:
    """Free a station that does not answer, because an operator orders it. The station must have been
    silent for so long that it has switched itself off."""
    after_s = limits.t.peer_internal_timeout_s
    silent_s = NEVER if memory.read_at is None else now - memory.read_at
    if memory.holder is None or after_s is None or silent_s < after_s:
        return memory, "the charger does not answer"
    return _held(memory, None), ""


def _may_clear(memory: ChargerMemory, now: float, limits: ChargerLimits) -> bool:
    per_hour = limits.t.clear_errors_per_h
    if per_hour == 0 or rivalled(memory, now):
        return False
    return now - memory.cleared_at >= 3600 / per_hour


def _clear(memory: ChargerMemory, now: float) -> ChargerMemory:
    return replace(
        memory,
        clear_errors=memory.clear_errors + 1,
        cleared_at=now,
        clear_by=now + CLEARED_WITHIN_S,
    )


# ---- power


def _power(memory: ChargerMemory, now: float, limits: ChargerLimits) -> bool | None:
    """Return the order about the pad's power: True for on, False for off, None for no order."""
    holder = memory.holder
    if rivalled(memory, now) or memory.protection or (holder and holder.over):
        return False
    if sensing.shows_fault(memory):
        return False
    if unreachable(memory, limits):
        return None
    assert memory.sample
    if memory.sample.activity in AT_FAULT or pad.misplaced(memory, limits):
        return False
    if holder is None:
        return None if pad.left_alone(memory, limits) else False
    if pad.not_ready(memory.sample):
        return False
    if memory.misses and memory.power is False:
        return False  # only a good reading switches on again
    return holder.started or session.cleared_to_start(memory, limits)
