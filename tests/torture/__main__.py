"""`python -m tests.torture --seed 7` makes the table of reliability.md in ten minutes, on loopback.

The exit code is 1 if a relay stayed on, or if a daemon died of a disturbance that it must survive.
"""

import argparse
import random
import secrets
import signal
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.torture.dds import long_names, lost_network
from tests.torture.deaths import kills, shortages, signals
from tests.torture.forged import forged
from tests.torture.held import dead_bus_first, looks, planted, readers
from tests.torture.table import Table
from tests.torture.tools import pages, recordings
from tests.torture.wires import wires


def main(argv: Sequence[str] | None = None) -> int:
    """Attack real daemons, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.torture", description=__doc__)
    parser.add_argument("--seed", type=int, help="seed; by default random and printed")
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--times", type=int, default=10, help="number of tries of each shortage")
    parser.add_argument("--recordings", type=int, default=300, help="number of wrong recordings")
    parser.add_argument("--forged-s", type=float, default=20.0, help="seconds on each wire")
    options = parser.parse_args(argv)
    # Under nohup this process ignores SIGHUP. Without this line the daemons would inherit that and
    # ignore SIGHUP too.
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    seed = secrets.randbelow(10**6) if options.seed is None else options.seed
    began, table, failed = time.monotonic(), Table(), list[str]()
    with tempfile.TemporaryDirectory(prefix="rmf-bridges-") as base:
        here, half = Path(base), options.kills // 2
        parts: list[Callable[[], None]] = [
            lambda: kills(here / "a", random.Random(seed), options.kills - half, table),
            lambda: kills(here / "b", random.Random(seed + 1), half, table),
            lambda: _one_after_another(here, seed, options, table),
        ]
        threads = [threading.Thread(target=_tried, args=(part, failed)) for part in parts]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    sys.stdout.write(f"{table}\n\nseed {seed}, {time.monotonic() - began:.0f} s\n")
    sys.stdout.write("\n".join(failed))
    return 1 if failed else 0


def _one_after_another(here: Path, seed: int, options: argparse.Namespace, table: Table) -> None:
    signals(here / "c", table)
    shortages(here / "d", random.Random(seed + 2), options.times, table)
    dead_bus_first(here / "e", table)
    readers(here / "f", options.times, table)
    looks(here / "g", table)
    planted(here / "h", table)
    forged(here / "i", random.Random(seed + 3), options.forged_s, table)
    wires(here / "j", random.Random(seed + 4), options.forged_s, options.times, table)
    long_names(here / "k", options.forged_s / 4, table)
    lost_network(table)
    pages(here / "l", random.Random(seed + 5), table)
    recordings(here / "m", seed + 6, options.recordings, table)


def _tried(part: Callable[[], None], failed: list[str]) -> None:
    try:
        part()
    except BaseException:
        failed.append(traceback.format_exc())
        raise


if __name__ == "__main__":
    sys.exit(main())
