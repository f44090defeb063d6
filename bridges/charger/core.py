"""The charger's decision core: whose the station is, what it does, and what RMF is told.

1. IDLE → ASSIGNED → CHARGING → RELEASED → IDLE, and ERROR from anywhere. A request only assigns; what
   the station does is what it says, reading by reading. Current that still flows, ramping down too,
   is CHARGING; RELEASED is a station disconnected from its robot.
2. A request is granted while the state is IDLE. Its repeats change nothing, and once it is over they
   do not start it again. Any other request is refused until the station is IDLE.
3. `start_timeout` counts from acceptance. A request that has not charged by then ends in RELEASED and
   IDLE; the reason is a fault, as the error message is blank unless the state is ERROR.
4. A cancel ends the request that it names and no other. While current flows it takes the power away,
   and the state stays CHARGING until the station has stopped.
5. A fault takes the power first and is reported second. What follows is read, never assumed; power
   comes back only with a new request.
6. Failed polls prove nothing: after `misses` of them the state is ERROR, with the robot and request as
   they were. A request ends, and a station becomes free, on a good reading only.
7. Charging that nobody asked for (a robot that parked by itself, or that was charging when this daemon
   started) is shown as it is, without a robot. It is neither stopped nor credited to whoever asks
   next: without a receiver's id that would be a guess, and might send a second robot to the pad. A
   handshake alone is IDLE still, and may be asked for.
8. Errors are cleared when an operator says so, or at most `clear_errors_per_h` times an hour.
"""

from dataclasses import dataclass, replace
from typing import Literal

from bridges.charger.report import ChargerReport
from bridges.charger.settings import Limits
from bridges.charger.signals import CURRENT_FLOWS, Activity, ChargerOutputs, ChargerSample, Measured
from bridges.decision import Decision, Fault, IoFailed, OperatorReset, RivalSeen, Sampled
from bridges.rmf.definitions import ChargerStateValue

RIVAL_GONE_S = 5.0
"""A second node for this charger is gone when unheard for so long; states come at 1 Hz."""
REMEMBERED = 8
"""Requests that are over and whose late repeats are still known."""

NEVER = float("-inf")
IDLE = ChargerStateValue.CHARGER_IDLE
ASSIGNED = ChargerStateValue.CHARGER_ASSIGNED
CHARGING = ChargerStateValue.CHARGER_CHARGING
RELEASED = ChargerStateValue.CHARGER_RELEASED
ERROR = ChargerStateValue.CHARGER_ERROR

MESSAGES = {
    "TWO_NODES_FOR_ONE_DEVICE": "two nodes for one device",
    "CHARGER_UNREACHABLE": "Charger unreachable",
}
"""RMF's error message where it is not the fault's detail: a fixed text, the reason is in the fault."""


@dataclass(frozen=True, slots=True)
class Requested:
    """A ChargerRequest that is ours and well formed; `start_timeout_s` 0 is the configured default."""

    request_id: str
    fleet: str
    robot: str
    start_timeout_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Cancelled:
    """A ChargerCancel."""

    request_id: str


@dataclass(frozen=True, slots=True)
class Holder:
    """The request that occupies the station.

    `start_by`: charging must have started (monotonic s). `started`: current has flowed for it.
    `failed`: the station was at fault since, so there is no power for this request any more.
    `ended`: why it is over; `released_at`: since when it is disconnected.
    """

    request: Requested
    start_by: float
    started: bool = False
    failed: bool = False
    ended: Literal["", "start timeout", "cancelled"] = ""
    released_at: float | None = None


@dataclass(frozen=True, slots=True)
class Memory:
    """Everything that outlives a scan. `sample`: the last good reading, of `read_at`."""

    sample: ChargerSample | None = None
    read_at: float | None = None
    misses: int = 0
    io_fault: str = ""
    holder: Holder | None = None
    over: tuple[str, ...] = ()
    rival_at: float = NEVER
    clear_errors: int = 0
    cleared_at: float = NEVER


Event = Sampled[ChargerSample] | IoFailed | RivalSeen | OperatorReset | Requested | Cancelled


