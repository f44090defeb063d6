"""Measure three durations: from request to relay, from input to RMF, and from hazard to all outputs
off.

The baseline is a bare round trip and a bare edge callback. If ROS 2 is installed, a bare rclpy node is
one more baseline. For each path, this process sends the requests and measures the times. It uses `dds`,
because `dds` costs the least time.
"""

import queue
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

from bench.daemons import (
    BARE,
    DOMAIN,
    WIRES,
    Content,
    daemon,
    graph,
    memory_mb,
    ready,
    shipped,
)
from bench.figures import Rows, Tables, compared, percentiles
from bench.peers import PUBLISHES_S
from bridges.messages.definitions import LiftMode, LiftRequest, LiftRequestType, LiftState
from bridges.messages.topics import LIFT_REQUESTS, LIFT_STATES
from bridges.settings.load import load
from bridges.transports.choose import missing_of_ros
from bridges.transports.transport import Transport
from drivers.hal.gpio import canonical
from drivers.lift.dry_contact import DryContactLiftSettings, wires
from hal_fakes.caller import Caller
from hal_fakes.gpio import WiredFactory
from hal_fakes.plants.lift import build
from hal_fakes.wire import Wire
from hal_fakes.wiring import PlantWiring

ROUNDS = 80
HAZARDS = 50
WARM_UP = 20
PAUSE_S = 0.12
"""The pause (s) between rounds. A shorter pause would hide two delays that real use has: a daemon sends
at most ten states a second, and an idle CPU sleeps between requests."""
PEER_ROUNDS = 8
PEERS = {
    style: [sys.executable, "-m", "bench.peers", str(DOMAIN), style] for style in ("timers", "loop")
}
MINIMAL = [sys.executable, "-m", "bench.minimal_ros", str(DOMAIN)]
Times = list[float]


def measure(scratch: Path) -> Tables:
    """Return p50 and p99 of each path (ms)."""
    latencies: Rows = {}
    callbacks = _bare_callbacks(scratch)
    simulated_s = percentiles(callbacks)[0]
    for wire in reversed(WIRES):  # the hazard's figures are those of the last wire, dds
        round_trips = _bare_round_trips(scratch, wire)
        relay, state, off, rss_mb = daemon_paths(scratch, wire, wire)
        latencies |= {
            f"bare round trip on {wire}": compared(round_trips, round_trips),
            f"LiftRequest to relay edge on {wire}": compared(relay, round_trips),
            f"input edge to LiftState on {wire}": compared(state, round_trips),
            f"gpiozero's callback to LiftState on {wire}": compared(
                [took - simulated_s for took in state], round_trips
            ),
        }
    scan_s = load(scratch / "quick_dds.yaml").buses["header"].scan_s
    worst = {"worst in scan periods": max(off) / scan_s}
    return {
        "latency": latencies,
        "hazard input edge": {
            "to a bare edge callback": compared(callbacks, callbacks),
            "to all outputs off": {**compared(off, callbacks), **worst},
        },
        "peers on dds": _beside_peers(scratch, relay, state, rss_mb),
        **_with_ros(scratch),
    }


def _beside_peers(scratch: Path, relay: Times, state: Times, rss_mb: float) -> Rows:
    """Compare nodes in the usual style with the lift's daemon, whose times and memory are given."""
    rows: Rows = {}
    for style, command in PEERS.items():
        its_relay, its_state, its_mb = _minimal(scratch, command, PEER_ROUNDS, PUBLISHES_S)
        rows[f"{style}: request to relay"] = compared(its_relay, relay)
        rows[f"{style}: input edge to LiftState"] = compared(its_state, state)
        rows[f"{style}: memory"] = {"RSS MB": its_mb, "ratio": its_mb / rss_mb}
    return rows


def _with_ros(scratch: Path) -> Tables:
    """Compare a lift daemon on `ros2` and on `dds` with an rclpy node that only sets a pin."""
    if missing := missing_of_ros():
        return {f"with ROS 2: nothing, as there is no ROS here ({missing})": {}}
    bare_relay, bare_state, bare_mb = _minimal(scratch, MINIMAL)
    relays: Rows = {"minimal rclpy node": {**compared(bare_relay, bare_relay), "RSS MB": bare_mb}}
    states: Rows = {"minimal rclpy node": compared(bare_state, bare_state)}
    for transport in ("ros2", "dds"):
        relay, state, _, rss_mb = daemon_paths(scratch, transport)
        name = f"lift daemon on {transport}"
        relays[name] = {**compared(relay, bare_relay), "RSS MB": rss_mb}
        states[name] = compared(state, bare_state)
    return {"with ROS 2, request to relay": relays, "with ROS 2, edge to LiftState": states}


