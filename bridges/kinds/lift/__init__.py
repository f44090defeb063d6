"""Lifts: a LiftRequest switches outputs, and the lift's inputs become a LiftState."""

from bridges.kinds.lift import core, keep, memory, messages, relays, report, signals
from bridges.kinds.lift.memory import LiftLimits, LiftMemory
from bridges.kinds.lift.report import LiftReport
from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.lift.signals import Asked, LiftOutputs, LiftSample
from bridges.kinds.shared.decision import MemoryKept, MemoryNotKept
from bridges.kinds.shared.kind import Kind
from bridges.kinds.shared.recorded import Recorded
from bridges.messages.topics import LIFT_REQUESTS, LIFT_STATES

KIND: Kind[
    LiftSettings,
    LiftLimits,
    LiftMemory,
    LiftSample,
    Asked | MemoryKept | MemoryNotKept,
    LiftOutputs,
    LiftReport,
] = Kind(
    name="lift",
    devices_key="lifts",
    states=LIFT_STATES,
    requests={LIFT_REQUESTS: messages.accept, messages.OWN_REQUESTS: messages.accept_adapters},
    device_name=messages.device_name,
    sender=lambda request: str(request.session_id),
    limits=LiftLimits.of,
    initial=core.initial,
    decide=core.decide,
    repeated=core.repeated,
    published=core.published,
    alarm_inputs=lambda report: report.alarm,
    on_map=lambda settings: settings.on_map(),
    state_message=messages.state_message,
    summary=messages.summary,
    keeping=keep.KEEPING,
)

RECORDED: Recorded = {
    "lift.memory.Channel": relays.Channel,
    "lift.memory.Doubted": memory.Doubted,
    "lift.memory.Forgotten": memory.ForgottenSession,
    "lift.memory.Grace": memory.Grace,
    "lift.memory.Memory": memory.LiftMemory,
    "lift.memory.OwnWords": memory.OwnWords,
    "lift.memory.Position": memory.CarPosition,
    "lift.memory.Relays": relays.Relays,
    "lift.memory.Senses": memory.LiftSenses,
    "lift.memory.Session": memory.LiftSession,
    "lift.report.LiftReport": report.LiftReport,
    "lift.signals.Door": signals.DoorReading,
    "lift.signals.Ended": signals.EndRequested,
    "lift.signals.FromAdapter": signals.FromAdapter,
    "lift.signals.Hazard": signals.Hazard,
    "lift.signals.LiftOutputs": signals.LiftOutputs,
    "lift.signals.LiftSample": signals.LiftSample,
    "lift.signals.Motion": signals.Motion,
    "lift.signals.Requested": signals.LiftRequested,
    "lift.signals.Side": signals.Side,
}
