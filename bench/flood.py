"""`make flood`: test a lift's daemon under ten thousand requests a second for a minute.

Half of the requests are valid. The other half name unknown floors. The daemon's memory must stay
constant. The daemon must publish a state each second, and must obey the last valid request.
"""

import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from bench.daemons import DOMAIN, cpu_s, daemon, memory_mb, ready, shipped
from bridges.messages.definitions import LiftRequest, LiftState
from bridges.messages.topics import LIFT_REQUESTS, LIFT_STATES
from bridges.transports.dds.transport import DdsTransport
from bridges.transports.transport import Publisher

SECONDS = 60.0
A_SECOND = 10_000
BURST = 100
SETTLED_S = 3.0
RIGHT = LiftRequest(
    "Lift1", session_id="fleet/robot", request_type=1, destination_floor="L3", door_state=2
)
WRONG = replace(RIGHT, destination_floor="L9")


def measure(scratch: Path, seconds: float) -> dict[str, Any]:
    """Return figures of the daemon before, during and after the flood."""
    command = daemon(shipped("lift_dry_contact"), scratch / "flood")
    with ready(command, scratch / "flood.log") as child:
        rmf = DdsTransport("flood", DOMAIN, loopback=True)
        heard: list[tuple[float, LiftState]] = []
        rmf.subscribe(LIFT_STATES, lambda state: heard.append((time.monotonic(), state)))
        requests = rmf.publisher(LIFT_REQUESTS)
        time.sleep(SETTLED_S)
        before_mb, before_s, started_at = memory_mb(child.pid), cpu_s(child.pid), time.monotonic()
        rss_mb, sent = _flood(requests, child.pid, seconds)
        took_s = time.monotonic() - started_at
        during_s = cpu_s(child.pid) - before_s
        requests.publish(replace(RIGHT, destination_floor="L2"))
        time.sleep(SETTLED_S)
        rmf.close()
        return {
            "sent_a_second": sent / took_s,
            "seconds": took_s,
            "cpu_percent": 100 * during_s / took_s,
            "rss_mb": {"before": before_mb, "after 5 s": rss_mb[0], "most": max(rss_mb)},
            "longest_gap_s": _longest_gap(heard, started_at, started_at + took_s),
            "last_right_request_counts": heard[-1][1].destination_floor == "L2",
        }


def _flood(requests: Publisher[LiftRequest], pid: int, seconds: float) -> tuple[list[float], int]:
    """Send requests. Return the daemon's memory (MB) each 5 s, and the number of requests sent."""
    sent, started_at = 0, time.monotonic()
    rss_mb: list[float] = []
    while (passed_s := time.monotonic() - started_at) < seconds:
        for _ in range(BURST // 2):
            requests.publish(RIGHT)
            requests.publish(WRONG)
        sent += BURST
        if passed_s >= 5 * (len(rss_mb) + 1):
            rss_mb.append(memory_mb(pid))
        time.sleep(max(0.0, started_at + sent / A_SECOND - time.monotonic()))
    return [*rss_mb, memory_mb(pid)], sent


def _longest_gap(heard: list[tuple[float, LiftState]], start: float, end: float) -> float:
    times = [start, *(at for at, _ in heard if start < at < end), end]
    return max(after - before for before, after in pairwise(times))


def show(figures: dict[str, Any]) -> None:
    """Print each figure on its own line."""
    for name, value in figures.items():
        shown = value if isinstance(value, dict | bool) else round(value, 2)
        print(f"{name:28}{shown}")


def main() -> int:
    """Flood the daemon. The command line gives the time (s), which is 60 by default."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    with tempfile.TemporaryDirectory(prefix="rmf-flood-") as scratch:
        figures = measure(Path(scratch), seconds)
    show(figures)
    return 0 if figures["last_right_request_counts"] and figures["longest_gap_s"] < 2 else 1


if __name__ == "__main__":
    sys.exit(main())
