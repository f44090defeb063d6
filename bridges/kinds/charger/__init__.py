"""Chargers: a ChargerRequest commands a station, and the station's readings become a ChargerState."""

from bridges.kinds.charger import core, memory, messages, refusals, report, settings, signals
from bridges.kinds.charger.memory import ChargerLimits, ChargerMemory
from bridges.kinds.charger.report import ChargerReport
from bridges.kinds.charger.settings import ChargerSettings
from bridges.kinds.charger.signals import Cancelled, ChargeRequested, ChargerOutputs, ChargerSample
from bridges.kinds.shared.kind import Kind
from bridges.kinds.shared.recorded import Recorded
from bridges.messages.topics import (
    CHARGER_CANCELS,
    CHARGER_REFUSALS,
    CHARGER_REQUESTS,
    CHARGER_STATES,
)

KIND: Kind[
    ChargerSettings,
    ChargerLimits,
    ChargerMemory,
    ChargerSample,
    ChargeRequested | Cancelled,
    ChargerOutputs,
    ChargerReport,
] = Kind(
    name="charger",
    devices_key="chargers",
    states=CHARGER_STATES,
    requests={
        CHARGER_REQUESTS: messages.accept_request,
        CHARGER_CANCELS: messages.accept_cancel,
    },
    device_name=messages.device_name,
    sender=lambda request: str(request.request_id),
    limits=ChargerLimits.of,
    initial=core.initial,
    decide=core.decide,
    state_message=messages.state_message,
    summary=messages.summary,
    publishes=lambda settings: (CHARGER_REFUSALS,),
    answer=refusals.answer,
)

RECORDED: Recorded = {
    "charger.memory.Memory": memory.ChargerMemory,
    "charger.memory.Session": memory.ChargeSession,
    "charger.report.ChargerReport": report.ChargerReport,
    "charger.settings.Robot": settings.RobotName,
    "charger.signals.Activity": signals.Activity,
    "charger.signals.Cancelled": signals.Cancelled,
    "charger.signals.ChargerOutputs": signals.ChargerOutputs,
    "charger.signals.ChargerSample": signals.ChargerSample,
    "charger.signals.Measured": signals.Measured,
    "charger.signals.Requested": signals.ChargeRequested,
}
