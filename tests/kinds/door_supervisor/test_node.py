"""The door supervisor's node as in its daemon, on the memory transport, in virtual time."""

from typing import Any

import pytest

from bridges.kinds.door_supervisor import KIND
from bridges.kinds.door_supervisor.settings import DoorSupervisorSettings
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import stamp
from bridges.runtime import graph_node as graph_node
from bridges.runtime.clock import Clock
from bridges.runtime.graph_node import GraphNode
from tests.runtime.virtual_graph import Disk
from tests.transports.memory import MemoryNetwork, MemoryTransport

OPEN, CLOSE = d.DoorModeValue.MODE_OPEN, d.DoorModeValue.MODE_CLOSED
HEARTBEAT = topics.DOOR_SUPERVISOR_HEARTBEAT


class Graph:
    """A network with the door supervisor's node. `heard` has (s, words) for each message of the
    node."""

    def __init__(self) -> None:
        self.now = 0.0
        self.network = MemoryNetwork()
        self.disk = Disk()
        self.heard: list[tuple[float, str]] = []
        self.rmf = MemoryTransport(self.network, "rmf")
        self.rmf.subscribe(topics.DOOR_REQUESTS, self._request)
        self.rmf.subscribe(HEARTBEAT, self._heartbeat)
        self.adapter = self.rmf.publisher(topics.ADAPTER_DOOR_REQUESTS)
        self.states = self.rmf.publisher(topics.DOOR_STATES)
        self.starts()

    def starts(self) -> None:
        self.transport = MemoryTransport(self.network, "ours")
        clock = Clock(lambda: self.now, lambda: 1e6 + self.now)
        self.node = GraphNode(KIND, DoorSupervisorSettings(), self.transport, clock, kept=self.disk)
        self.node.subscribe()

    def asks(self, who: str, mode: int, door: str = "ward") -> None:
        at = stamp(1e6 + self.now)
        self.adapter.publish(d.DoorRequest(at, who, door, d.DoorMode(mode)))
        self.node.round()

    def shows(self, mode: int) -> None:
        self.states.publish(d.DoorState(d.Time(), "ward", d.DoorMode(mode)))
        self.node.round()

    def until(self, at: float) -> None:
        while self.node.wake_at <= at:
            self.now = max(self.now, self.node.wake_at)
            self.node.round()
        self.now = at

    def _request(self, request: Any) -> None:
        word = d.DoorModeValue(request.requested_mode.value).name[5:]
        self.heard.append((round(self.now, 3), f"{word} {request.door_name}"))

    def _heartbeat(self, beat: Any) -> None:
        doors = [
            f"{s.door_name}:{','.join(h.requester_id for h in s.sessions)}"
            for s in beat.all_sessions
        ]
        self.heard.append((round(self.now, 3), f"beat {' '.join(doors)}".strip()))


def test_the_node_listens_in_its_quiet_start_and_then_sends_a_heartbeat_each_second() -> None:
    graph = Graph()
    graph.until(1.0)
    graph.asks("a", 2)
    graph.until(5.2)
    graph.asks("b", 2, "lab")
    graph.until(6.5)
    assert graph.heard == [
        (3.0, "OPEN ward"),
        (3.0, "beat ward:a"),
        (4.0, "beat ward:a"),
        (5.0, "beat ward:a"),
        (5.2, "OPEN lab"),
        (5.2, "beat lab:b ward:a"),
        (6.2, "beat lab:b ward:a"),
    ]


def test_a_restart_closes_nothing_and_the_next_heartbeat_lists_the_holders() -> None:
    graph = Graph()
    graph.until(4.0)
    graph.asks("a", 2)
    graph.until(20.0)
    graph.transport.close()
    graph.heard.clear()
    graph.starts()
    for quarter in range(80, 100):
        graph.until(quarter / 4)
        graph.shows(2)
    assert graph.heard == [
        *[(at, "OPEN ward") for at in (20.0, 21.0, 22.0)],
        (23.0, "OPEN ward"),
        (23.0, "beat ward:a"),
        (24.0, "OPEN ward"),
        (24.0, "beat ward:a"),
    ]


def test_a_table_that_cannot_be_written_is_still_published_and_damaged_entries_are_left_out() -> (
    None
):
    graph = Graph()
    graph.until(4.0)
    graph.disk.full = True
    graph.asks("a", 2)
    assert graph.heard[-1] == (4.1, "beat ward:a") or graph.heard[-1][1] == "OPEN ward"
    graph.until(4.2)
    assert graph.heard[-1] == (4.1, "beat ward:a")
    graph.disk.kept = b"\x00"
    graph.transport.close()
    graph.starts()
    assert graph.node.subjects == {}


def test_a_table_that_cannot_be_saved_is_a_fault_and_is_tried_again(
    caplog: pytest.LogCaptureFixture,
) -> None:
    graph = Graph()
    graph.until(4.0)
    graph.disk.full = True
    graph.asks("a", 2)
    before = graph.disk.kept
    graph.until(10.0)
    assert (graph.disk.kept, graph.heard[-1]) == (before, (9.1, "beat ward:a"))
    [fault] = graph.node.status()["faults"]
    assert fault["code"] == "NOT_KEPT"
    graph.disk.full = False
    graph.until(11.0)
    assert b'"a"' in (graph.disk.kept or b"")
    assert graph.node.status()["faults"] == []
    lines = [r.getMessage() for r in caplog.records if "NOT_KEPT" in r.getMessage()]
    assert len(lines) == 1


def test_nothing_is_published_before_it_is_on_disk() -> None:
    graph = Graph()
    graph.until(4.0)
    said: list[str] = []
    write = graph.disk.write

    def tells(kept: bytes) -> None:
        said.extend(word for _, word in graph.heard if "lab" in word)
        write(kept)

    graph.disk.write = tells  # type: ignore[method-assign]
    graph.asks("b", 2, "lab")
    assert said == []
    assert graph.heard[-1] == (4.0, "OPEN lab")
    graph.until(4.2)
    assert graph.heard[-1] == (4.1, "beat lab:b")


def test_holders_of_invented_doors_share_one_bound(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(graph_node, "MAX_REQUESTERS", 3)
    graph = Graph()
    graph.until(3.0)
    for door in range(3):
        for who in ("a", "b"):
            graph.asks(who, OPEN, f"made up {door}")
    assert graph.node.refused == {"too many requesters": 3}
    graph.until(1000.0)
    graph.asks("r1", OPEN)
    assert graph.node.refused == {"too many requesters": 4}
    graph.asks("a", CLOSE, "made up 0")
    graph.until(1100.0)
    graph.asks("b", CLOSE, "made up 0")
    graph.until(1200.0)
    graph.asks("r1", OPEN)
    assert graph.node.refused == {"too many requesters": 4}
    assert sorted(graph.node.subjects) == ["made up 1", "ward"]
