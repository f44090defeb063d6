"""Turns requests and cancels into events, refuses invalid messages, and makes ChargerStates."""

from collections.abc import Mapping

from bridges.kinds.charger.report import UNREQUESTED, ChargerReport
from bridges.kinds.charger.settings import ChargerSettings
from bridges.kinds.charger.signals import Cancelled, ChargeRequested
from bridges.kinds.shared.decision import RequestRefused
from bridges.kinds.shared.names import check_length
from bridges.messages.definitions import (
    ChargerCancel,
    ChargerRequest,
    ChargerState,
    ChargerStateValue,
    Duration,
    Time,
)
from bridges.messages.stamps import duration, in_seconds

LONGEST_TIMEOUT_S = 86400.0
"""The longest accepted timeout (s): one day. A longer timeout was probably given in a wrong unit."""


def accept_request(request: ChargerRequest, settings: ChargerSettings) -> ChargeRequested:
    """Turn a ChargerRequest into an event. Raises RequestRefused if the request is malformed.

    A start_timeout of zero means the configured default.
    """
    _check("request_id", request.request_id)
    _check("fleet_name", request.fleet_name)
    _check("robot_name", request.robot_name)
    if request.request_id.startswith(UNREQUESTED):
        raise RequestRefused(
            "reserved request_id", f"{UNREQUESTED}… is reserved for the charger itself"
        )
    return ChargeRequested(
        request.request_id,
        request.fleet_name,
        request.robot_name,
        _start_timeout_s(request.start_timeout),
    )


def accept_cancel(cancel: ChargerCancel, settings: ChargerSettings) -> Cancelled:
    """Turn a ChargerCancel into an event. Raises RequestRefused if the cancel is malformed.

    A charge that nobody requested can be cancelled too. For this, the cancel must name the request id
    that the charger's own state shows.
    """
    _check("request_id", cancel.request_id)
    if cancel.request_id == UNREQUESTED + cancel.charger_name:
        return Cancelled("")
    return Cancelled(cancel.request_id)


def _check(field: str, text: str) -> None:
    if not text:
        raise RequestRefused(f"empty {field}", "ChargerState must show this field")
    check_length(**{field: text})
    if not text.isprintable():
        raise RequestRefused(f"impossible {field}", f"{text[:40]!r}, {len(text)} characters")


def _start_timeout_s(timeout: Duration) -> float:
    seconds = in_seconds(timeout)
    if seconds < 0:
        raise RequestRefused("negative start_timeout", f"{seconds:g} s")
    if seconds > LONGEST_TIMEOUT_S:
        raise RequestRefused("absurd start_timeout", f"{seconds:g} s is more than a day")
    return seconds


def device_name(message: ChargerRequest | ChargerCancel | ChargerState) -> str:
    """Return the name of the charger in a message."""
    return message.charger_name


def state_message(
    name: str, settings: ChargerSettings, report: ChargerReport, stamp: Time
) -> ChargerState:
    """Convert the report to RMF's message; `stamp` is the time of the station's reading."""
    request_id = report.request_id
    if not request_id and report.state is not ChargerStateValue.CHARGER_IDLE:
        request_id = UNREQUESTED + name
    return ChargerState(
        charger_time=stamp,
        state=int(report.state),
        charger_name=name,
        error_message=report.error_message,
        request_id=request_id,
        robot_fleet=report.fleet,
        robot_name=report.robot,
        time_to_fully_charged=duration(report.measured.time_to_full_s or 0.0),
    )


def summary(report: ChargerReport) -> Mapping[str, str]:
    """Summarise the report in one line, for a person. A robot is marked as unverified until the station
    has seen its receiver."""
    measured = report.measured
    seen = "" if report.verified else " (unverified)"
    texts = {
        "state": report.state.name.removeprefix("CHARGER_"),
        "request": report.request_id or "-",
        "robot": f"{report.fleet}/{report.robot}{seen}" if report.robot else "-",
        "error": report.error_message or "-",
        **({"waits": report.waits} if report.waits else {}),
    }
    optional = {
        "receiver": measured.receiver_id,
        "in_range": measured.in_range,
        "range_ok": measured.range_ok,
        "at_height": measured.at_height,
        "volts": measured.volts,
        "amps": measured.amps,
        "battery_percent": measured.battery_percent,
        "time_to_full_s": measured.time_to_full_s,
        **{f"{name}_celsius": celsius for name, celsius in measured.temperatures},
    }
    return texts | {key: _short(value) for key, value in optional.items() if value is not None}


def _short(value: str | float) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return value if isinstance(value, str) else str(round(value, 2))
