"""RMF has no message for a panel's state. The log, the status file and `/diagnostics` show the
state."""

from collections.abc import Mapping

from bridges.kinds.alarm.report import PanelReport
from bridges.messages.definitions import Message, Time


def state_message(name: str, settings: object, report: PanelReport, stamp: Time) -> Message:
    """Raise NotImplementedError. Nobody calls this function, because the kind has no topic of
    states."""
    raise NotImplementedError("RMF has no message for the state of an alarm panel")


def summary(report: PanelReport) -> Mapping[str, str]:
    """Summarise the report in one line, for the log, the status file and `watch`."""
    state = "silent" if report.silent else "drill" if report.alarm.drill else "clear"
    if report.active:
        state = "alarm"
    return {"state": state, "active": ", ".join(report.active) or "-"}
