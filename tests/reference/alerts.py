"""Functions that make the alert rules in deploy/prometheus/ from the faults and their remedies."""

from collections.abc import Iterator
from typing import Any, Final

import yaml

from bridges.blackbox.recordings import LEAST_FREE
from bridges.runtime import faults
from bridges.system.certificates import DAY_S, SOON_S, URGENT_S
from workbench.notify.troubles import severity_of

HEAD: Final = """\
# Alert rules for Prometheus (docs/how-to/monitor.md). `make reference` makes this file from
# bridges/runtime/faults.yaml and tests/reference/alerts.py.
"""
UNHEARD: Final = ("NO_ROUTER", "ROUTER_ON_LOOPBACK")
"""The faults of a node that is not on the graph. The rule DaemonFault tells them."""
LONG_WAIT: Final = (
    "histogram_quantile(0.95, sum by (device, le)"
    ' (increase(rmf_bridge_wait_seconds_bucket{kind="lift"}[1h])))'
)


def page() -> str:
    """Return the content of the file with the alert rules."""
    groups = {
        "groups": [
            {"name": "rmf-bridges", "rules": [*_fixed()]},
            {"name": "rmf-bridges-faults", "rules": [*_faults()]},
        ]
    }
    return HEAD + yaml.safe_dump(groups, sort_keys=False, width=110, allow_unicode=True)


