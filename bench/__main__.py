"""`make bench`: latency and memory of the daemons beside a bare transport node, in one run.

Everything runs on loopback, on fake hardware, in processes of its own. The tables go to stdout, the
figures to bench/results/bench.json. Some of it: `python -m bench idle doors`.
"""

import json
import os
import platform
import sys
import tempfile
from pathlib import Path
from typing import Any

from bench import can, chargers, doors, idle, latency, lifts, many_doors, ros

RESULTS = Path(__file__).parent / "results"


SECTIONS = {
    "latency": latency,
    "idle": idle,
    "lifts": lifts,
    "doors": doors,
    "many_doors": many_doors,
    "chargers": chargers,
    "can": can,
    "ros": ros,
}


def main(chosen: list[str]) -> int:
    """Measure, print, write."""
    figures: dict[str, Any] = {"machine": _machine()}
    print(figures["machine"], end="\n\n", flush=True)
    for name in chosen or SECTIONS:
        with tempfile.TemporaryDirectory(prefix="rmf-bench-") as scratch:
            figures[name] = SECTIONS[name].measure(Path(scratch))
        SECTIONS[name].show(figures[name])
        sys.stdout.flush()
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "bench.json").write_text(json.dumps(figures, indent=2) + "\n")
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
    sys.exit(main(sys.argv[1:]))
