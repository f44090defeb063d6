"""The service of a supervisor, a kind of daemon without hardware. The tests run its node, which feeds
messages to the decision code."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from msgspec.structs import replace

from bridges.kinds.lift_supervisor import KIND
from bridges.kinds.lift_supervisor.settings import LiftSupervisorSettings
from bridges.messages.definitions import LiftRequest, LiftState, Time
from bridges.messages.stamps import stamp
from bridges.messages.topics import ADAPTER_LIFT_REQUESTS, LIFT_REQUESTS, LIFT_STATES, Topic
from bridges.runtime import graph_node as graph_node
from bridges.runtime.clock import Clock
from bridges.runtime.graph_node import GraphNode
from bridges.runtime.presence import SPREAD_MOST_S
from bridges.runtime.serving import Serving, stop
from bridges.transports.transport import Transport
from hal_fakes import wire
from tests.transports.domains import domain_of_this_run
from tests.transports.memory import MemoryNetwork, MemoryTransport
from tests.waiting import wait_until

WALL = 1_800_000_000.0


class Site:
    """Our node on a memory network. The test plays a fleet adapter and a lift's node."""

    def __init__(self, settings: LiftSupervisorSettings | None = None, **more: Any) -> None:
        self.now = 0.0
        self.network = MemoryNetwork()
        self.transport = MemoryTransport(self.network, "supervisor")
        clock = Clock(lambda: self.now, lambda: WALL + self.now)
        self.node = GraphNode(
            KIND, settings or LiftSupervisorSettings(), self.transport, clock, **more
        )
        self.node.subscribe()
        self.others = MemoryTransport(self.network, "others")
        self.adapter = self.others.publisher(ADAPTER_LIFT_REQUESTS)
        self.lift = self.others.publisher(LIFT_STATES)
        self.sent: list[LiftRequest] = []
        self.others.subscribe(LIFT_REQUESTS, self.sent.append)
        self.node.round()

    def until(self, at: float) -> None:
        """Run all rounds that the service's thread would run until this time (s)."""
        while self.node.wake_at <= at:
            self.now = max(self.now, self.node.wake_at)
            self.node.round()
        self.now = at

    def asks(self, session: str = "fleet/a", lift: str = "Lift1") -> LiftRequest:
        """Publish a request as a fleet adapter, and return the request."""
        request = LiftRequest(lift, stamp(WALL + self.now), session, 1, "L3", 2)
        self.adapter.publish(request)
        self.node.round()
        return request

    def ends(self, session: str = "fleet/a", lift: str = "Lift1") -> None:
        """Publish END of a session as a fleet adapter."""
        self.adapter.publish(LiftRequest(lift, stamp(WALL + self.now), session, 0, "L3", 2))
        self.node.round()


def test_after_its_quiet_start_what_an_adapter_asks_is_passed_on_with_our_stamp() -> None:
    site = Site()
    site.until(2.99)
    asked = site.asks()
    assert site.sent == []
    site.until(3.0)
    assert site.sent == [replace(asked, request_time=stamp(WALL + 3.0))]


def test_before_its_quiet_start_is_over_it_has_no_publisher() -> None:
    site = Site()
    ear = site.others.subscribe(LIFT_REQUESTS, lambda request: None)
    site.until(2.99)
    assert ear.matched() == 0
    site.until(3.0)
    assert ear.matched() == 1


def test_while_another_publishes_it_is_passive_and_says_so_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level("INFO")
    site = Site()
    site.until(4.0)
    rival = MemoryTransport(site.network, "rival")
    rival.publisher(LIFT_REQUESTS)
    site.until(4.5)
    site.asks()
    assert site.node.devices()["Lift1"]["waits"] == "while /rival publishes lift_requests"
    site.until(60.0)
    status = site.node.status()
    detail = "/rival publishes lift_requests, so this node only listens"
    assert (site.sent, status["passive"]) == ([], True)
    assert status["faults"] == [{"code": "PASSIVE", "detail": detail}]
    rival.close()
    site.until(60.25)
    site.asks()
    site.until(63.0)
    assert site.sent == []
    site.until(60.25 + 3.0 + SPREAD_MOST_S + 0.3)
    assert [request.session_id for request in site.sent] == ["fleet/a"]
    ours = [r.getMessage() for r in caplog.records if r.name.startswith("bridges.runtime.")]
    assert [text for text in ours if not text.startswith("state")] == [
        "active kind=lift_supervisor",
        'passive kind=lift_supervisor reason="/rival publishes lift_requests"',
        "other_node_gone kind=lift_supervisor",
        "active kind=lift_supervisor",
    ]


