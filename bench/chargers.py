"""Fifty HTTP chargers in one daemon, ten of them dead and five trickling: how old is what RMF knows of
the sound ones? Beside it, on the same servers at the same time, the loop that needs no thought: one
`requests.get` after the other, each second. (That one gets a timeout, which requests applies to each
read; without, it would stop for good at the first dead charger.)

And what a charger costs: memory and CPU of daemons with few and many.
"""

import json
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import requests

from bench.daemons import cpu_s, memory_mb, running, threads, wait_for_log
from bridges.core.fields import Rmf
from bridges.rmf.choose import open_transport
from bridges.rmf.definitions import ChargerState
from bridges.rmf.stamps import in_seconds
from bridges.rmf.topics import CHARGER_STATES

DOMAIN: Final = 73
SOUND, DEAD, TRICKLING = 35, 10, 5
PERIOD_S: Final = 1.0
TIMEOUT_S: Final = 1.0
SETTLE_S: Final = 5.0
WATCHED_S: Final = 30.0
LOOK_S: Final = 0.02
FLEETS: Final = (1, 10, 25, 50)
"""How many sound chargers a daemon has, for what one costs."""


def measure(scratch: Path) -> dict[str, Any]:
    """State ages as multiples of the poll period, and what a charger costs."""
    return {"ages": _ages(scratch), "cost": _cost(scratch)}


def show(figures: dict[str, Any]) -> None:
    """The tables."""
    print(f"\n{'50 chargers, 15 of them bad':28}{'age p50':>9}{'age p99':>9}   of the poll period")
    for name, row in figures["ages"].items():
        print(f"{name:28}{row['p50']:>8.2f}x{row['p99']:>8.2f}x")
    print(f"\n{'sound chargers in a daemon':28}{'RSS MB':>9}{'threads':>9}{'CPU %':>8}")
    for name, row in figures["cost"]["daemons"].items():
        print(f"{name:28}{row['rss_mb']:>9.1f}{row['threads']:>9}{row['cpu_percent']:>8.2f}")
    each = figures["cost"]["each"]
    cost = f"{each['rss_mb']:>9.2f}{'':9}{each['cpu_percent']:>8.3f}"
    print(f"{'each further one':28}{cost}   R² {each['rss_r2']:.3f}, {each['cpu_r2']:.3f}")


# ---- the chargers and the daemon


@contextmanager
def _chargers(sound: int, dead: int = 0, trickling: int = 0) -> Iterator[list[int]]:
    """Ports of so many chargers."""
    counts = [str(count) for count in (sound, dead, trickling)]
    command = [sys.executable, "-m", "bench.charger_servers", *counts]
    far = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert far.stdin
    assert far.stdout
    try:
        yield json.loads(far.stdout.readline())
    finally:
        far.stdin.close()
        far.wait(10.0)
        far.stdout.close()


def _yaml(ports: Sequence[int]) -> str:
    """A bus and a charger at each port."""
    text = ["kind: charger", "driver: http", "rmf: {transport: dds, network: localhost}", "buses:"]
    settings = f"timeout_s: {TIMEOUT_S:g}, scan_s: {PERIOD_S:g}"
    for n, port in enumerate(ports):
        text.append(f'  tpu_{n}: {{type: http, api_base: "127.0.0.1:{port}", {settings}}}')
    text.append("chargers:")
    for n in range(len(ports)):
        text.append(
            f"  charger_{n}: {{bus: tpu_{n}, codes: {{idle: [0], charging: [5], error: [8]}}}}"
        )
    return "\n".join(text) + "\n"


@contextmanager
def _daemon(scratch: Path, ports: Sequence[int]) -> Iterator[int]:
    """The process id of a daemon that serves them."""
    name = f"chargers_{len(ports)}"
    file, log = scratch / f"{name}.yaml", scratch / f"{name}.log"
    file.write_text(_yaml(ports))
    command = [sys.executable, "-m", "bridges.cli", "run", str(file), "--domain-id", str(DOMAIN)]
    with running([*command, "--runtime-dir", str(scratch / name)], log) as child:
        wait_for_log(log, "ready")
        yield child.pid


