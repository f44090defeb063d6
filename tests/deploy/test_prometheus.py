"""Alerts on a real site. A real Prometheus scrapes the site, and its alert rules report the
troubles."""

import json
import os
import re
import shutil
import signal
import subprocess
import urllib.parse
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from bridges.observe.all_devices import PlainGraph
from bridges.observe.requesters import Moment
from bridges.observe.tally import SiteTally
from hal_fakes.wire import runs_here
from tests.runtime.site import Module, command, daemon, environment
from tests.transports.zenoh_programs import free_port
from tests.waiting import PATIENCE_S, wait_until
from workbench.metrics.families import of_graph
from workbench.metrics.machine import of_machine, of_recordings

ROOT = Path(__file__).parents[2]
RULES = ROOT / "deploy/prometheus/rmf-bridges.rules.yaml"
CONFIG = """
global: {{scrape_interval: 1s, evaluation_interval: 1s}}
rule_files: [{rules}]
scrape_configs:
  - job_name: rmf-bridges
    static_configs: [{{targets: ["127.0.0.1:{port}"]}}]
"""


def test_the_rules_tell_what_recorded_series_show(tmp_path: Path) -> None:
    shutil.copy(RULES, tmp_path)
    shutil.copy(Path(__file__).with_name("rules_test.yaml"), tmp_path)
    done = subprocess.run(
        ["promtool", "test", "rules", "rules_test.yaml"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@contextmanager
def started(line: list[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    with log.open("wb") as out:
        process = subprocess.Popen(line, stdout=out, stderr=out, env=environment())
    try:
        yield process
    finally:
        process.terminate()
        process.wait(PATIENCE_S)


class Prometheus:
    """A client of Prometheus's HTTP API."""

    def __init__(self, port: int) -> None:
        self._base = f"http://127.0.0.1:{port}/api/v1"

    def value(self, query: str) -> float | None:
        """Return the only value of the query. Return None if no series or no answer comes."""
        try:
            found = self._get(f"query?{urllib.parse.urlencode({'query': query})}")["result"]
        except OSError:
            return None
        return float(found[0]["value"][1]) if found else None

    def alerts(self) -> dict[str, str]:
        """Return the state of each present alert by the alert's name: pending or firing."""
        found = self._get("alerts")["alerts"]
        return {one["labels"]["alertname"]: one["state"] for one in found}

    def _get(self, path: str) -> dict[str, Any]:
        with urllib.request.urlopen(f"{self._base}/{path}", timeout=10) as answer:
            return json.load(answer)["data"]  # type: ignore[no-any-return]


@pytest.fixture
def site(tmp_path: Path, domain: int) -> Iterator[Module]:
    standing = Module(tmp_path, domain, runs_here())
    yield standing
    standing.close()


@pytest.mark.long(10)
def test_a_killed_door_daemon_is_an_alert_in_a_real_prometheus(
    site: Module, tmp_path: Path, domain: int
) -> None:
    ours, theirs = free_port(), free_port()
    runs = tmp_path / "runs"
    runs.mkdir()
    exporter = command(
        *("exporter", "--listen", f"127.0.0.1:{ours}", "--runtime-dirs", runs),
        *("--localhost", "--domain-id", str(domain), "--transport", runs_here()),
    )
    config = tmp_path / "prometheus.yaml"
    config.write_text(CONFIG.format(rules=RULES, port=ours))
    prometheus = [
        "prometheus",
        f"--config.file={config}",
        f"--storage.tsdb.path={tmp_path / 'tsdb'}",
        f"--web.listen-address=127.0.0.1:{theirs}",
    ]
    asks = Prometheus(theirs)
    door = '{kind="door",device="ward_door"}'
    with (
        started(exporter, tmp_path / "exporter.log"),
        started(prometheus, tmp_path / "prometheus.log"),
        daemon(site.file, runs / "ward_door", RMF_BRIDGE_SERVICE="1") as running,
    ):
        running.wait_for("ready")
        wait_until(lambda: asks.value(f"rmf_bridge_device_up{door}") == 1, "the door is up")
        scans = "rmf_bridge_daemon_device_scans_total"
        wait_until(lambda: (asks.value(scans) or 0) > 0, "the daemon's own counts are there")
        assert "RmfBridgeDaemonDown" not in asks.alerts()
        running.end(signal.SIGKILL)
        wait_until(lambda: asks.value(f"rmf_bridge_device_up{door}") == 0, "the door is silent")
        wait_until(lambda: asks.value("rmf_bridge_daemon_up") == 0, "its daemon is down")
        wait_until(
            lambda: {"RmfBridgeDeviceSilent", "RmfBridgeDaemonDown"} <= asks.alerts().keys(),
            "both alerts are there",
        )
    off = command("outputs-off", site.file, "--runtime-dir", runs / "ward_door")
    assert subprocess.run(off, env=environment(), capture_output=True).returncode == os.EX_OK


def named(text: str) -> set[str]:
    """Return the metrics that a text names. The names have no endings such as `_bucket` or `_total`."""
    found = re.findall(r"rmf_bridge_[a-z_]+", text)
    return {re.sub(r"_(bucket|count|sum|total)$", "", one) for one in found}


@pytest.mark.parametrize(
    "file", [*sorted((ROOT / "deploy/grafana").glob("*.json")), RULES], ids=str
)
def test_dashboards_and_rules_ask_only_for_metrics_that_are_exported(file: Path) -> None:
    now = Moment(0.0, 0.0)
    families = [*of_graph(PlainGraph(), SiteTally(), now), *of_machine([]), *of_recordings(ROOT)]
    exported = {family.name + ("_info" if family.type == "info" else "") for family in families}
    assert named(file.read_text()) - exported == set()
