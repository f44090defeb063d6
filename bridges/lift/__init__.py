"""Lifts: RMF's LiftRequest becomes outputs, and the lift's inputs become LiftState."""

from bridges.core.kind import Kind
from bridges.lift import core, messages
from bridges.lift.memory import LiftLimits, Memory
from bridges.lift.report import LiftReport
from bridges.lift.settings import LiftSettings
from bridges.lift.signals import Asked, LiftOutputs, LiftSample
from bridges.rmf.topics import LIFT_REQUESTS, LIFT_STATES

KIND: Kind[
    LiftSettings,
    LiftLimits,
    Memory,
    LiftSample,
    Asked,
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
    published=core.published,
    publishes=messages.alarm_topics,
    on_map=lambda settings: settings.on_map(),
    state_message=messages.state_message,
    summary=messages.summary,
)
