"""Load four buses to their limits, and compare each with the least time that is possible in theory.

- A serial line with many doors.
- TCP with many doors, of which one is dead.
- HTTP with many chargers, of which some are dead or slow.
- A full CAN bus.
"""

import statistics
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Final, cast

import can
import requests

from bench.charger_servers import PERIOD_S, TIMEOUT_S, chargers_at, http_chargers
from bench.daemons import SETTLE_S, Content, daemon, graph, ready
from bench.figures import Row, Rows, Tables, percentiles
from bench.idle import doors
from bridges.messages.definitions import ChargerState, DoorState
from bridges.messages.stamps import in_seconds
from bridges.messages.topics import CHARGER_STATES, DOOR_STATES
from bridges.settings.load import Config, load
from drivers.door.dry_contact import create
from drivers.hal.can import CanBus, CanSettings, Frame, FrameFilter
from drivers.hal.modbus import ModbusBus
from hal_fakes.caller import Caller
from hal_fakes.simulate import Simulation


def measure(scratch: Path) -> Tables:
    """Return the tables of the four buses."""
    return {
        "8 doors at 19200 baud": _serial(scratch),
        "states of doors on one TCP gateway": _many_doors(scratch),
        "50 chargers, 15 of them bad": _bad_chargers(scratch),
        "CAN, full at 250 kbit/s": {
            "bare python-can": _flooded(_bare_can),
            "our bus": _flooded(_our_can),
        },
    }


# ---- serial line: a whole poll cycle, compared with the least time on the wire

LINE: Final[Content] = {
    "type": "modbus",
    "serial": {
        "port": "/dev/serial/by-id/simulated",
        "baudrate": 19200,
        "parity": "none",
        "stopbits": 1,
    },
}
POLLED: Final = 8
CYCLES: Final = 60
WARM_UP: Final = 3
REQUEST: Final = 8
REPLY: Final = 6
"""The lengths of a request and its reply (characters). Both lengths include unit and CRC. The request
asks for bits, and the reply has the bits."""
READINGS: Final = 2
"""The number of reads for one door: one read of its coil, and one read of its inputs."""


def _serial(scratch: Path) -> Rows:
    """Compare a poll cycle with the least time that its characters take on the wire.

    The least time is the time of all characters, and of 3.5 characters of silence before each frame.
    """
    daemon(doors(POLLED, LINE), scratch / "serial")  # writes the YAML
    config = load(scratch / "serial.yaml")
    serial = config.buses["line"].serial
    exchange_s = (REQUEST + REPLY) * serial.character_s + 2 * serial.gap_s
    wire_s = POLLED * READINGS * exchange_s
    p50, p99 = percentiles(_cycles(config, scratch))
    times = {"p50 ms": p50 * 1e3, "p50 ratio": p50 / wire_s, "p99 ratio": p99 / wire_s}
    return {"the wire alone": {"p50 ms": wire_s * 1e3}, "poll cycle": times}


def _cycles(config: Config, scratch: Path) -> list[float]:
    """Return the duration (s) of each poll of all doors."""
    simulation = Simulation(config, scratch)
    bus = cast(ModbusBus, simulation.open_bus("line"))
    drivers = [create(name, settings, bus) for name, settings in config.devices.items()]
    times = []
    for driver in drivers:
        driver.open()
    for _ in range(WARM_UP + CYCLES):
        begun_at = time.monotonic()
        for driver in drivers:
            driver.read()
        times.append(time.monotonic() - begun_at)
    for driver in drivers:
        driver.close()
    bus.close()
    simulation.close()
    return times[WARM_UP:]


# ---- many doors on TCP: the age of a state when it arrives, and the time between two states of a door

WATCHED_S: Final = 20.0
MANY: Final = 200
DEAD_OF: Final = 8
States = dict[str, list[tuple[float, DoorState]]]


def _many_doors(scratch: Path) -> Rows:
    """Measure the ages of door states for many doors, for few doors, and for few doors with one dead
    door.

    The daemon polls each door every 0.1 s, and publishes each door's state once a second.
    """
    with _doors(scratch, MANY):
        many = _ages(_door_states())
    with _doors(scratch, DEAD_OF) as plant:
        before = _ages(_door_states())
        plant.order(f"fail door_{DEAD_OF} unit off")
        time.sleep(SETTLE_S)
        states = _door_states()
    states.pop(f"door_{DEAD_OF}")
    return {f"{MANY}": many, f"{DEAD_OF}": before, f"{DEAD_OF}, one door dead": _ages(states)}


@contextmanager
def _doors(scratch: Path, many: int) -> Iterator[Caller]:
    directory = scratch / f"doors_{many}"
    with ready(daemon(doors(many), directory), scratch / f"doors_{many}.log"):
        time.sleep(SETTLE_S)
        with Caller(directory / "plant.sock") as plant:
            yield plant


def _door_states() -> States:
    """Return door -> (wall time of arrival, state) of each state that arrives within WATCHED_S."""
    seen: States = defaultdict(list)
    with graph() as transport:
        transport.subscribe(
            DOOR_STATES, lambda state: seen[state.door_name].append((time.time(), state))
        )
        time.sleep(WATCHED_S)
    return seen


