"""Measure `rmf-bridge explain` on a busy lift's day: CPU time (s) and memory in a process of its own.

The recording covers 86,400 s, with 4,000 rides of two robots. It has states, requests, the requests
that the supervisor repeats, and diagnostics at 1 Hz. The time for writing the file does not count.
"""

import json
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from msgspec.structs import replace

from bench.figures import Tables
from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.messages.releases import NEWEST
from bridges.messages.stamps import stamp

DAY_S, RIDES = 86400, 4000
EPOCH = 1_800_000_000.0
STATE = d.LiftState(
    lift_name="Lift1", available_floors=("L1", "L2", "L3", "L4"), available_modes=(1, 2)
)
VALUES = ("mode", "floor", "door", "motion", "session", "boarded", "destination", "outputs")


def measure(scratch: Path) -> Tables:
    """Write the recording, explain it in a separate process, and return the figures of that process."""
    from tests.workbench.replay.written import write

    bag = write(scratch / "day", day(), NEWEST)
    told = json.loads(
        subprocess.run(
            [sys.executable, "-m", "bench.explain", str(bag)],
            check=True,
            capture_output=True,
            text=True,
        ).stdout
    )
    megabytes = sum(file.stat().st_size for file in bag.iterdir()) / 1e6
    return {"a recording, explained": {f"{DAY_S} s, {RIDES} rides, {megabytes:.0f} MB": told}}


def day() -> Iterator[Heard]:
    """Yield the messages of the recorded day."""
    every = DAY_S / RIDES
    for second in range(DAY_S):
        ride, at = divmod(second, every)
        yield from _second(second, int(ride), at / every)


def _second(second: int, ride: int, part: float) -> Iterator[Heard]:
    who = f"fleet/robot{ride % 2}"
    floor, door = f"L{1 + ride % 4}", 2 if part > 0.5 else 0
    has = part < 0.9
    state = replace(
        STATE,
        lift_time=stamp(EPOCH + second),
        current_floor=floor if part > 0.3 else "",
        destination_floor=floor if has else "",
        door_state=door,
        motion_state=0 if part > 0.3 else 1,
        current_mode=2 if has else 1,
        session_id=who if 0.05 < part < 0.95 else "",
    )
    yield _heard(second, 0.0, "lift_states", state)
    asks = d.LiftRequest("Lift1", stamp(EPOCH + second), who, 1 if has else 0, floor, 2)
    yield _heard(second, 0.01, "adapter_lift_requests", asks)
    yield _heard(second, 0.02, "lift_requests", asks)
    if part < 0.5:
        yield _heard(second, 0.03, "lift_requests", asks)
    for number, kind in enumerate(("lift", "lift_supervisor")):
        values = (d.KeyValue("kind", kind), *(d.KeyValue(key, who) for key in VALUES))
        status = d.DiagnosticStatus(0, f"{kind}: Lift1", "OK", "Lift1", values)
        array = d.DiagnosticArray(d.Header(stamp(EPOCH + second)), (status,))
        yield _heard(second, 0.04 + number / 100, "diagnostics", array)


def _heard(second: int, part: float, topic: str, message: d.Message) -> Heard:
    return Heard(second + part, EPOCH + second + part, topic, message)


def main(bag: Path) -> None:
    """Explain a recording, and print figures as JSON."""
    from workbench.explain.heard_devices import HeardDevices
    from workbench.replay.recordings import RecordingSpan, told_between

    began, site = time.process_time(), HeardDevices("Lift1")
    for heard in told_between(bag, RecordingSpan(None, None), "bench", "Lift1"):
        site.take(heard)
    told = site.explain("lift", "Lift1", None)
    took_s = time.process_time() - began
    assert told.before.startswith(f"{RIDES - 1} rides ended") or told.before.startswith(f"{RIDES} ")
    figures = {
        "decoded": site.messages,
        "CPU s": round(took_s, 2),
        "peak MB": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000, 1),
    }
    print(json.dumps(figures))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
