"""`make bench`: compare the daemons' latency and memory with a bare transport node, in one run.

Everything runs on loopback, on fake hardware, and in processes of its own. The tables go to stdout. The
figures go to bench/results/bench.json. `python -m bench idle buses` runs only the parts `idle` and
`buses`.

The benchmark refuses a busy machine, because its figures mean nothing. With `--anyway` it measures all
the same, and prints that the machine is busy. The last table compares the figures with their aims.
After it come the figures that are worse than the best earlier figure of the same type of machine.
"""

import json
import os
import platform
import socket
import subprocess
import sys
import tempfile
import time
import traceback
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

from bench import brokers, buses, day, explain, history, idle, latency, page, recording
from bench.figures import lines

LONG = ("day", "recording", "page")
"""Parts that take several minutes each and hold no promised figure. Only `all`, or their names, run
them."""
MOST_LOAD = 1.0
"""The greatest load average over a minute. With a higher load the figures mean nothing."""
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
SHORT = [name for name in SECTIONS if name not in LONG]


def main(words: list[str]) -> int:
    """Measure, print the tables, and write the figures."""
    parser = ArgumentParser(
        prog="python -m bench", description=f"Parts to measure; without parts, {', '.join(SHORT)}."
    )
    parser.add_argument("parts", nargs="*", help=f"{', '.join(SECTIONS)}, or all", metavar="PART")
    parser.add_argument("--anyway", action="store_true", help="measure on a busy machine too")
    args = parser.parse_args(words)
    chosen = [*SECTIONS] if args.parts == ["all"] else args.parts or SHORT
    if unknown := set(chosen) - set(SECTIONS):
        parser.error(f"no such part: {', '.join(sorted(unknown))} (parts: {', '.join(SECTIONS)})")
    load = os.getloadavg()[0]
    if load > MOST_LOAD and not args.anyway:
        print(f"the load is {load:.1f}: wait until it is {MOST_LOAD:g} or less, or add --anyway")
        return os.EX_TEMPFAIL
    figures: dict[str, Any] = {"machine": _machine(), **_run(), "load": load}
    print(figures["machine"], flush=True)
    print(figures["date"], figures["host"], figures["commit"], _busy(load), flush=True)
    failed = [name for name in chosen if not _measured(name, figures)]
    print("", *history.table(figures), *history.losses(figures, RESULTS), sep="\n")
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "bench.json").write_text(json.dumps(figures, indent=2) + "\n")
    if load <= MOST_LOAD:
        history.keep(figures, RESULTS)
    print(f"\nwritten to {RESULTS / 'bench.json'}")
    for name in failed:
        print(f"FAILED: {name}")
    return 1 if failed else 0


def _measured(name: str, figures: dict[str, Any]) -> bool:
    """Measure one part, print its tables, and add its figures. Return False after a failure, because
    the other parts must still run."""
    began = time.monotonic()
    try:
        with tempfile.TemporaryDirectory(prefix="rmf-bench-") as scratch:
            found = SECTIONS[name].measure(Path(scratch))
        for title, rows in found.items():
            print("", *lines(title, rows), sep="\n", flush=True)
    except (Exception, SystemExit):  # noqa: BLE001  # whatever fails, the others' figures count
        traceback.print_exc()
        return False
    figures[name] = found
    print(f"\n{name}: {time.monotonic() - began:.0f} s", flush=True)
    return True


def _run() -> dict[str, str]:
    """Return the date, the host and the commit of this run."""
    words = ["git", "describe", "--always", "--dirty", "--exclude=*"]
    told = subprocess.run(words, cwd=RESULTS.parent, capture_output=True, text=True)
    date = time.strftime("%Y-%m-%d %H:%M")
    return {"date": date, "host": socket.gethostname(), "commit": told.stdout.strip() or "no git"}


def _busy(load: float) -> str:
    return f"BUSY: the load was {load:.1f}" if load > MOST_LOAD else f"load {load:.1f}"


def _machine() -> str:
    cpu = Path("/proc/cpuinfo").read_text().splitlines()
    models = [line.split(":", 1)[1].strip() for line in cpu if line.startswith("model name")]
    model = models[0] if models else platform.machine()
    python = platform.python_version()
    return f"{model}, {os.cpu_count()} cores, Python {python}, {platform.system()}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