def _ages(seen: States) -> Row:
    ages = [at - in_seconds(state.door_time) for door in seen.values() for at, state in door]
    gaps = [after - before for door in seen.values() for (before, _), (after, _) in pairwise(door)]
    (age50, age99), (_, gap99) = percentiles(ages), percentiles(gaps)
    return {
        "doors seen": len(seen),
        "age p50 ms": age50 * 1e3,
        "age p99 ms": age99 * 1e3,
        "gap p99 s": gap99,
    }


# ---- HTTP chargers: the age (poll periods) of the last reading that RMF has of each healthy charger

SOUND, DEAD, TRICKLING = 35, 10, 5
LOOK_S: Final = 0.02


class Known:
    """The wall time (s) of each charger's last known reading. Any thread may add a reading."""

    def __init__(self) -> None:
        self.read_at: dict[int, float] = {}

    def state(self, state: ChargerState) -> None:
        """Note the time of a ChargerState's reading."""
        self.read_at[int(state.charger_name.rpartition("_")[2])] = in_seconds(state.charger_time)


def _bad_chargers(scratch: Path) -> Rows:
    """Measure our daemon, and at the same time a naive loop, on the same servers.

    Each second, the naive loop calls `requests.get` for one charger after another. The timeout of
    `requests.get` does not limit a whole answer. It limits only the wait for the next bytes.
    """
    rmf, plain, done = Known(), Known(), threading.Event()
    with http_chargers(SOUND, DEAD, TRICKLING) as ports, graph() as transport:
        mixed = _mixed(ports)
        transport.subscribe(CHARGER_STATES, rmf.state)
        loop = threading.Thread(target=_sequential, args=(mixed, plain, done))
        command = daemon(chargers_at(mixed), scratch / "chargers", simulate=False)
        with ready(command, scratch / "chargers.log"):
            loop.start()
            time.sleep(SETTLE_S)
            sound = [n for n, port in enumerate(mixed) if port in ports[:SOUND]]
            rows = _known_ages(sound, {"one daemon": rmf, "requests.get in turn": plain})
            done.set()
            loop.join()
    return rows


def _mixed(ports: Sequence[int]) -> list[int]:
    """Return the ports in an order that spreads the bad chargers among the healthy chargers."""
    bad, sound = list(ports[SOUND:]), list(ports[:SOUND])
    every = len(ports) // len(bad)
    mixed = [
        sound.pop() if n % every or not bad else bad.pop() for n in range(len(ports) - len(bad))
    ]
    return [*mixed, *sound, *bad]


def _sequential(ports: Sequence[int], known: Known, done: threading.Event) -> None:
    """Read every charger in turn, each second."""
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


def _known_ages(chargers: Sequence[int], knowns: dict[str, Known]) -> Rows:
    """Return the ages of these chargers' known readings, in poll periods."""
    never = time.time() - SETTLE_S
    ages: dict[str, list[float]] = {name: [] for name in knowns}
    for _ in range(round(1.5 * WATCHED_S / LOOK_S)):
        now = time.time()
        for name, known in knowns.items():
            ages[name] += [(now - known.read_at.get(n, never)) / PERIOD_S for n in chargers]
        time.sleep(LOOK_S)
    cuts = {name: statistics.quantiles(values, n=100) for name, values in ages.items()}
    return {name: {"p50 periods": cut[49], "p99 periods": cut[98]} for name, cut in cuts.items()}


# ---- CAN: a full bus of 250 kbit/s carries about 2,000 frames a second

RATE: Final = 2_000
LASTS_S: Final = 10.0
BATCH_S: Final = 0.005
SCAN_S: Final = 0.2
OURS: Final = (0x58A, 0x70A, 0x123, 0x321)
"""The CAN ids that the reader wants. Every second frame has one of these ids. The other frames belong
to other devices."""


def _flooded(read: Callable[[str, threading.Event, list[int]], float]) -> Row:
    """Send as many frames as a full bus carries. Return the frames lost, and the reader's CPU load."""
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
        "sent/s": sent / took_s,
        "lost": (sent + 1) // 2 - heard[0],
        "CPU %": 100 * seconds[0] / took_s,
    }


def _send(channel: str) -> tuple[int, float]:
    """Send frames at a fixed pace. Return the number of frames, and the time (s) taken."""
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


def _bare_can(channel: str, ended: threading.Event, heard: list[int]) -> float:
    """Read the frames with python-can alone. Return the CPU time (s)."""
    bus = can.Bus(channel, interface="virtual")
    begun_s = time.thread_time()
    while not ended.wait(SCAN_S):
        while (message := bus.recv(0)) is not None:
            heard[0] += message.arbitration_id in OURS
    spent_s = time.thread_time() - begun_s
    bus.shutdown()
    return spent_s


def _our_can(channel: str, ended: threading.Event, heard: list[int]) -> float:
    """Read the frames with our bus, which passes on only the four wanted ids. Return the CPU time
    (s)."""
    settings = CanSettings(socketcan="can0", scan_s=SCAN_S)
    bus = CanBus(settings, vendor=lambda: can.Bus(channel, interface="virtual"))

    def count(frame: Frame, at: float) -> None:
        heard[0] += 1

    bus.listen([FrameFilter(frame_id) for frame_id in OURS], count)
    bus.take()
    begun_s = time.thread_time()
    while not ended.wait(SCAN_S):
        bus.take()
    spent_s = time.thread_time() - begun_s
    bus.close()
    return spent_s
