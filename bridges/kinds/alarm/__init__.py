"""Alarm panels, such as a fire panel or a hospital's code blue panel. Their contacts stop the robots of
the site's fleets."""

from bridges.kinds.alarm import core, memory, messages, report, signals
from bridges.kinds.alarm.memory import PanelLimits, PanelMemory
from bridges.kinds.alarm.report import PanelReport
from bridges.kinds.alarm.settings import PanelSettings
from bridges.kinds.alarm.signals import PanelOutputs, PanelSample
from bridges.kinds.shared.decision import OperatorReset
from bridges.kinds.shared.kind import Kind
from bridges.kinds.shared.recorded import Recorded

KIND: Kind[
    PanelSettings,
    PanelLimits,
    PanelMemory,
    PanelSample,
    OperatorReset,
    PanelOutputs,
    PanelReport,
] = Kind(
    name="alarm",
    devices_key="alarms",
    limits=PanelLimits.of,
    initial=core.initial,
    decide=core.decide,
    summary=messages.summary,
    alarm_inputs=lambda report: report.alarm,
    drives=False,
)

RECORDED: Recorded = {
    "alarm.memory.PanelMemory": memory.PanelMemory,
    "alarm.report.PanelReport": report.PanelReport,
    "alarm.signals.PanelOutputs": signals.PanelOutputs,
    "alarm.signals.PanelSample": signals.PanelSample,
}
