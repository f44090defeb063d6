"""A charger's report to RMF, the log and the status file, and the function that reads its error texts.

RMF's ChargerState has one text for all errors. From that text the coordinator
(`bridges/kinds/charger_coordinator/`) must find out whether the robot or the station is at fault.
`error_message` writes the text, and `diagnosis` reads it.
"""

from enum import StrEnum
from typing import Final

import msgspec
from msgspec.structs import replace

from bridges.kinds.charger import pad
from bridges.kinds.charger.memory import (
    ChargerLimits,
    ChargerMemory,
    ChargeSession,
    rivalled,
    unreachable,
)
from bridges.kinds.charger.session import cleared_to_start
from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger.signals import CURRENT_FLOWS, Activity, ChargerSample, Measured
from bridges.kinds.shared.decision import Fault
from bridges.messages.definitions import ChargerStateValue

IDLE = ChargerStateValue.CHARGER_IDLE
ASSIGNED = ChargerStateValue.CHARGER_ASSIGNED
CHARGING = ChargerStateValue.CHARGER_CHARGING
RELEASED = ChargerStateValue.CHARGER_RELEASED
ERROR = ChargerStateValue.CHARGER_ERROR

UNREQUESTED = "unrequested/"
"""The beginning of a made-up request id. ChargerState needs an id in every state but IDLE. An error of
a free station and an unrequested charge have no request. In these cases the id is UNREQUESTED and
the charger's name."""

LOST = {
    "TWO_NODES_FOR_ONE_DEVICE": "two nodes for one device",
    "CHARGER_UNREACHABLE": "Charger unreachable",
    "CHARGER_NOT_COMMANDED": "Charger takes no commands",
}
"""Fault codes of stations that cannot be reached or commanded, with the fixed error messages for RMF.
The text of such an error is only in the fault's detail."""
OUT_OF_SERVICE = "out of service after: "
STOPS_WITHIN_S: Final = 3.0
"""The time (s) that a station may need to stop after an order. A longer charge is a fault."""

STATION_NEXT: Final = "for the station to charge"
"""The beginning of the reason for a robot that only the station keeps waiting."""


class FaultCause(StrEnum):
    """The side that has caused an error.

    PAD: a wrong robot or receiver is on the pad. LOST: the station cannot be reached or commanded, so
    neither the robot nor the station is known to be at fault. UNCLEAR: the text names no side. In this
    case the robot tries a second station. If it fails there too, the robot is at fault.
    """

    NONE = ""
    ROBOT = "robot"
    STATION = "station"
    PAD = "pad"
    LOST = "lost"
    UNCLEAR = "unclear"


_BEGINNINGS = {
    "robot:": FaultCause.ROBOT,
    "station:": FaultCause.STATION,
    OUT_OF_SERVICE: FaultCause.STATION,
    pad.RECEIVER_NOT_TOLD_TEXT: FaultCause.STATION,
    pad.WRONG_DOCKING_TEXT: FaultCause.PAD,
    pad.UNKNOWN_RECEIVER_TEXT: FaultCause.PAD,
    **dict.fromkeys(LOST.values(), FaultCause.LOST),
}


def error_message(fault: Fault) -> str:
    """Write ChargerState's error_message for this fault."""
    return LOST.get(fault.code, fault.detail)


def diagnosis(message: str) -> FaultCause:
    """Find the side at fault in a ChargerState's error_message. The beginning of the text names the
    side. Return UNCLEAR for a text with another beginning."""
    found = (whose for start, whose in _BEGINNINGS.items() if message.startswith(start))
    return next(found, FaultCause.UNCLEAR)


class ChargerReport(msgspec.Struct, frozen=True):
    """The content of ChargerState, except its name and stamp.

    `read_at`: monotonic seconds of the last good reading, None before the first. `error_message`:
    filled only in the state CHARGER_ERROR. `request_id`: blank if the station is assigned to no
    request. `fleet`, `robot`: the request's robot. Without a request, `fleet` and `robot` name the
    robot on the pad if the station is not idle. `verified`: the station sees the receiver of the robot
    `fleet`/`robot`. `waits`: the reason why the robot is not charged yet. `waits` is "" in three cases:
    without a request, after the charge, and in ERROR. During the charge it is "" unless the robot must
    get no power now.
    """

    read_at: float | None
    state: ChargerStateValue
    error_message: str = ""
    request_id: str = ""
    fleet: str = ""
    robot: str = ""
    verified: bool = False
    faults: tuple[Fault, ...] = ()
    measured: Measured = Measured()
    waits: str = ""

    def news(self) -> object:
        """Return everything except the age, the measurements and `waits`. If only these three change,
        RMF needs no new message at once."""
        measured = Measured(receiver_id=self.measured.receiver_id)
        return replace(self, read_at=None, measured=measured, waits="")


