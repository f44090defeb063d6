"""Grafana's dashboards: their form, and the answer of a real Prometheus to each panel's query.

Grafana itself is not in Debian, so no test draws a dashboard.
"""

import json
import re
import subprocess
from collections.abc import Iterator
from itertools import combinations
from math import isnan
from pathlib import Path
from typing import Any, Final

import pytest
from grafana_foundation_sdk.cog.encoder import JSONEncoder
from grafana_foundation_sdk.models.dashboard import Dashboard
from msgspec.structs import replace
from prometheus_client.core import Metric

from bridges.messages import definitions as d
from bridges.observe.requesters import Moment
from bridges.runtime.daemons import DaemonStatus
from bridges.system.certificates import CertificateEnd
from tests.deploy.prometheus_server import ROOT, prometheus
from tests.observe.story import CHARGER, CLOSED, OPEN, RED, WALL, Story
from tests.observe.test_tally import ride
from tests.transports.zenoh_programs import free_port
from workbench.metrics.families import of_graph
from workbench.metrics.machine import of_certificates, of_machine, of_recordings

FOLDER: Final = ROOT / "deploy/grafana"
NAMES: Final = ("site", "device", "bus")
EVERY_S: Final = 60
VARIABLES: Final = {"$__rate_interval": "4m", "$device": ".*", "$daemon": ".*"}


def dashboard(name: str) -> dict[str, Any]:
    return json.loads((FOLDER / f"{name}.json").read_text())  # type: ignore[no-any-return]


def queries(name: str, rate: str = "20s") -> Iterator[str]:
    """Yield each panel's query as Grafana asks it with every device chosen."""
    for panel in dashboard(name)["panels"]:
        for target in panel["targets"]:
            expr: str = target["expr"]
            for variable, value in (VARIABLES | {"$__rate_interval": rate}).items():
                expr = expr.replace(variable, value)
            yield expr


def lost(ours: Any, theirs: Any, at: str = "") -> Iterator[str]:
    """Yield the keys and values of `ours` that `theirs` has not."""
    if isinstance(ours, dict):
        for key, value in ours.items():
            yield from lost(value, theirs.get(key), f"{at}.{key}")
    elif isinstance(ours, list):
        for number, value in enumerate(ours):
            yield from lost(value, theirs[number], f"{at}[{number}]")
    elif ours != theirs:
        yield at


@pytest.mark.parametrize("name", NAMES)
def test_grafanas_own_types_know_every_key(name: str) -> None:
    ours = dashboard(name)
    read = Dashboard.from_json(dashboard(name))
    assert [*lost(ours, json.loads(JSONEncoder().encode(read)))] == []


@pytest.mark.parametrize("name", NAMES)
def test_no_panel_covers_another(name: str) -> None:
    panels = dashboard(name)["panels"]
    assert len({panel["id"] for panel in panels}) == len(panels)
    for one, other in combinations((panel["gridPos"] for panel in panels), 2):
        beside = one["x"] + one["w"] <= other["x"] or other["x"] + other["w"] <= one["x"]
        below = one["y"] + one["h"] <= other["y"] or other["y"] + other["h"] <= one["y"]
        assert beside or below, (one, other)


def test_no_window_is_shorter_than_two_scrapes_of_a_minute() -> None:
    windows = {
        window for name in NAMES for window in re.findall(r"\[([^]]+)\]", str(dashboard(name)))
    }
    assert {one for one in windows if one.endswith(("s", "1m"))} == set()


def said(minute: int) -> d.DiagnosticArray:
    """Return what two daemons say: a lift's fault and refusals, a charger's volts and amps."""

    def status(subject: str, **values: str) -> d.DiagnosticStatus:
        pairs = tuple(d.KeyValue(key.replace("_", " "), text) for key, text in values.items())
        return d.DiagnosticStatus(0, f"node: {subject}", "", subject, pairs)

    lift = status("Lift1", kind="lift", FIRE="the alarm", refused_busy=str(minute))
    bay = status("bay", kind="charger", volts="24.0", amps="10.0")
    return d.DiagnosticArray(
        status=(
            replace(lift, level=2, message="FIRE"),
            bay,
            replace(status("daemon", kind="lift", version="1.0"), hardware_id="node"),
        )
    )


