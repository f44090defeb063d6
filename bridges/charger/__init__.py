"""Chargers: RMF's ChargerRequest to a station, and the truth about it as ChargerState."""

from collections.abc import Mapping

from bridges.charger import core, messages
from bridges.charger.report import ChargerReport
from bridges.charger.settings import ChargerLimits, ChargerSettings
from bridges.charger.signals import ChargerOutputs, ChargerSample
from bridges.core.kind import Kind
from bridges.rmf.topics import CHARGER_CANCELS, CHARGER_REQUESTS, CHARGER_STATES


def limits(settings: ChargerSettings, debounce_s: Mapping[str, float]) -> ChargerLimits:
    """The core's facts: a charger has no contacts to debounce."""
    return ChargerLimits.of(settings)


KIND: Kind[
    ChargerSettings,
    ChargerLimits,
    core.Memory,
    ChargerSample,
    core.Requested | core.Cancelled,
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
    limits=limits,
    initial=core.initial,
    decide=core.decide,
    state_message=messages.state_message,
    summary=messages.summary,
)
