"""CAN: is a frame lost on a bus that is full, what does that cost, and what does one more charger?

A bus of 250 kbit/s carries about 2,000 frames a second when it is full. They come over python-can's
virtual bus at that pace, and our bus takes them scan by scan; beside it a bare python-can reader has
the same to do. Chargers are daemons on simulated adapters, one with one receiver and one with eight.
"""

import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import can

from bench.daemons import daemon
from bench.idle import watch
from drivers.hal.can import CanBus, Frame, Settings, Wanted

RATE: Final = 2_000
LASTS_S: Final = 10.0
BATCH_S: Final = 0.005
SCAN_S: Final = 0.2
OURS: Final = (0x58A, 0x70A, 0x123, 0x321)
"""Every second frame is one of these; the rest is somebody else's."""
DOMAIN: Final = 73

FILE: Final = """\
kind: charger
driver: canopen
buses:
  can: {type: can, slcan: {port: /dev/serial/by-id/simulated, bitrate: 250000}}
chargers:
"""


def measure(scratch: Path) -> dict[str, Any]:
    """Frames lost and CPU at a full bus; memory and CPU of daemons."""
    return {
        "full_bus": {"bare python-can": _flooded(_bare), "our bus": _flooded(_ours)},
        "daemons": {f"{n} CANopen": _daemon(scratch, n) for n in (1, 8)},
    }


def show(figures: dict[str, Any]) -> None:
    """Two tables."""
    print(f"\n{'CAN, full at 250 kbit/s':28}{'sent/s':>9}{'lost':>9}{'CPU %':>8}")
    for name, row in figures["full_bus"].items():
        print(f"{name:28}{row['rate']:>9.0f}{row['lost']:>9}{row['cpu_percent']:>8.2f}")
    print(f"\n{'chargers in one daemon':28}{'RSS MB':>9}{'CPU %':>8}")
    one, eight = figures["daemons"].values()
    for name, row in figures["daemons"].items():
        print(f"{name:28}{row['rss_mb']:>9.1f}{row['cpu_percent']:>8.2f}")
    more = {key: (eight[key] - one[key]) / 7 for key in ("rss_mb", "cpu_percent")}
    print(f"{'each more':28}{more['rss_mb']:>9.2f}{more['cpu_percent']:>8.2f}")


def _flooded(read: Callable[[str, threading.Event, list[int]], float]) -> dict[str, float]:
    """Frames at a full bus's pace, and a reader that counts those that it wants."""
    channel = f"bench-{read.__name__}"
    ended, heard, seconds = threading.Event(), [0], list[float]()
    reader = threading.Thread(target=lambda: seconds.append(read(channel, ended, heard)))
    reader.start()
    time.sleep(0.3)
    sent, took_s = _send(channel)
    time.sleep(2 * SCAN_S)
    ended.set()
    reader.join()
    return {
        "rate": sent / took_s,
        "lost": (sent + 1) // 2 - heard[0],
        "cpu_percent": 100 * seconds[0] / took_s,
    }


def _send(channel: str) -> tuple[int, float]:
    """Frames, paced; how many, and in how many seconds."""
    bus = can.Bus(channel, interface="virtual")
    begun_at = time.monotonic()
    sent = 0
    while (since_s := time.monotonic() - begun_at) < LASTS_S:
        while sent < since_s * RATE:
            ours = sent % 2 == 0
            frame_id = OURS[sent // 2 % len(OURS)] if ours else 0x400 + sent % 64
            bus.send(can.Message(arbitration_id=frame_id, is_extended_id=False, data=bytes(8)))
            sent += 1
        time.sleep(BATCH_S)
    sent_in_s = time.monotonic() - begun_at
    bus.shutdown()
    return sent, sent_in_s


def _bare(channel: str, ended: threading.Event, heard: list[int]) -> float:
    """What nothing but python-can costs: CPU seconds."""
    bus = can.Bus(channel, interface="virtual")
    begun_s = time.thread_time()
    while not ended.wait(SCAN_S):
        while (message := bus.recv(0)) is not None:
            heard[0] += message.arbitration_id in OURS
    spent_s = time.thread_time() - begun_s
    bus.shutdown()
    return spent_s


def _ours(channel: str, ended: threading.Event, heard: list[int]) -> float:
    """What our bus costs, with four ids wanted: CPU seconds."""
    settings = Settings(socketcan="can0", scan_s=SCAN_S)
    bus = CanBus(settings, vendor=lambda: can.Bus(channel, interface="virtual"))

    def count(frame: Frame, at: float) -> None:
        heard[0] += 1

    bus.listen([Wanted(frame_id) for frame_id in OURS], count)
    bus.take()
    begun_s = time.thread_time()
    while not ended.wait(SCAN_S):
        bus.take()
    spent_s = time.thread_time() - begun_s
    bus.close()
    return spent_s


def _daemon(scratch: Path, chargers: int) -> dict[str, float]:
    """A daemon with so many receivers on one simulated adapter, idle."""
    file = scratch / f"can_{chargers}.yaml"
    devices = (f"  charger_{n}: {{node: {n}}}\n" for n in range(1, chargers + 1))
    file.write_text(FILE + "".join(devices))
    name = f"can_{chargers}"
    return watch(daemon(file, scratch / name, DOMAIN), scratch / f"{name}.log")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="rmf-bench-can-") as directory:
        show(measure(Path(directory)))