# ---- ages


class Known:
    """When each charger was read that somebody knows of (wall clock s); any thread may note."""

    def __init__(self) -> None:
        self.read_at: dict[int, float] = {}

    def state(self, state: ChargerState) -> None:
        """A ChargerState has come."""
        self.read_at[int(state.charger_name.rpartition("_")[2])] = in_seconds(state.charger_time)


def _ages(scratch: Path) -> dict[str, dict[str, float]]:
    rmf, plain = Known(), Known()
    with _chargers(SOUND, DEAD, TRICKLING) as ports:
        mixed = _mixed(ports)
        rmf_settings = Rmf(transport="dds", domain_id=DOMAIN)
        transport = open_transport(rmf_settings, "bench", localhost=True)
        transport.subscribe(CHARGER_STATES, rmf.state)
        done = threading.Event()
        loop = threading.Thread(target=_sequential, args=(mixed, plain, done))
        with _daemon(scratch, mixed):
            loop.start()
            time.sleep(SETTLE_S)
            sound = [n for n, port in enumerate(mixed) if port in ports[:SOUND]]
            ages = _watch(sound, {"one daemon": rmf, "requests.get in turn": plain})
            done.set()
            loop.join()
        transport.close()
    return ages


def _mixed(ports: Sequence[int]) -> list[int]:
    """The bad ones not all together."""
    bad, sound = list(ports[SOUND:]), list(ports[:SOUND])
    every = len(ports) // len(bad)
    mixed = [
        sound.pop() if n % every or not bad else bad.pop() for n in range(len(ports) - len(bad))
    ]
    return [*mixed, *sound, *bad]


def _sequential(ports: Sequence[int], known: Known, done: threading.Event) -> None:
    """The seed's loop: every charger in turn, each second."""
    while not done.is_set():
        started_at = time.monotonic()
        for n, port in enumerate(ports):
            try:
                requests.get(f"http://127.0.0.1:{port}/state", timeout=TIMEOUT_S).json()
            except requests.RequestException:
                continue
            known.read_at[n] = time.time()
            if done.is_set():
                return
        done.wait(max(0.0, started_at + PERIOD_S - time.monotonic()))


def _watch(chargers: Sequence[int], knowns: dict[str, Known]) -> dict[str, dict[str, float]]:
    """Ages of what is known of these chargers, looked at again and again, in poll periods."""
    started_at = time.time()
    ages: dict[str, list[float]] = {name: [] for name in knowns}
    for _ in range(round(WATCHED_S / LOOK_S)):
        now = time.time()
        for name, known in knowns.items():
            never = started_at - SETTLE_S
            ages[name] += [(now - known.read_at.get(n, never)) / PERIOD_S for n in chargers]
        time.sleep(LOOK_S)
    cuts = {name: statistics.quantiles(values, n=100) for name, values in ages.items()}
    return {name: {"p50": cut[49], "p99": cut[98]} for name, cut in cuts.items()}


# ---- cost


def _cost(scratch: Path) -> dict[str, Any]:
    daemons = {str(count): _row(scratch, count) for count in FLEETS}
    each: dict[str, float] = {}
    for what, short in (("rss_mb", "rss"), ("cpu_percent", "cpu")):
        values = [row[what] for row in daemons.values()]
        each[what] = statistics.linear_regression(FLEETS, values).slope
        each[f"{short}_r2"] = statistics.correlation(FLEETS, values) ** 2
    return {"daemons": daemons, "each": each}


def _row(scratch: Path, count: int) -> dict[str, float]:
    with _chargers(count) as ports, _daemon(scratch, ports) as pid:
        time.sleep(SETTLE_S)
        before_s = cpu_s(pid)
        time.sleep(WATCHED_S / 3)
        used_s = cpu_s(pid) - before_s
        return {
            "rss_mb": memory_mb(pid),
            "threads": threads(pid),
            "cpu_percent": 100 * used_s / (WATCHED_S / 3),
        }


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="rmf-bench-") as directory:
        show(measure(Path(directory)))