def test_lifts_are_served_separately_and_those_not_named_not_at_all() -> None:
    site = Site(LiftSupervisorSettings(lifts=["Lift1", "Lift2"]))
    site.until(3.0)
    for lift in ("Lift1", "Lift2", "Lift3"):
        site.asks(lift=lift)
    assert [request.lift_name for request in site.sent] == ["Lift1", "Lift2"]
    assert site.node.refused == {"not ours": 1}


def test_a_topic_may_have_another_name_on_site() -> None:
    def named(topic: Topic[Any]) -> Topic[Any]:
        return topic.named(f"site_{topic.name}")

    site = Site(named=named)
    site.until(3.0)
    heard: list[LiftRequest] = []
    site.others.subscribe(named(LIFT_REQUESTS), heard.append)
    adapter = site.others.publisher(named(ADAPTER_LIFT_REQUESTS))
    adapter.publish(LiftRequest("Lift1", stamp(WALL + 3.0), "fleet/a", 1, "L3", 2))
    site.node.round()
    assert [request.session_id for request in heard] == ["fleet/a"]


def test_refusals_are_counted_by_name_and_logged_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    site = Site()
    site.until(3.0)
    for _ in range(3):
        site.asks(session="")
    site.adapter.publish(replace(site.asks(), request_time=Time(1, 0)))
    site.node.round()
    assert site.node.refused == {"empty session_id": 3, "stale request": 1}
    refused = [r.getMessage() for r in caplog.records if r.getMessage().startswith("refused")]
    assert len(refused) == 2


def test_made_up_names_do_not_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(graph_node, "MAX_UNSHOWN", 3)
    site = Site()
    site.until(3.0)
    for number in range(5):
        site.asks(lift=f"lift {number}")
    assert (len(site.node.subjects), site.node.refused) == (3, {"too many names": 2})
    site.until(63.0)
    assert site.node.subjects == {}