class Graph:
    """This process's publisher of LiftRequests and subscriber to LiftStates. It notes when LiftStates
    arrive."""

    def __init__(self, transport: Transport) -> None:
        self._requests = transport.publisher(LIFT_REQUESTS)
        self._states: queue.SimpleQueue[tuple[float, LiftState]] = queue.SimpleQueue()
        transport.subscribe(LIFT_STATES, lambda s: self._states.put((time.monotonic(), s)))
        while not self._requests.matched():
            time.sleep(0.01)
        time.sleep(0.5)  # DDS may not have matched the other side yet

    def send(self, session: str, request_type: LiftRequestType, floor: str) -> float:
        """Publish a request. Return the time of publishing (monotonic s)."""
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
        """Return the arrival time (monotonic s) of the first state after `since` for which `true`
        returns True."""
        while True:
            at, state = self._states.get(timeout=10.0)
            if at > since and true(state):
                return at


def _bare_round_trips(scratch: Path, wire: Wire) -> Times:
    with ready([*BARE, wire], scratch / f"bare_{wire}.log"), graph(wire) as transport:
        far = Graph(transport)
        return _measured(lambda: _round_trip(far))


def _measured(once: Callable[[], float], rounds: int = ROUNDS, warm_up: int = WARM_UP) -> Times:
    return [once() for _ in range(warm_up + rounds)][warm_up:]


def _round_trip(far: Graph) -> float:
    sent_at = far.send("bench", LiftRequestType.REQUEST_AGV_MODE, "L1")
    took = far.state(sent_at, lambda s: bool(s.session_id)) - sent_at
    time.sleep(PAUSE_S)
    return took


def _quick_lift() -> Content:
    """Return the shipped lift without deliberate delays, so that only the path counts."""
    content = shipped("lift_dry_contact")
    lift = content["lifts"]["Lift1"]
    for contact in _contacts(lift["inputs"]):
        contact["debounce_s"] = 0
    times = {"release_grace_s": 0, "min_off_s": 0, "hazard_clear_s": 0, "max_cycles_per_min": 600}
    lift["limits"] = {**lift.get("limits", {}), **times}
    return content


def _contacts(part: Any) -> list[dict[str, Any]]:
    if isinstance(part, dict) and "point" in part:
        return [part]
    parts = part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()
    return [contact for each in parts for contact in _contacts(each)]


def daemon_paths(
    scratch: Path, transport: str, ours: Wire = "dds", *, keep: str = ""
) -> tuple[Times, Times, Times, float]:
    """Return three lists of times (s), and the daemon's memory (MB). The times are from request to
    relay, from edge to RMF, and from hazard to all outputs off.

    `ours` is the transport of this process. `keep` is `keep` in the YAML's section `recording`, or ""
    for the default.
    """
    directory = scratch / f"quick_{transport}{keep}"
    recording = {"recording": {"keep": keep}} if keep else {}
    command = daemon({**_quick_lift(), **recording}, directory, transport)
    with ready(command, directory.with_suffix(".log")) as child, graph(ours) as node:
        far, sock = Graph(node), directory / "plant.sock"
        with Caller(sock) as plant, Caller(sock) as hand:
            plant.order("follow")
            relay = _measured(lambda: _to_relay(far, plant))
            state = _measured(lambda: _to_state(far, plant, hand))
            off = _measured(lambda: _to_outputs_off(far, plant, hand), HAZARDS)
        return relay, state, off, memory_mb(child.pid)


def _to_relay(far: Graph, plant: Caller) -> float:
    sent_at = far.send("bench", LiftRequestType.REQUEST_AGV_MODE, "L1")
    took = plant.edge("agv_mode_request", True) - sent_at
    far.send("bench", LiftRequestType.REQUEST_END_SESSION, "")
    plant.edge("agv_mode_request", False)
    time.sleep(PAUSE_S)
    return took


