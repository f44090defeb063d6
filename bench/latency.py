"""How long a request takes to the relay, and an input to RMF, against a bare round trip."""

import queue
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bench.daemons import ROOT, PlantSocket, daemon, memory_mb, running, wait_for_log
from bridges.core.fields import Rmf
from bridges.rmf.choose import open_transport
from bridges.rmf.definitions import LiftMode, LiftRequest, LiftRequestType, LiftState
from bridges.rmf.topics import LIFT_REQUESTS, LIFT_STATES
from bridges.rmf.transport import Transport
from hal_fakes.wire import Wire

DOMAIN = 71
ROUNDS = 300
WARM_UP = 20
WIRES: tuple[Wire, ...] = ("dds", "zenoh")
PAUSE_S = 0.12
"""Between rounds, everywhere alike: a daemon sends ten states a second at most, and idle CPUs sleep."""


def measure(scratch: Path) -> dict[str, Any]:
    """Milliseconds, p50 and p99, of each path."""
    rows: dict[str, Any] = {}
    for wire in WIRES:
        bare = _bare_round_trips(scratch, wire)
        relay, state, _ = daemon_paths(scratch, wire, wire)
        rows |= {
            f"{wire}: bare round trip": figures(bare, bare),
            f"{wire}: LiftRequest to relay": figures(relay, bare),
            f"{wire}: input to LiftState": figures(state, bare),
        }
    return rows


def show(figures: dict[str, Any]) -> None:
    """The table."""
    print(f"{'latency':28}{'p50 ms':>9}{'p99 ms':>9}{'p50 ratio':>11}{'p99 ratio':>11}")
    for name, row in figures.items():
        ratios = f"{row['p50_ratio']:>10.2f}x{row['p99_ratio']:>10.2f}x"
        print(f"{name:28}{row['p50_ms']:>9.3f}{row['p99_ms']:>9.3f}{ratios}")


def figures(seconds: list[float], bare: list[float]) -> dict[str, float]:
    p50, p99 = _percentiles(seconds)
    bare50, bare99 = _percentiles(bare)
    return {
        "p50_ms": p50 * 1e3,
        "p99_ms": p99 * 1e3,
        "p50_ratio": p50 / bare50,
        "p99_ratio": p99 / bare99,
        "rounds": len(seconds),
    }


def _percentiles(seconds: list[float]) -> tuple[float, float]:
    cuts = statistics.quantiles(seconds, n=100, method="inclusive")
    return cuts[49], cuts[98]


class Graph:
    """This process's end: sends LiftRequests, and times the LiftStates that come."""

    def __init__(self, speaks: Wire = "dds") -> None:
        rmf = Rmf(transport=speaks, domain_id=DOMAIN)
        self.transport: Transport = open_transport(rmf, "bench", localhost=True)
        self._requests = self.transport.publisher(LIFT_REQUESTS)
        self._states: queue.SimpleQueue[tuple[float, LiftState]] = queue.SimpleQueue()
        self.transport.subscribe(LIFT_STATES, lambda s: self._states.put((time.monotonic(), s)))
        while not self._requests.matched():
            time.sleep(0.01)
        time.sleep(0.5)  # the other side may not have matched yet

    def send(self, session: str, request_type: LiftRequestType, floor: str) -> float:
        """Publish a request; when (monotonic s)."""
        at = time.monotonic()
        self._requests.publish(
            LiftRequest(
                "Lift1",
                session_id=session,
                destination_floor=floor,
                request_type=int(request_type),
                door_state=2,
            )
        )
        return at

    def state(self, since: float, true: Callable[[LiftState], bool]) -> float:
        """When the first state after `since` (monotonic s) for which this is true arrived."""
        while True:
            at, state = self._states.get(timeout=10.0)
            if at > since and true(state):
                return at


def _bare_round_trips(scratch: Path, wire: Wire) -> list[float]:
    log = scratch / f"bare_{wire}.log"
    with running([sys.executable, "-m", "bench.bare", str(DOMAIN), wire], log):
        wait_for_log(log, "ready")
        graph = Graph(wire)
        times = []
        for i in range(WARM_UP + ROUNDS):
            sent_at = graph.send(str(i), LiftRequestType.REQUEST_AGV_MODE, "L1")
            times.append(graph.state(sent_at, lambda s: bool(s.session_id)) - sent_at)
            time.sleep(PAUSE_S)
        graph.transport.close()
    return times[WARM_UP:]


def quick_lift(scratch: Path) -> Path:
    """The shipped lift with every deliberate delay taken out, so that only the path is measured."""
    text = (ROOT / "config/lift_dry_contact.yaml").read_text()
    text = text.replace("pull: down", "pull: down, debounce_s: 0")
    times = "release_grace_s: 0, min_off_s: 0, hazard_clear_s: 0, max_cycles_per_min: 600"
    text = text.replace("    floors:", f"    limits: {{{times}}}\n    floors:")
    file = scratch / "quick_lift.yaml"
    file.write_text(text)
    return file


def daemon_paths(
    scratch: Path, transport: str = "dds", ours: Wire = "dds"
) -> tuple[list[float], list[float], float]:
    """Seconds of each request to the relay and each edge to RMF, and the daemon's memory (MB).

    `ours`: the wire of this end.
    """
    log, directory = scratch / f"quick_{transport}.log", scratch / f"quick_{transport}"
    with running(daemon(quick_lift(scratch), directory, DOMAIN, transport), log) as child:
        wait_for_log(log, "ready")
        graph = Graph(ours)
        plant = PlantSocket(directory / "plant.sock")
        plant.say("follow")
        driver = PlantSocket(directory / "plant.sock")
        relay = [_to_relay(graph, plant) for _ in range(WARM_UP + ROUNDS)]
        state = [_to_state(graph, plant, driver) for _ in range(WARM_UP + ROUNDS)]
        for end in (plant, driver, graph.transport):
            end.close()
        return relay[WARM_UP:], state[WARM_UP:], memory_mb(child.pid)


def _to_relay(graph: Graph, plant: PlantSocket) -> float:
    sent_at = graph.send("bench", LiftRequestType.REQUEST_AGV_MODE, "L1")
    took = plant.edge("agv_mode_request", True) - sent_at
    graph.send("bench", LiftRequestType.REQUEST_END_SESSION, "")
    plant.edge("agv_mode_request", False)
    time.sleep(PAUSE_S)
    return took


def _to_state(graph: Graph, plant: PlantSocket, driver: PlantSocket) -> float:
    emergency = LiftMode.MODE_EMERGENCY
    driver.say("press Lift1 code_blue on")
    edge_at = plant.edge("code_blue", True)
    took = graph.state(edge_at, lambda s: s.current_mode == emergency) - edge_at
    driver.say("press Lift1 code_blue off")
    over_at = plant.edge("code_blue", False)
    graph.state(over_at, lambda s: s.current_mode != emergency)
    time.sleep(PAUSE_S)
    return took
