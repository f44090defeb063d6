"""A real Prometheus scrapes a real site, and its alert rules report the troubles."""

import os
import shutil
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from hal_fakes.wire import runs_here
from tests.deploy.prometheus_server import RULES, prometheus, started
from tests.deploy.test_dashboards import queries
from tests.runtime.site import Module, command, daemon, environment
from tests.transports.zenoh_programs import free_port
from tests.waiting import wait_until

ROOT = Path(__file__).parents[2]


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


@pytest.fixture
def site(tmp_path: Path, domain: int) -> Iterator[Module]:
    standing = Module(tmp_path, domain, runs_here())
    yield standing
    standing.close()


@pytest.mark.long(10)
def test_a_killed_door_daemon_is_an_alert_in_a_real_prometheus(
    site: Module, tmp_path: Path, domain: int
) -> None:
    ours, runs = free_port(), tmp_path / "runs"
    runs.mkdir()
    exporter = command(
        *("exporter", "--listen", f"127.0.0.1:{ours}", "--runtime-dirs", runs),
        *("--localhost", "--domain-id", str(domain), "--transport", runs_here()),
    )
    door = '{kind="door",device="ward_door"}'
    with (
        started(exporter, tmp_path / "exporter.log"),
        prometheus(tmp_path, ours) as asks,
        daemon(site.file, runs / "ward_door", RMF_BRIDGE_SERVICE="1") as running,
    ):
        running.wait_for("ready")
        wait_until(lambda: asks.value(f"rmf_bridge_device_up{door}") == 1, "the door is up")
        scans = "rmf_bridge_daemon_device_scans_total"
        wait_until(lambda: (asks.value(scans) or 0) > 0, "the daemon's own counts are there")
        wait_until(lambda: "RmfBridgeDaemonDown" not in asks.alerts(), "its daemon is not down")
        running.end(signal.SIGKILL)
        wait_until(lambda: asks.value(f"rmf_bridge_device_up{door}") == 0, "the door is silent")
        wait_until(lambda: asks.value("rmf_bridge_daemon_up") == 0, "its daemon is down")
        wait_until(
            lambda: {"RmfBridgeDeviceSilent", "RmfBridgeDaemonDown"} <= asks.alerts().keys(),
            "both alerts are there",
        )
    off = command("outputs-off", site.file, "--runtime-dir", runs / "ward_door")
    assert subprocess.run(off, env=environment(), capture_output=True).returncode == os.EX_OK


@pytest.mark.long(15)
def test_a_unit_that_falls_silent_shows_in_the_panels_of_its_bus(
    site: Module, tmp_path: Path
) -> None:
    ours, runs = free_port(), tmp_path / "runs"
    runs.mkdir()
    exporter = command(
        "exporter", "--no-graph", "--listen", f"127.0.0.1:{ours}", "--runtime-dirs", runs
    )
    unit = '{bus="module",daemon="ward_door",unit="unit 1"}'
    failed = f"rmf_bridge_daemon_bus_failed_calls_total{unit}"
    with (
        started(exporter, tmp_path / "exporter.log"),
        prometheus(tmp_path, ours) as asks,
        daemon(site.file, runs / "ward_door", RMF_BRIDGE_SERVICE="1", WATCHDOG_USEC="20000000"),
    ):
        wait_until(lambda: asks.value(failed) == 0, "the unit answers")
        site.hang()
        wait_until(lambda: (asks.value(failed) or 0) >= 2, "its calls fail")
        longest = f"rmf_bridge_daemon_bus_longest_call_seconds{unit}"
        wait_until(lambda: (asks.value(f"max_over_time({longest}[1m])") or 0) > 1.4, "a timeout")
        site.go_on()
        wait_until(lambda: (asks.value(f"min_over_time({longest}[1s])") or 9) < 1, "it answers")
        empty = [
            expr
            for expr in queries("bus")
            if "recordings" not in expr and "certificate" not in expr and "switched" not in expr
            if not asks.series(expr)
        ]
        assert empty == []
