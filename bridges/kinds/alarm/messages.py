"""The panel's state as a line of text. RMF has no message for it, so only the log, the status file and
`/diagnostics` show it."""

from collections.abc import Mapping

from bridges.kinds.alarm.report import PanelReport


def summary(report: PanelReport) -> Mapping[str, str]:
    """Summarise the report in one line, for the log, the status file and `watch`."""
    state = "silent" if report.silent else "drill" if report.alarm.drill else "clear"
    if report.active:
        state = "alarm"
    return {"state": state, "active": ", ".join(report.active) or "-"}