def _to_state(far: Graph, plant: Caller, hand: Caller) -> float:
    emergency = LiftMode.MODE_EMERGENCY
    hand.order("press Lift1 code_blue on")
    edge_at = plant.edge("code_blue", True)
    took = far.state(edge_at, lambda s: s.current_mode == emergency) - edge_at
    hand.order("press Lift1 code_blue off")
    over_at = plant.edge("code_blue", False)
    far.state(over_at, lambda s: s.current_mode != emergency)
    time.sleep(PAUSE_S)
    return took


def _to_outputs_off(far: Graph, plant: Caller, hand: Caller) -> float:
    far.send("bench", LiftRequestType.REQUEST_AGV_MODE, "L1")
    plant.edge("agv_mode_request", True)
    hand.order("press Lift1 fire_alarm on")
    at = plant.edge("fire_alarm", True)
    took = plant.edge("agv_mode_request", False) - at
    # End the session during the fire. Otherwise the lift would switch the session's relay on again
    # after the fire.
    ended_at = far.send("bench", LiftRequestType.REQUEST_END_SESSION, "")
    far.state(ended_at, lambda state: not state.session_id)
    hand.order("press Lift1 fire_alarm off")
    plant.edge("fire_alarm", False)
    time.sleep(PAUSE_S)
    return took


def _bare_callbacks(scratch: Path) -> Times:
    """Return the times (s) from the contact to gpiozero's callback, in a process that is otherwise
    idle."""
    daemon(_quick_lift(), scratch / "callbacks")  # writes the YAML
    settings = load(scratch / "callbacks.yaml").devices["Lift1"]
    assert isinstance(settings, DryContactLiftSettings)
    plant = build("Lift1", settings)
    factory = WiredFactory([PlantWiring(plant, wires(settings), canonical)])
    pin = factory.pin(canonical(settings.inputs.fire_alarm.point))  # type: ignore[union-attr]
    pin.input_with_pull("down")
    pin.edges = "both"
    seen: list[float] = []

    def changed(ticks: Any, state: Any) -> None:
        seen.append(time.monotonic())

    pin.when_changed = changed
    took = []
    for number in range(2 * HAZARDS):
        at = time.monotonic()
        plant.press("fire_alarm", number % 2 == 0, at)
        factory.show(at)
        if len(seen) > number:
            took.append(seen[-1] - at)
        time.sleep(0.01)
    return took


def _minimal(
    scratch: Path, command: list[str], rounds: int = ROUNDS, pause_s: float = 0.0
) -> tuple[Times, Times, float]:
    """Measure a node that sets a pin. A random pause of at most `pause_s` comes before each round, so
    that the rounds meet each moment of a node's timers."""
    random = Random(1)

    def after_pause(once: Callable[[Graph, subprocess.Popen[bytes]], float]) -> float:
        time.sleep(random.uniform(0.0, pause_s))
        return once(far, child)

    with ready(command, scratch / "minimal.log") as child, graph() as node:
        far, warm_up = Graph(node), min(WARM_UP, rounds // 4)
        relay = _measured(lambda: after_pause(_minimal_relay), rounds, warm_up)
        state = _measured(lambda: after_pause(_minimal_state), rounds, warm_up)
        return relay, state, memory_mb(child.pid)


def _minimal_relay(far: Graph, child: "subprocess.Popen[bytes]") -> float:
    sent_at = far.send("bench", LiftRequestType.REQUEST_AGV_MODE, "L1")
    took = _edge(child, "relay 1") - sent_at
    far.send("bench", LiftRequestType.REQUEST_END_SESSION, "")
    _edge(child, "relay 0")
    time.sleep(PAUSE_S)
    return took


def _minimal_state(far: Graph, child: "subprocess.Popen[bytes]") -> float:
    edge_at = _press(child, "on", "input 1")
    arrived = far.state(edge_at, lambda s: s.current_mode == LiftMode.MODE_EMERGENCY)
    over_at = _press(child, "off", "input 0")
    far.state(over_at, lambda s: s.current_mode != LiftMode.MODE_EMERGENCY)
    time.sleep(PAUSE_S)
    return arrived - edge_at


def _press(child: "subprocess.Popen[bytes]", word: str, edge: str) -> float:
    assert child.stdin is not None
    child.stdin.write(f"{word}\n".encode())
    child.stdin.flush()
    return _edge(child, edge)


def _edge(child: "subprocess.Popen[bytes]", edge: str) -> float:
    assert child.stdout is not None
    while True:
        signal, level, at = child.stdout.readline().decode().split()
        if f"{signal} {level}" == edge:
            return float(at)