def test_a_lift_that_shows_itself_finds_room_in_a_flood_of_names(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(graph_node, "MAX_UNSHOWN", 3)
    monkeypatch.setattr(graph_node, "MAX_SUBJECTS", 5)
    site = Site()
    site.until(3.0)
    for number in range(5):
        site.asks(lift=f"made up {number}")
    for number in range(6):
        site.lift.publish(LiftState(lift_name=f"lift {number}", current_floor="L1"))
    site.node.round()
    site.asks(lift="lift 4")
    assert site.sent[-1].lift_name == "lift 4"
    assert (len(site.node.subjects), site.node.refused) == (8, {"too many names": 3})


def test_the_lifts_of_the_yaml_are_never_turned_away(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(graph_node, "MAX_UNSHOWN", 0)
    monkeypatch.setattr(graph_node, "MAX_SUBJECTS", 0)
    site = Site(LiftSupervisorSettings(lifts=["Lift1", "Lift2"]))
    site.until(3.0)
    for lift in ("Lift1", "Lift2", "Lift3"):
        site.asks(lift=lift)
    assert [request.lift_name for request in site.sent] == ["Lift1", "Lift2"]
    assert site.node.refused == {"not ours": 1}


def test_made_up_sessions_at_made_up_lifts_have_one_bound_and_known_ones_are_still_heard(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(graph_node, "MAX_REQUESTERS", 6)
    site = Site()
    site.until(3.0)
    site.asks()
    for lift in range(4):
        for session in range(2):
            site.asks(session=f"made up {session}", lift=f"made up {lift}")
    assert site.node.refused == {"too many requesters": 3}
    known = {name: set(node.memory.requesters) for name, node in site.node.subjects.items()}
    assert sum(map(len, known.values())) == 6
    site.until(8.0)
    site.asks()
    assert site.node.refused == {"too many requesters": 3}


def test_requesters_that_are_forgotten_leave_their_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(graph_node, "MAX_REQUESTERS", 2)
    site = Site()
    site.until(3.0)
    for lift in ("made up", "made up, too"):
        site.ends(lift=lift)
    site.asks()
    assert site.node.refused == {"too many requesters": 1}
    site.until(64.0)
    site.asks()
    assert site.node.refused == {"too many requesters": 1}
    assert list(site.node.subjects) == ["Lift1"]


def test_the_lifts_of_the_yaml_keep_room_for_sessions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(graph_node, "MAX_REQUESTERS", 0)
    site = Site(LiftSupervisorSettings(lifts=["Lift1"]))
    site.until(3.0)
    site.asks()
    assert (len(site.sent), site.node.refused) == (1, {})


def test_of_a_lift_long_gone_a_waiting_robot_is_forgotten_and_its_holder_never() -> None:
    site = Site()
    site.until(3.0)
    for lift, session in (("Lift1", "fleet/a"), ("Lift2", "")):
        site.lift.publish(LiftState(lift_name=lift, session_id=session))
        site.node.round()
        site.asks(session="fleet/a", lift=lift)
        site.asks(session="fleet/b", lift=lift)
    site.until(602.0)
    assert list(site.node.subjects) == ["Lift1", "Lift2"]
    site.until(604.0)
    site.asks(session="", lift="")
    assert list(site.node.subjects) == ["Lift1"]


def test_a_flood_of_states_asks_each_lift_once_a_second_whether_it_may_be_forgotten() -> None:
    site, looks = Site(), 0

    def idle(memory: Any, now: float) -> bool:
        nonlocal looks
        looks += 1
        return KIND.idle(memory, now)

    site.node._kind = replace(KIND, idle=idle)
    site.until(3.0)
    for lift in ("Lift1", "Lift2"):
        site.lift.publish(LiftState(lift_name=lift))
        site.node.round()
    site.until(5.0)
    looks = 0
    for _ in range(150):
        site.now += 0.01
        site.lift.publish(LiftState(lift_name="Lift1"))
        site.node.round()
    assert looks == 2  # one second has ended


def test_a_defect_in_a_core_costs_one_message_and_is_logged_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    def breaks(*arguments: object) -> Any:
        raise ZeroDivisionError("defect")

    site = Site()
    site.until(3.0)
    site.node._kind = replace(KIND, requests={**KIND.requests, LIFT_STATES: breaks})
    for _ in range(3):
        site.lift.publish(LiftState(lift_name="Lift1"))
        site.node.round()
    site.asks()
    assert [request.session_id for request in site.sent] == ["fleet/a"]
    assert site.node.refused == {"a defect": 3}
    assert [r.getMessage() for r in caplog.records if r.exc_info] == [
        "defect kind=lift_supervisor about=lift_states reason=defect"
    ]


def test_the_status_says_who_holds_each_lift_who_waits_and_what_is_wrong() -> None:
    site = Site()
    site.until(3.0)
    site.asks("fleet/a")
    site.asks("fleet/b")
    site.lift.publish(LiftState(lift_name="Lift1", current_floor="L1", session_id="fleet/a"))
    site.node.round()
    site.until(8.0)
    assert site.node.status() == {
        "passive": False,
        "other_publishers": 0,
        "refused": {},
        "faults": [],
        "heard_by": {"lift_requests": 1},
        "hears": {"adapter_lift_requests": 1, "lift_states": 1},
    }
    assert site.node.devices() == {
        "Lift1": {
            "session": "fleet/a",
            "holder": "fleet/a (5 s)",
            "waiting": "fleet/b (5 s)",
            "waits": "for the lift's states",
            "faults": [{"code": "LIFT_SILENT", "detail": "no LiftState comes"}],
            "input_age_s": 5.0,
        }
    }


def test_faults_are_logged_when_they_come_and_when_they_go(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level("INFO")
    site = Site()
    site.until(3.0)
    site.asks()
    state = LiftState(lift_name="Lift1", session_id="fleet/a")
    site.lift.publish(state)
    site.node.round()
    site.until(9.0)
    site.asks("fleet/b")
    site.until(10.0)
    site.lift.publish(state)
    site.node.round()
    lines = [r.getMessage() for r in caplog.records if "Lift1" in r.getMessage()]
    assert lines == [
        "state subject=Lift1 session=- holder=- waiting=-",
        'state subject=Lift1 session=- holder="fleet/a (0 s)" waiting=-'
        ' waits="for the lift to take fleet/a"',
        'state subject=Lift1 session=fleet/a holder="fleet/a (0 s)" waiting=-',
        'fault subject=Lift1 code=LIFT_SILENT detail="no LiftState comes"',
        'state subject=Lift1 session=fleet/a holder="fleet/a (6 s)" waiting="fleet/b (0 s)"'
        ' waits="for the lift\'s states"',
        'fault_over subject=Lift1 code=LIFT_SILENT detail="no LiftState comes"',
    ]


def test_a_lost_transport_is_logged_and_does_not_end_the_daemon(
    caplog: pytest.LogCaptureFixture,
) -> None:
    site = Site()
    site.until(3.0)
    site.adapter.publish(LiftRequest("Lift1", stamp(WALL + 3.0), "fleet/a", 1, "L3", 2))
    site.transport.close()
    site.node.round()
    site.until(12.0)
    lines = [r.getMessage() for r in caplog.records if "not_published" in r.getMessage()]
    assert [line[:33] for line in lines] == ["not_published topic=lift_requests"]
    assert [fault["code"] for fault in site.node.status()["faults"]] == ["NOT_PUBLISHED"]
    site.until(4.0)
    assert caplog.text.count("not_published topic=lift_requests") == 1
    assert site.node.devices()["Lift1"]["holder"] == "fleet/a (1 s)"


# --- the node in its own thread, on the memory transport and on a real wire ----------------------


@pytest.fixture(params=["memory", "wire"])
def join(request: pytest.FixtureRequest) -> Iterator[Callable[[str], Transport]]:
    network, nodes = MemoryNetwork(), list[Transport]()

    def join(name: str) -> Transport:
        if request.param == "memory":
            nodes.append(MemoryTransport(network, name))
        else:
            nodes.append(wire.join(name, domain_of_this_run()))
        return nodes[-1]

    yield join
    for node in nodes:
        node.close()


def test_a_served_graph_kind_runs_in_its_thread_until_it_is_stopped(
    join: Callable[[str], Transport],
) -> None:
    """The passive node publishes nothing while its rival is there. After the rival has gone, the other
    nodes see only this node's publisher."""
    others, ours, rival = join("others"), join("supervisor"), join("rival")
    rival.publisher(LIFT_REQUESTS)
    heard: list[LiftRequest] = []
    ear = others.subscribe(LIFT_REQUESTS, heard.append)
    adapter = others.publisher(ADAPTER_LIFT_REQUESTS)
    wait_until(lambda: ear.matched() == 1, "the rival is there")
    kind = replace(KIND, quiet_s=lambda settings: 0.5)
    clock = Clock(time.monotonic, time.time)
    node = GraphNode(kind, LiftSupervisorSettings(), ours, clock)
    thread, presence = Serving(node, clock), node.presence
    node.subscribe()
    assert not thread.ready
    thread.start()
    wait_until(lambda: thread.ready and presence.rivals == 1, "the rival is seen")
    rival.close()
    wait_until(lambda: presence.may_speak, "the node may publish")
    wait_until(
        lambda: ear.matched() == 1 and presence.rivals == 0, "the node is no rival of itself"
    )
    request = LiftRequest("Lift1", stamp(time.time()), "fleet/a", 1, "L3", 2)
    adapter.publish(request)
    wait_until(lambda: heard, "the request is passed on")
    assert replace(heard[0], request_time=request.request_time) == request
    assert thread.alive
    assert stop([thread], 5.0)
    assert not thread.alive