def initial(limits: Limits, now: float) -> Memory:
    """Nothing read, nobody assigned."""
    return Memory()


def decide(
    memory: Memory, event: Event, now: float, limits: Limits
) -> Decision[Memory, ChargerOutputs, ChargerReport]:
    """One scan: take the event in, then derive outputs and report afresh."""
    memory, refused = _take(memory, event, now, limits)
    shown = _report(memory, now, limits)
    outputs = ChargerOutputs(_power(memory, shown.state, now, limits), memory.clear_errors)
    wake_at = memory.rival_at + RIVAL_GONE_S if _rival(memory, now) else float("inf")
    return Decision(memory, outputs, shown, wake_at, refused)


def _take(memory: Memory, event: Event, now: float, limits: Limits) -> tuple[Memory, str]:
    match event:
        case Sampled(sample):
            return _sampled(memory, sample, now, limits), ""
        case IoFailed(reason):
            return replace(memory, misses=memory.misses + 1, io_fault=reason), ""
        case RivalSeen():
            return replace(memory, rival_at=now), ""
        case OperatorReset():
            return _reset(memory, now, limits)
        case Requested():
            return _request(memory, event, now, limits)
        case _:
            return _cancel(memory, event, now)


# ---- a good reading


def _sampled(memory: Memory, sample: ChargerSample, now: float, limits: Limits) -> Memory:
    memory = replace(memory, sample=sample, read_at=now, misses=0, io_fault="")
    if memory.holder:
        holder = _follow(memory.holder, sample.activity, now, limits)
        ended = () if holder else (memory.holder.request.request_id,)
        memory = replace(memory, holder=holder, over=(*memory.over, *ended)[-REMEMBERED:])
    if sample.activity is Activity.ERROR and _may_clear(memory, now, limits):
        memory = _clear(memory, now)
    return memory


def _follow(holder: Holder, activity: Activity, now: float, limits: Limits) -> Holder | None:
    """The request after one reading; None when it is over and the station free."""
    match activity:
        case Activity.CHARGING | Activity.STOPPING:
            return replace(holder, started=True, released_at=None)
        case Activity.ERROR | Activity.UNKNOWN:
            return replace(holder, failed=True)
        case Activity.HANDSHAKE if holder.started and not holder.ended:
            # The coupling was lost and is sought again: the same request waits for its start.
            holder = replace(
                holder, started=False, start_by=now + _patience(holder.request, limits)
            )
        case _:
            pass
    if holder.released_at is not None:
        shown = now - holder.released_at >= limits.released_s
        return None if shown and activity is not Activity.RELEASED else holder
    if holder.started or (holder.failed and activity is not Activity.HANDSHAKE):
        return replace(holder, released_at=now)
    if now >= holder.start_by:
        return replace(holder, ended="start timeout", released_at=now)
    return holder


def _patience(asked: Requested, limits: Limits) -> float:
    return asked.start_timeout_s or limits.start_timeout_s


# ---- requests and the operator


def _request(memory: Memory, asked: Requested, now: float, limits: Limits) -> tuple[Memory, str]:
    holder = memory.holder
    if holder and holder.request.request_id == asked.request_id:
        same = (holder.request.fleet, holder.request.robot) == (asked.fleet, asked.robot)
        return memory, "" if same else "request_id of another robot"
    if asked.request_id in memory.over:
        return memory, "request is over"
    if _errors(memory, now, limits):
        return memory, "charger in error"
    if _state(memory, failed=False) is not IDLE:
        return memory, "charger occupied"
    return replace(memory, holder=Holder(asked, now + _patience(asked, limits))), ""


def _cancel(memory: Memory, cancelled: Cancelled, now: float) -> tuple[Memory, str]:
    holder = memory.holder
    if holder is None or holder.request.request_id != cancelled.request_id:
        known = cancelled.request_id in memory.over
        return memory, "" if known else "request not assigned here"
    if holder.released_at is not None:
        return memory, ""
    released_at = None if holder.started else now
    return replace(memory, holder=replace(holder, ended="cancelled", released_at=released_at)), ""