def report(memory: ChargerMemory, now: float, limits: ChargerLimits) -> ChargerReport:
    """Report the charger's present state."""
    found = errors(memory, now, limits)
    shown = ERROR if found else state(memory)
    lost = unreachable(memory, limits)
    who = _who(memory, shown, limits)
    on_pad = pad.seen(None if lost else memory.sample, limits)
    return ChargerReport(
        read_at=memory.read_at,
        state=shown,
        error_message=error_message(found[0]) if found else "",
        request_id=memory.holder.request.request_id if memory.holder else "",
        fleet=who.fleet if who else "",
        robot=who.name if who else "",
        verified=who is not None and on_pad.robot == who,
        faults=(*found, *_irregular(memory, shown, now, limits)),
        measured=Measured() if lost or memory.sample is None else memory.sample.measured,
        waits=_waits(memory, shown, limits),
    )


def _waits(memory: ChargerMemory, shown: ChargerStateValue, limits: ChargerLimits) -> str:
    """Return the reason why the robot is not charged yet, or must not be charged now."""
    holder, sample = memory.holder, memory.sample
    if not holder or not sample or shown not in (ASSIGNED, CHARGING):
        return ""
    who, not_ready = holder.request.who, pad.not_ready(sample)
    if shown is CHARGING and holder.over:
        return f"for the station to stop: {_over(holder)}"
    if shown is CHARGING:
        return f"because {not_ready}" if not_ready else ""
    if holder.over:
        return "for the end of the charger's handshake: the charger was at fault before"
    if not pad.seen(sample, limits).may_be(who):
        return f"for {who} on the pad"
    if not_ready:
        return f"because {not_ready}"
    ready = holder.started or cleared_to_start(memory, limits)
    return f"{STATION_NEXT} {who}" if ready else f"for {who} in range"


def _over(holder: ChargeSession) -> str:
    """Return why the request is over."""
    return holder.ended or "the charger was at fault"


def state(memory: ChargerMemory) -> ChargerStateValue:
    """Return RMF's state of a station without an error."""
    sample, holder = memory.sample, memory.holder
    if sample is not None and sample.activity in CURRENT_FLOWS:
        return CHARGING
    if holder is None:
        released = sample is not None and sample.activity is Activity.RELEASED
        return RELEASED if released else IDLE
    return ASSIGNED if holder.released_at is None else RELEASED


def errors(memory: ChargerMemory, now: float, limits: ChargerLimits) -> list[Fault]:
    """List the reasons for the state ERROR, most serious first."""
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
        found.append(Fault("PROTECTION", OUT_OF_SERVICE + memory.protection))
    if memory.write_misses >= limits.t.misses:
        found.append(Fault("CHARGER_NOT_COMMANDED", memory.write_fault))
    if not unreachable(memory, limits) and (misplaced := pad.misplaced(memory, limits)):
        found.append(misplaced)
    return found


def error_text(sample: ChargerSample) -> str:
    """Return the station's own error text. Put the side at fault before it, such as `robot: `, if the
    station reports a side."""
    text = sample.error_text or f"the charger reports an error (vendor state {sample.code})"
    if diagnosis(text) in (FaultCause.PAD, FaultCause.LOST):
        text = f"the charger says: {text}"
    side = f"{sample.side}: " if sample.side else ""
    return text if text.startswith(side) else side + text


def _irregular(
    memory: ChargerMemory, shown: ChargerStateValue, now: float, limits: ChargerLimits
) -> list[Fault]:
    """List faults that do not make the state ERROR."""
    holder = memory.holder
    if holder is None:
        who = pad.seen(memory.sample, limits).robot or "the robot is not known"
        fault = Fault("UNREQUESTED_CHARGING", f"nobody requested it: {who}")
        return [fault] if shown is CHARGING else []
    since = memory.disobeyed_since
    still = since is not None and now - since >= STOPS_WITHIN_S
    if shown is CHARGING and still and holder.over and holder.ended != "full":
        whose = holder.request.request_id or holder.request.who
        return [Fault("STILL_CHARGING", f"{whose}: {_over(holder)}")]
    if shown is RELEASED and holder.ended == "start timeout":
        late = f"{holder.request.who} did not start to charge in time"
        why = pad.not_ready(memory.sample) if memory.sample else ""
        return [Fault("START_TIMEOUT", f"{late}: {why}" if why else late)]
    return []


def _who(
    memory: ChargerMemory, shown: ChargerStateValue, limits: ChargerLimits
) -> RobotName | None:
    """Return the request's robot. Without a request, return the robot that the last reading shows on
    the pad.

    Return None in the state IDLE. Return None for a station out of reach too, unless it was charging
    without a request.
    """
    if memory.holder:
        return memory.holder.request.who
    if shown is IDLE or (unreachable(memory, limits) and not memory.adopted):
        return None
    return pad.seen(memory.sample, limits).robot