def _fixed() -> Iterator[dict[str, Any]]:
    yield _rule(
        "RobotStuckInLift",
        "rmf_bridge_lift_session_still_seconds > 180",
        "0s",
        "critical",
        "A robot has lift {{ $labels.device }}, and the lift's state has not changed for 3 minutes.",
        "Look into the car. `rmf-bridge explain --live {{ $labels.device }}` says who must act.",
    )
    yield _rule(
        "DeviceSilent",
        "rmf_bridge_device_up == 0",
        "30s",
        "critical",
        "No states of {{ $labels.kind }} {{ $labels.device }} arrive.",
        "Run `rmf-bridge status` on its machine; if the machine does not answer, look at its power"
        " and network.",
    )
    yield _rule(
        "ReadingOld",
        "rmf_bridge_device_reading_age_seconds > 10",
        "30s",
        "warning",
        "The last reading of {{ $labels.kind }} {{ $labels.device }} is old.",
        "If the device has a fault, the fault names the wire or bus. Otherwise compare the clocks of"
        " the machines (`timedatectl`).",
    )
    yield _rule(
        "TwoNodesForOneDevice",
        "rmf_bridge_device_publishers > 1",
        "10s",
        "critical",
        "Several nodes publish states of {{ $labels.kind }} {{ $labels.device }}.",
        "Stop one of them: `rmf-bridge explain --live {{ $labels.device }}` names both.",
    )
    yield _rule(
        "LongWaits",
        f"{LONG_WAIT} > 300",
        "0s",
        "warning",
        "One robot in twenty waited more than 5 minutes for lift {{ $labels.device }}.",
        "Compare the rides and the time in service of the last hour on the dashboard.",
    )
    yield _rule(
        "RobotWaits",
        "rmf_bridge_device_waiting_seconds > 300",
        "0s",
        "warning",
        "A robot has waited more than 5 minutes for {{ $labels.kind }} {{ $labels.device }}.",
        "`rmf-bridge explain --live {{ $labels.device }}` says what the robot waits for.",
    )
    yield _rule(
        "OutputsUnverified",
        "rmf_bridge_daemon_outputs_unverified == 1",
        "0s",
        "critical",
        "Daemon {{ $labels.daemon }} has died, and its outputs may be on.",
        "Run `rmf-bridge status` on its machine: it prints the command that switches the outputs off.",
    )
    yield _rule(
        "DaemonDown",
        "rmf_bridge_daemon_up == 0",
        "1m",
        "critical",
        "Daemon {{ $labels.daemon }} does not serve.",
        "Run `rmf-bridge log {{ $labels.daemon }}` on {{ $labels.instance }}.",
    )
    yield _rule(
        "DaemonFault",
        # Not the faults that reach the graph: those have rules of their own.
        "rmf_bridge_daemon_fault == 1 unless on (daemon, code)"
        ' label_replace(rmf_bridge_device_fault{kind="daemon"}, "daemon", "$1", "device", "(.+)")',
        "1m",
        "critical",
        "Daemon {{ $labels.daemon }} has {{ $labels.code }}, and does not reach RMF to tell it.",
        "Run `rmf-bridge status {{ $labels.daemon }}` on {{ $labels.instance }}: it tells what to do.",
    )
    yield _rule(
        "RecorderDiskFull",
        f"rmf_bridge_recordings_disk_free_bytes < {LEAST_FREE}",
        "5m",
        "warning",
        "The disk of the recordings on {{ $labels.instance }} is full: nothing more is recorded.",
        "Copy the recordings away and remove them, or lower `files_mb` in the YAMLs.",
    )
    left = "rmf_bridge_certificate_end_timestamp_seconds - time()"
    file = "{{ $labels.file }} ({{ $labels.daemon }}, {{ $labels.key }}) on {{ $labels.instance }}"
    renew = (
        "Renew the certificate (docs/how-to/harden.md), and restart the daemon."
        " TLS fails when a certificate has ended."
    )
    soon, urgent = SOON_S // DAY_S, URGENT_S // DAY_S
    yield _rule(
        "CertificateEndsSoon",
        f"{left} < {SOON_S}",
        "1h",
        "warning",
        f"The certificate {file} ends within {soon} days, in {{{{ $value | humanizeDuration }}}}.",
        renew,
    )
    yield _rule(
        "CertificateEnds",
        f"{left} < {URGENT_S}",
        "0s",
        "critical",
        f"The certificate {file} has ended or ends within {urgent} days.",
        renew,
    )
    yield _rule(
        "CertificateUnreadable",
        "rmf_bridge_certificate_unreadable == 1",
        "5m",
        "warning",
        f"The end of the certificate {file} is unknown.",
        "`journalctl -u rmf-bridge-exporter` there says why: the exporter needs the program openssl,"
        " and must be able to read the file (mode 644, or group rmf-bridge).",
    )
    yield _rule(
        "UnitFails",
        "rate(rmf_bridge_daemon_bus_failed_calls_total[5m])"
        " / rate(rmf_bridge_daemon_bus_calls_total[5m]) > 0.2",
        "5m",
        "warning",
        "More than a fifth of the calls to {{ $labels.unit }} on bus {{ $labels.bus }} of"
        " {{ $labels.daemon }} fail.",
        "Look at this unit's wiring, termination and power; the dashboard of the bus shows whether"
        " its other units fail too.",
    )
    yield _rule(
        "ExporterDown",
        'up{job="rmf-bridges"} == 0',
        "1m",
        "critical",
        "The exporter on {{ $labels.instance }} does not answer, so nothing is known of its machine.",
        "Run `systemctl status rmf-bridge-exporter` there.",
    )


def _faults() -> Iterator[dict[str, Any]]:
    for code, remedy in faults.remedies().items():
        if code in UNHEARD:
            continue
        metric = f'rmf_bridge_device_fault{{code="{code}"}}'
        name = "".join(part.capitalize() for part in code.split("_"))
        about = "{{ $labels.kind }} {{ $labels.device }}"
        summary = f"{about}: {_plain(remedy.cause)}."
        do = _plain(remedy.do)
        yield _rule(f"Fault{name}", f"{metric} == 1", "1m", severity_of(code), summary, do)


def _rule(
    alert: str, expr: str, lasts: str, severity: str, summary: str, remedy: str
) -> dict[str, Any]:
    return {
        "alert": f"RmfBridge{alert}",
        "expr": expr,
        "for": lasts,
        "labels": {"severity": severity},
        "annotations": {"summary": summary, "remedy": remedy},
    }


def _plain(text: str) -> str:
    """Return a text without the characters that Prometheus would read as a template."""
    return text.strip().replace("{{", "{ {")
