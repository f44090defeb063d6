"""A real Prometheus on this machine, and questions to it."""

import json
import subprocess
import urllib.parse
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.runtime.site import environment
from tests.transports.zenoh_programs import free_port
from tests.waiting import PATIENCE_S, wait_until

ROOT = Path(__file__).parents[2]
RULES = ROOT / "deploy/prometheus/rmf-bridges.rules.yaml"
CONFIG = """
global: {{scrape_interval: 1s, evaluation_interval: 1s}}
rule_files: [{rules}]
scrape_configs:
  - job_name: rmf-bridges
    static_configs: [{{targets: ["127.0.0.1:{port}"]}}]
"""


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
    """Prometheus's HTTP API."""

    def __init__(self, port: int) -> None:
        self._base = f"http://127.0.0.1:{port}/api/v1"

    def value(self, query: str) -> float | None:
        """Return the query's only value, or None without a series or an answer."""
        try:
            found = self.series(query)
        except OSError:
            return None
        return next(iter(found.values()), None)

    def series(self, query: str, at: float | None = None) -> dict[str, float]:
        """Return the value of each series now, or at this wall time, by its labels."""
        asked = {"query": query} | ({} if at is None else {"time": str(at)})
        found = self._get(f"query?{urllib.parse.urlencode(asked)}")["result"]
        return {json.dumps(one["metric"], sort_keys=True): float(one["value"][1]) for one in found}

    def alerts(self) -> dict[str, str]:
        """Return each present alert with its state, pending or firing."""
        found = self._get("alerts")["alerts"]
        return {one["labels"]["alertname"]: one["state"] for one in found}

    def _get(self, path: str) -> dict[str, Any]:
        with urllib.request.urlopen(f"{self._base}/{path}", timeout=10) as answer:
            return json.load(answer)["data"]  # type: ignore[no-any-return]


@contextmanager
def prometheus(folder: Path, scrapes: int) -> Iterator[Prometheus]:
    """Run a Prometheus with our rules. It keeps its data in `folder`/tsdb, and scrapes the port
    `scrapes`."""
    port, config = free_port(), folder / "prometheus.yaml"
    config.write_text(CONFIG.format(rules=RULES, port=scrapes))
    line = [
        "prometheus",
        f"--config.file={config}",
        f"--storage.tsdb.path={folder / 'tsdb'}",
        "--storage.tsdb.retention.time=100y",  # a test's data may have any time
        f"--web.listen-address=127.0.0.1:{port}",
    ]
    asks = Prometheus(port)
    with started(line, folder / "prometheus.log"):
        wait_until(lambda: asks.value("vector(1)") == 1, "Prometheus answers")
        yield asks
