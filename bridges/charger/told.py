"""What RMF is told of a charger: its state, what is wrong with it, and for whom it is there."""

from bridges.charger import pad
from bridges.charger.memory import Memory, rivalled, unreachable
from bridges.charger.report import ChargerReport
from bridges.charger.settings import ChargerLimits, Robot
from bridges.charger.signals import CURRENT_FLOWS, Activity, ChargerSample, Measured
from bridges.core.decision import Fault
from bridges.rmf.definitions import ChargerStateValue

IDLE = ChargerStateValue.CHARGER_IDLE
ASSIGNED = ChargerStateValue.CHARGER_ASSIGNED
CHARGING = ChargerStateValue.CHARGER_CHARGING
RELEASED = ChargerStateValue.CHARGER_RELEASED
ERROR = ChargerStateValue.CHARGER_ERROR

MESSAGES = {
    "TWO_NODES_FOR_ONE_DEVICE": "two nodes for one device",
    "CHARGER_UNREACHABLE": "Charger unreachable",
    "CHARGER_NOT_COMMANDED": "Charger takes no commands",
}
"""RMF's error message where it is not the fault's detail: a fixed text, the reason is in the fault."""


def report(memory: Memory, now: float, limits: ChargerLimits) -> ChargerReport:
    """Everything, afresh."""
    found = errors(memory, now, limits)
    shown = ERROR if found else state(memory)
    lost = unreachable(memory, limits)
    who = _who(memory, shown, limits)
    on_pad = pad.seen(None if lost else memory.sample, limits)
    return ChargerReport(
        read_at=memory.read_at,
        state=shown,
        error_message=MESSAGES.get(found[0].code, found[0].detail) if found else "",
        request_id=memory.holder.request.request_id if memory.holder else "",
        fleet=who.fleet if who else "",
        robot=who.name if who else "",
        verified=who is not None and on_pad.robot == who,
        faults=(*found, *_irregular(memory, shown, limits)),
        measured=Measured() if lost or memory.sample is None else memory.sample.measured,
    )


def state(memory: Memory) -> ChargerStateValue:
    """RMF's state of a station that is in no error."""
    sample, holder = memory.sample, memory.holder
    if sample is not None and sample.activity in CURRENT_FLOWS:
        return CHARGING
    if holder is None:
        released = sample is not None and sample.activity is Activity.RELEASED
        return RELEASED if released else IDLE
    return ASSIGNED if holder.released_at is None else RELEASED


def errors(memory: Memory, now: float, limits: ChargerLimits) -> list[Fault]:
    """Why the state is ERROR, most serious first."""
    found = []
    if rivalled(memory, now):
        what = "another node publishes this charger's states"
        found.append(Fault("TWO_NODES_FOR_ONE_DEVICE", what))
    sample = memory.sample
    if sample is None or unreachable(memory, limits):
        found.append(Fault("CHARGER_UNREACHABLE", memory.io_fault or "not read yet"))
    elif sample.activity is Activity.ERROR:
        found.append(Fault("CHARGER_ERROR", error_text(sample)))
    elif sample.activity is Activity.UNKNOWN:
        text = f": {sample.error_text}" if sample.error_text else ""
        found.append(Fault("UNKNOWN_VENDOR_STATE", f"unknown vendor state {sample.code}{text}"))
    if memory.protection:
        what = f"out of service after: {memory.protection}"
        found.append(Fault("PROTECTION", what))
    if memory.write_misses >= limits.t.misses:
        found.append(Fault("CHARGER_NOT_COMMANDED", memory.write_fault))
    if not unreachable(memory, limits) and (misplaced := pad.misplaced(memory, limits)):
        found.append(misplaced)
    return found


def error_text(sample: ChargerSample) -> str:
    """A station's error in its own words, with the side that is at fault before them."""
    text = sample.error_text or f"the charger reports an error (vendor state {sample.code})"
    side = f"{sample.side}: " if sample.side else ""
    return text if text.startswith(side) else side + text


def _irregular(memory: Memory, shown: ChargerStateValue, limits: ChargerLimits) -> list[Fault]:
    """What is wrong though the state is no ERROR."""
    holder = memory.holder
    if holder is None:
        who = pad.seen(memory.sample, limits).robot or "the robot is not known"
        fault = Fault("UNREQUESTED_CHARGING", f"nobody asked for it: {who}")
        return [fault] if shown is CHARGING else []
    stopping = memory.sample and memory.sample.activity is Activity.STOPPING
    if shown is CHARGING and not stopping and holder.over and holder.ended != "full":
        what = holder.ended or "the charger was at fault"
        return [Fault("STILL_CHARGING", f"{holder.request.request_id}: {what}")]
    if shown is RELEASED and holder.ended == "start timeout":
        return [Fault("START_TIMEOUT", f"{holder.request.who} did not start to charge in time")]
    return []


def _who(memory: Memory, shown: ChargerStateValue, limits: ChargerLimits) -> Robot | None:
    """Whom it is for; where it is for nobody, who stands there, or was charged when last seen."""
    if memory.holder:
        return memory.holder.request.who
    if shown is IDLE or (unreachable(memory, limits) and not memory.adopted):
        return None
    return pad.seen(memory.sample, limits).robot
