"""A lift daemon on `ros2` and on `dds`, against an rclpy node that only sets a pin, in one run.

The far end, which sends and times, is the same for each: on `dds`, as cheap as it can be.
"""

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from bench.daemons import memory_mb, running, wait_for_log
from bench.latency import DOMAIN, PAUSE_S, ROUNDS, WARM_UP, Graph, daemon_paths, figures
from bridges.rmf.choose import missing_of_ros
from bridges.rmf.definitions import LiftMode, LiftRequestType

MINIMAL = "minimal rclpy node"


def measure(scratch: Path) -> dict[str, Any]:
    """Milliseconds and megabytes of each; why there is none where there is no ROS."""
    missing = missing_of_ros()
    if missing:
        return {"no ROS here": missing}
    paths = {MINIMAL: _minimal(scratch)}
    for transport in ("ros2", "dds"):
        paths[f"lift daemon on {transport}"] = daemon_paths(scratch, transport)
    bare_relay, bare_state, _ = paths[MINIMAL]
    return {
        name: {
            "relay": figures(relay, bare_relay),
            "state": figures(state, bare_state),
            "rss_mb": rss_mb,
        }
        for name, (relay, state, rss_mb) in paths.items()
    }


def show(measured: dict[str, Any]) -> None:
    """The table."""
    if reason := measured.get("no ROS here"):
        print(f"\nno ROS here, so nothing on ros2 was measured: {reason}")
        return
    print(
        f"\n{'with ROS 2 (p50, p99)':26}{'request to relay ms':>27}{'edge to state ms':>27}", end=""
    )
    print(f"{'RSS MB':>9}")
    for name, row in measured.items():
        print(f"{name:26}{_cells(row['relay'])}{_cells(row['state'])}{row['rss_mb']:>9.1f}")


def _cells(row: dict[str, float]) -> str:
    return f"{row['p50_ms']:>9.3f}{row['p99_ms']:>9.3f} ({row['p50_ratio']:.2f}x)"


def _minimal(scratch: Path) -> tuple[list[float], list[float], float]:
    log = scratch / "minimal.log"
    with running([sys.executable, "-m", "bench.minimal_ros", str(DOMAIN)], log) as child:
        wait_for_log(log, "ready")
        graph = Graph()
        relay = [_to_relay(graph, child) for _ in range(WARM_UP + ROUNDS)]
        state = [_to_state(graph, child) for _ in range(WARM_UP + ROUNDS)]
        graph.transport.close()
        return relay[WARM_UP:], state[WARM_UP:], memory_mb(child.pid)


def _to_relay(graph: Graph, child: "subprocess.Popen[bytes]") -> float:
    sent_at = graph.send("bench", LiftRequestType.REQUEST_AGV_MODE, "L1")
    took = _edge(child, "relay 1") - sent_at
    graph.send("bench", LiftRequestType.REQUEST_END_SESSION, "")
    _edge(child, "relay 0")
    time.sleep(PAUSE_S)
    return took


def _to_state(graph: Graph, child: "subprocess.Popen[bytes]") -> float:
    edge_at = _press(child, "on", "input 1")
    arrived = graph.state(edge_at, lambda s: s.current_mode == LiftMode.MODE_EMERGENCY)
    over_at = _press(child, "off", "input 0")
    graph.state(over_at, lambda s: s.current_mode != LiftMode.MODE_EMERGENCY)
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