def _reset(memory: Memory, now: float, limits: Limits) -> tuple[Memory, str]:
    if _rival(memory, now):
        return memory, "two nodes for one device"
    if memory.sample is None or _unreachable(memory, limits):
        return memory, "the charger does not answer"
    if memory.sample.activity is not Activity.ERROR:
        return memory, "the charger reports no error to clear"
    return _clear(memory, now), ""


def _may_clear(memory: Memory, now: float, limits: Limits) -> bool:
    per_hour = limits.clear_errors_per_h
    if per_hour == 0 or _rival(memory, now):
        return False
    return now - memory.cleared_at >= 3600 / per_hour


def _clear(memory: Memory, now: float) -> Memory:
    return replace(memory, clear_errors=memory.clear_errors + 1, cleared_at=now)


# ---- what is shown and driven


def _rival(memory: Memory, now: float) -> bool:
    return now - memory.rival_at < RIVAL_GONE_S


def _unreachable(memory: Memory, limits: Limits) -> bool:
    return memory.sample is None or memory.misses >= limits.misses


def _errors(memory: Memory, now: float, limits: Limits) -> list[Fault]:
    """Why the state is ERROR, most serious first."""
    found = []
    if _rival(memory, now):
        what = "another node publishes this charger's states"
        found.append(Fault("TWO_NODES_FOR_ONE_DEVICE", what))
    sample = memory.sample
    if sample is None or _unreachable(memory, limits):
        found.append(Fault("CHARGER_UNREACHABLE", memory.io_fault or "not read yet"))
    elif sample.activity is Activity.ERROR:
        text = sample.error_text or f"the charger reports an error (vendor state {sample.code})"
        found.append(Fault("CHARGER_ERROR", text))
    elif sample.activity is Activity.UNKNOWN:
        text = f": {sample.error_text}" if sample.error_text else ""
        found.append(Fault("UNKNOWN_VENDOR_STATE", f"unknown vendor state {sample.code}{text}"))
    return found


def _irregular(memory: Memory, state: ChargerStateValue) -> list[Fault]:
    """What is wrong though the state is no ERROR."""
    holder = memory.holder
    if holder is None:
        text = "nobody asked for it: the robot is not known"
        return [Fault("UNREQUESTED_CHARGING", text)] if state is CHARGING else []
    stopping = memory.sample and memory.sample.activity is Activity.STOPPING
    if state is CHARGING and not stopping and (holder.ended or holder.failed):
        what = holder.ended or "the charger was at fault"
        return [Fault("STILL_CHARGING", f"{holder.request.request_id}: {what}")]
    if state is RELEASED and holder.ended == "start timeout":
        robot = f"{holder.request.fleet}/{holder.request.robot}"
        return [Fault("START_TIMEOUT", f"{robot} did not start to charge in time")]
    return []


def _state(memory: Memory, failed: bool) -> ChargerStateValue:
    sample, holder = memory.sample, memory.holder
    if failed or sample is None:
        return ERROR
    if sample.activity in CURRENT_FLOWS:
        return CHARGING
    if holder is None:
        return RELEASED if sample.activity is Activity.RELEASED else IDLE
    return ASSIGNED if holder.released_at is None else RELEASED


def _report(memory: Memory, now: float, limits: Limits) -> ChargerReport:
    errors = _errors(memory, now, limits)
    state = _state(memory, bool(errors))
    sample = None if _unreachable(memory, limits) else memory.sample
    asked = memory.holder.request if memory.holder else Requested("", "", "")
    return ChargerReport(
        read_at=memory.read_at,
        state=state,
        error_message=MESSAGES.get(errors[0].code, errors[0].detail) if errors else "",
        request_id=asked.request_id,
        fleet=asked.fleet,
        robot=asked.robot,
        faults=(*errors, *_irregular(memory, state)),
        measured=Measured() if sample is None else sample.measured,
    )


def _power(memory: Memory, state: ChargerStateValue, now: float, limits: Limits) -> bool | None:
    """May the station energise? None: leave it as it is."""
    holder = memory.holder
    if _rival(memory, now):
        return False
    if _unreachable(memory, limits):
        return None
    if holder is None:
        return None if state is CHARGING else False
    return not (holder.failed or holder.ended or holder.released_at is not None)
