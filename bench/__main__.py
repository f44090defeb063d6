"""`make bench`: compare the daemons' latency and memory with a bare transport node, in one run.

Everything runs on loopback, on fake hardware, and in processes of its own. The tables go to stdout. The
figures go to bench/results/bench.json. `python -m bench idle buses` runs only the parts `idle` and
`buses`.
"""

import json
import os
import platform
import sys
import tempfile
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

from bench import brokers, buses, day, explain, idle, latency, page, recording
from bench.figures import lines

RESULTS = Path(__file__).parent / "results"
SECTIONS = {
    "latency": latency,
    "idle": idle,
    "buses": buses,
    "brokers": brokers,
    "day": day,
    "explain": explain,
    "recording": recording,
    "page": page,
}


def main(words: list[str]) -> int:
    """Measure, print the tables, and write the figures."""
    parser = ArgumentParser(
        prog="python -m bench", description="Parts to measure; without parts, all."
    )
    parser.add_argument("parts", nargs="*", help=", ".join(SECTIONS), metavar="PART")
    chosen = parser.parse_args(words).parts
    if unknown := set(chosen) - set(SECTIONS):
        parser.error(f"no such part: {', '.join(sorted(unknown))} (parts: {', '.join(SECTIONS)})")
    figures: dict[str, Any] = {"machine": _machine()}
    print(figures["machine"], flush=True)
    for name in chosen or SECTIONS:
        with tempfile.TemporaryDirectory(prefix="rmf-bench-") as scratch:
            figures[name] = SECTIONS[name].measure(Path(scratch))
        for title, rows in figures[name].items():
            print("", *lines(title, rows), sep="\n", flush=True)
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "bench.json").write_text(json.dumps(figures, indent=2) + "\n")
    print(f"\nwritten to {RESULTS / 'bench.json'}")
    return 0


def _machine() -> str:
    cpu = Path("/proc/cpuinfo").read_text().splitlines()
    models = [line.split(":", 1)[1].strip() for line in cpu if line.startswith("model name")]
    model = models[0] if models else platform.machine()
    python = platform.python_version()
    return f"{model}, {os.cpu_count()} cores, Python {python}, {platform.system()}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
