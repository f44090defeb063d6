"""`make bench`: latency and memory of the daemons beside a bare transport node, in one run.

Everything runs on loopback, on fake hardware, in processes of its own. The table goes to stdout, the
figures to bench/results/bench.json.
"""

import json
import os
import platform
import sys
import tempfile
from pathlib import Path
from typing import Any

from bench import doors, idle, latency, lifts

RESULTS = Path(__file__).parent / "results"


def main() -> int:
    """Measure, print, write."""
    with tempfile.TemporaryDirectory(prefix="rmf-bench-") as scratch:
        figures: dict[str, Any] = {
            "machine": _machine(),
            "latency": latency.measure(Path(scratch)),
            "idle": idle.measure(Path(scratch)),
            "lifts": lifts.measure(Path(scratch)),
            "doors": doors.measure(Path(scratch)),
        }
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "bench.json").write_text(json.dumps(figures, indent=2) + "\n")
    print(f"\n{figures['machine']}\n")
    latency.show(figures["latency"])
    idle.show(figures["idle"])
    lifts.show(figures["lifts"])
    doors.show(figures["doors"])
    print(f"\nwritten to {RESULTS / 'bench.json'}")
    return 0


def _machine() -> str:
    model = next(
        (
            line.split(":", 1)[1].strip()
            for line in Path("/proc/cpuinfo").read_text().splitlines()
            if line.startswith("model name")
        ),
        platform.machine(),
    )
    return (
        f"{model}, {os.cpu_count()} cores, Python {platform.python_version()}, {platform.system()}"
    )


if __name__ == "__main__":
    sys.exit(main())
