"""Many doors in one daemon on Modbus TCP, and one dead door among eight.

The age of a state is what a subscriber in another process sees: from `door_time`, when the door was
read, to its arrival. The gap is from one state of a door to its next: 1 s, and what a round of polls
takes beyond it. Each door is to be polled every 0.1 s.
"""

import statistics
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from bench.daemons import (
    PlantSocket,
    cpu_s,
    daemon,
    memory_mb,
    running,
    threads,
    wait_for_log,
)
from bench.doors import DOOR
from bridges.core.fields import Rmf
from bridges.rmf.choose import open_transport
from bridges.rmf.definitions import DoorState
from bridges.rmf.stamps import in_seconds
from bridges.rmf.topics import DOOR_STATES

DOMAIN: Final = 73
DOORS: Final = (25, 50, 100, 200)
WATCHED_S: Final = 20.0
SETTLE_S: Final = 5.0
DEAD_OF: Final = 8

BUS: Final = """\
kind: door
driver: dry_contact
rmf: {transport: dds}
buses:
  gateway: {type: modbus, tcp: {host: 127.0.0.1, port: 502}}
doors:
"""


def measure(scratch: Path) -> dict[str, Any]:
    """Both."""
    return {
        "doors": {str(doors): _many(scratch, doors) for doors in DOORS},
        "one_dead": _one_dead(scratch),
    }


def show(figures: dict[str, Any]) -> None:
    """The tables."""
    heading = f"{'age p50 ms':>12}{'age p99 ms':>12}{'gap p99 s':>11}"
    print(f"\n{'doors on one TCP gateway':28}{heading}{'RSS MB':>9}{'CPU %':>8}{'CPU % each':>12}")
    for doors, row in figures["doors"].items():
        size = f"{row['rss_mb']:>9.1f}{row['cpu_percent']:>8.2f}"
        print(f"{doors:28}{_ages(row)}{size}{row['cpu_percent'] / int(doors):>12.3f}")
    least, most = (figures["doors"][str(doors)] for doors in (DOORS[0], DOORS[-1]))
    more = DOORS[-1] - DOORS[0]
    each_kb = 1e3 * (most["rss_mb"] - least["rss_mb"]) / more
    each_cpu = (most["cpu_percent"] - least["cpu_percent"]) / more
    print(f"another door costs {each_kb:.0f} kB and {each_cpu:.3f} % of a core")
    print(f"\n{f'others of {DEAD_OF} doors':28}{heading}{'gap ratio':>11}")
    for name, row in figures["one_dead"].items():
        print(f"{name:28}{_ages(row)}{row['gap_ratio']:>10.2f}x")


def _ages(row: dict[str, float]) -> str:
    return f"{row['age_p50_ms']:>12.2f}{row['age_p99_ms']:>12.2f}{row['gap_p99_s']:>11.3f}"


def _many(scratch: Path, doors: int) -> dict[str, float]:
    """A daemon with so many doors: its states' ages, and what it costs."""
    with _daemon(scratch, doors) as (pid, _):
        before_s = cpu_s(pid)
        seen = _watched(WATCHED_S)
        used_s = cpu_s(pid) - before_s
        assert len(seen) == doors, f"states of {len(seen)} of {doors} doors"
        return {
            **_figures(seen),
            "rss_mb": memory_mb(pid),
            "threads": threads(pid),
            "cpu_percent": 100 * used_s / WATCHED_S,
        }


def _one_dead(scratch: Path) -> dict[str, dict[str, float]]:
    """The seven others before their line loses one unit, and after."""
    with _daemon(scratch, DEAD_OF) as (_, plant):
        before = _figures(_others(_watched(WATCHED_S)))
        plant.say(f"fail door_{DEAD_OF} unit off")
        time.sleep(SETTLE_S)
        after = _figures(_others(_watched(WATCHED_S)))
    whole = before["gap_p99_s"]
    return {
        "all answer": {**before, "gap_ratio": 1.0},
        "one is dead": {**after, "gap_ratio": after["gap_p99_s"] / whole},
    }


Seen = dict[str, list[tuple[float, DoorState]]]


def _others(seen: Seen) -> Seen:
    return {door: states for door, states in seen.items() if door != f"door_{DEAD_OF}"}


@contextmanager
def _daemon(scratch: Path, doors: int) -> Iterator[tuple[int, PlantSocket]]:
    """Its process id, and the hand on its plant."""
    file, directory = scratch / f"doors_{doors}.yaml", scratch / f"doors_{doors}"
    file.write_text(BUS + "".join(DOOR.format(unit=unit) for unit in range(1, doors + 1)))
    log = scratch / f"doors_{doors}.log"
    with running(daemon(file, directory, DOMAIN), log) as child:
        wait_for_log(log, "ready")
        time.sleep(SETTLE_S)
        plant = PlantSocket(directory / "plant.sock")
        yield child.pid, plant
        plant.close()


def _watched(seconds: float) -> Seen:
    """Every state that arrives in this time: (wall time of its arrival, state), by door."""
    seen: Seen = defaultdict(list)
    rmf = Rmf(transport="dds", domain_id=DOMAIN)
    transport = open_transport(rmf, "bench", localhost=True)
    transport.subscribe(
        DOOR_STATES, lambda state: seen[state.door_name].append((time.time(), state))
    )
    time.sleep(seconds)
    transport.close()
    return seen


def _figures(seen: Seen) -> dict[str, float]:
    ages = [at - in_seconds(state.door_time) for door in seen.values() for at, state in door]
    gaps = [after - before for door in seen.values() for (before, _), (after, _) in pairwise(door)]
    age50, age99 = _percentiles(ages)
    gap50, gap99 = _percentiles(gaps)
    return {
        "age_p50_ms": age50 * 1e3,
        "age_p99_ms": age99 * 1e3,
        "gap_p50_s": gap50,
        "gap_p99_s": gap99,
        "states": len(ages),
    }


def _percentiles(seconds: list[float]) -> tuple[float, float]:
    cuts = statistics.quantiles(seconds, n=100, method="inclusive")
    return cuts[49], cuts[98]