def day() -> Iterator[tuple[float, list[Metric]]]:
    """Yield a scrape of each minute of two hours, with a ride, an opening of a door, and charging in
    each minute."""
    story = Story()
    for minute in range(120):
        ride(story.hear("/diagnostics", said(minute)).door(CLOSED).hear("charger_states", CHARGER))
        story.door(OPEN).hear("/diagnostics", said(minute))
        for _ in range(32):
            story.passes(1).hear("charger_states", replace(CHARGER, state=3)).lift().door(OPEN)
        story.hear("/diagnostics", said(minute)).lift(RED, "L2", OPEN)
        at = WALL + story.now
        unit = {
            "calls": 60 * minute,
            "failed_calls": minute,
            "call_seconds": minute,
            "longest_call_s": 0.1,
        }
        device = {
            "counts": {
                "scans": 60 * minute,
                "failed_scans": minute,
                "scan_seconds": minute,
                "longest_scan_s": 0.1,
                "switched_on": {"call": minute},
            },
            "input_age_s": 0.1,
        }
        status = {
            "devices": {"Lift1": device},
            "buses": {"io": {"unit 1": unit}},
            "watchdog_slack_s": 9.0,
            "certificate_files": {"rmf.zenoh.tls.ca": "/ca.pem"},
        }
        serving = DaemonStatus(name="lift", state="serving", by="service", status=status)
        yield (
            at,
            [
                *of_graph(story.graph, story.tally, Moment(story.now, at)),
                *of_machine([serving]),
                *of_certificates([serving], [], lambda _: CertificateEnd(WALL + 9e6)),
                *of_recordings(ROOT),
            ],
        )


def openmetrics(scrapes: list[tuple[float, list[Metric]]]) -> str:
    """Return the scrapes in the format that `promtool tsdb create-blocks-from` reads."""
    series = dict[str, list[str]]()
    for at, families in scrapes:
        for sample in (sample for family in families for sample in family.samples):
            labels = ",".join(f"{key}={json.dumps(text)}" for key, text in sample.labels.items())
            line = f"{sample.name}{{{labels}}} {float(sample.value)} {at}"
            series.setdefault(sample.name, []).append(line)
    return "\n".join(line for lines in series.values() for line in lines) + "\n# EOF\n"


@pytest.mark.long(15)
def test_no_panel_is_empty_with_two_hours_of_a_site(tmp_path: Path) -> None:
    scrapes = [*day()]
    (tmp_path / "recorded.txt").write_text(openmetrics(scrapes))
    words = ["promtool", "tsdb", "create-blocks-from", "openmetrics", "recorded.txt", "tsdb"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = dict[str, dict[str, float]]()
    with prometheus(tmp_path, free_port()) as asks:
        for name in NAMES:
            found |= {expr: asks.series(expr, scrapes[-1][0]) for expr in queries(name, "4m")}
    numbers = {
        expr: [value for value in series.values() if not isnan(value)]  # nan: no wait in the hour
        for expr, series in found.items()
    }
    assert [expr for expr, values in numbers.items() if not values] == []

    def only(text: str) -> float:
        (expr,) = (expr for expr in found if text in expr)
        (value,) = numbers[expr]
        return value

    assert only("60 * rate(rmf_bridge_daemon_bus_failed_calls") == pytest.approx(1.0)
    assert only("rate(rmf_bridge_daemon_bus_call_seconds_total") == pytest.approx(1 / 60)
    assert only("rmf_bridge_certificate_end") == pytest.approx(9e6 - 7200)
    assert (
        only(
            "histogram_quantile(0.95, sum by (device, le) (increase(rmf_bridge_wait_seconds_bucket{kind"
        )
        > 0
    )
