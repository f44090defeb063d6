"""The node that tells a daemon's alarm to the fleets, on the memory transport. The tests cover full
disks, late fleet adapters and RMF's releases."""

import pytest

from bridges.kinds.shared.decision import AlarmInputs, OperatorReset
from bridges.kinds.shared.fleet_alarm import RENEW_S
from bridges.kinds.shared.fleet_alarm_memory import (
    FleetAlarmLimits,
)
from bridges.messages import definitions as d
from bridges.messages.releases import NEWEST, RELEASES, Release
from bridges.messages.topics import DIAGNOSTICS, EMERGENCY_SIGNAL, FIRE_ALARM_TRIGGER, AnyTopic
from bridges.runtime.clock import Clock
from bridges.runtime.diagnostics import diagnosis
from bridges.runtime.fleet_alarm import MOST_UNNAMED, FleetAlarmNode
from bridges.runtime.outlet import Named
from tests.runtime.virtual_graph import Disk
from tests.transports.memory import MemoryNetwork, MemoryTransport

WALL = 1_800_000_000.0
FIRE, CLEAR = AlarmInputs(frozenset({"fire"}), True), AlarmInputs(seen=True)


def same(topic: AnyTopic) -> AnyTopic:
    return topic


class Site:
    """The alarms of several daemons on one graph, in virtual time. `heard` has the values that a fleet
    adapter hears."""

    def __init__(self, topic: AnyTopic = FIRE_ALARM_TRIGGER, release: Release = NEWEST) -> None:
        self.now = 0.0
        self.network = MemoryNetwork()
        self.topic, self.release = topic, release
        self.nodes: dict[str, FleetAlarmNode] = {}
        self.transports: dict[str, MemoryTransport] = {}
        self.disks: dict[str, Disk] = {}
        self.heard: list[d.Message] = []
        self.adapter = MemoryTransport(self.network, "adapter", release)
        self.adapter.subscribe(FIRE_ALARM_TRIGGER, self.heard.append)

    def start(self, name: str, fleets: tuple[str, ...] = (), *, tells_nobody: bool = False) -> None:
        transport = self.transports[name] = MemoryTransport(self.network, name, self.release)
        limits = FleetAlarmLimits(self.topic, frozenset(fleets), frozenset({"Panel"}))
        clock = Clock(lambda: self.now, lambda: WALL + self.now)
        disk = self.disks.setdefault(name, Disk())
        named: Named = same
        node = FleetAlarmNode(limits, transport, clock, named, disk, tells_nobody=tells_nobody)
        self.nodes[name] = node
        node.subscribe()
        node.round()

    def kill(self, name: str) -> None:
        self.transports[name].close()
        del self.nodes[name]

    def tells(self, name: str, inputs: AlarmInputs) -> None:
        self.nodes[name].tell("Panel", inputs)
        self.rounds()

    def resets(self, name: str) -> None:
        self.nodes[name].obey(OperatorReset())
        self.rounds()

    def rounds(self) -> None:
        for node in self.nodes.values():
            node.round()

    def until(self, at: float) -> None:
        """Let time pass in steps of 0.25 s. Each second every node runs `look`, and publishes its
        diagnostics."""
        while self.now < at:
            self.now += 0.25
            if self.now % 1 == 0:
                for name, node in self.nodes.items():
                    node.look()
                    status = node.beside({"faults": [], "heard_by": {}, "hears": {}})
                    told = diagnosis(name, "alarm", status, {}, d.Time())
                    self.transports[name].publisher(DIAGNOSTICS).publish(told)
            self.rounds()

    def late(self) -> list[bool]:
        """Start a late fleet adapter, and return the values that it hears."""
        found: list[d.Bool] = []
        late = MemoryTransport(self.network, "late", self.release)
        late.subscribe(FIRE_ALARM_TRIGGER, found.append)
        late.close()
        return [message.data for message in found]

    def state(self, name: str) -> str:
        status = self.nodes[name].beside({"faults": [], "heard_by": {}, "hears": {}})
        return " ".join([status["alarm"]["state"], *(fault["code"] for fault in status["faults"])])


def test_a_fire_in_the_quiet_start_is_published_at_once() -> None:
    site = Site()
    site.start("a")
    site.tells("a", FIRE)
    assert site.heard == [d.Bool(True)]
    assert site.late() == [True]


def test_an_alarm_that_comes_and_goes_while_the_node_is_busy_latches() -> None:
    """The node waits for a slow disk. A key switch may be on for only a second."""
    site = Site()
    site.start("a")
    for inputs in (FIRE, CLEAR):
        site.nodes["a"].tell("Panel", inputs)
    site.rounds()
    assert site.heard == [d.Bool(True)]
    site.until(20.0)
    assert site.state("a").startswith("alarm")


def test_two_daemons_are_one_alarm_that_outlives_both_of_them() -> None:
    site = Site()
    site.start("a")
    site.start("b")
    site.until(4.0)
    site.tells("a", FIRE)
    site.tells("b", FIRE)
    site.until(6.0)
    site.tells("a", CLEAR)
    site.resets("a")
    site.until(8.0)
    assert site.state("a") == "reset ALARM_WAITS"
    site.kill("a")
    site.kill("b")
    assert site.late() == []
    site.until(60.0)
    site.start("a")
    site.until(70.0)
    assert site.state("a") == "reset ALARM_WAITS"
    site.start("b")
    assert site.late() == [True]
    site.tells("b", CLEAR)
    site.until(75.0)
    site.resets("b")
    site.until(78.0)
    assert site.heard == [d.Bool(True)] * 3 + [d.Bool(False)] * 2
    site.until(78.0 + RENEW_S)
    assert site.late() == []
    assert [site.state(name) for name in ("a", "b")] == ["quiet", "quiet"]


def test_an_alarm_goes_out_although_the_disk_is_full_and_a_fault_says_so() -> None:
    site = Site()
    site.start("a")
    site.disks["a"].full = True
    site.tells("a", FIRE)
    assert site.heard == [d.Bool(True)]
    assert site.state("a") == "alarm ALARM_RAISED NOT_KEPT"


def test_a_damaged_disk_does_not_keep_a_daemon_from_alarming() -> None:
    site = Site()
    site.disks["a"] = Disk()
    site.disks["a"].kept = b"\x00"
    site.start("a")
    site.tells("a", FIRE)
    assert site.heard == [d.Bool(True)]


def test_the_ghost_of_an_earlier_process_of_this_daemon_is_no_other_alarm() -> None:
    site = Site()
    site.start("a")
    ghost = MemoryTransport(site.network, "a", NEWEST)
    ghost.publisher(FIRE_ALARM_TRIGGER).publish(d.Bool(True))
    site.tells("a", FIRE)
    site.until(4.0)
    site.tells("a", CLEAR)
    site.resets("a")
    assert site.state("a") == "quiet"


def test_an_unnamed_sender_is_named_when_discovery_knows_it() -> None:
    site = Site()
    site.start("a")
    site.until(4.0)
    desk = MemoryTransport(site.network, "desk", NEWEST)
    publisher = desk.publisher(FIRE_ALARM_TRIGGER)
    publisher.sender.node = ""
    publisher.publish(d.Bool(True))
    site.tells("a", FIRE)
    site.tells("a", CLEAR)
    site.resets("a")
    [fault] = site.nodes["a"].status()["faults"]
    assert "unknown node 1" in fault["detail"]
    publisher.sender.node = "/desk"
    site.until(6.0)
    [fault] = site.nodes["a"].status()["faults"]
    assert fault["detail"] == "reset here, but the alarm of desk is not over"


def test_the_unnamed_senders_of_alarms_are_limited() -> None:
    site = Site()
    site.start("a")
    for number in range(MOST_UNNAMED + 5):
        publisher = MemoryTransport(site.network, f"desk{number}", NEWEST).publisher(
            FIRE_ALARM_TRIGGER
        )
        publisher.sender.node = ""
        publisher.publish(d.Bool(False))
    assert len(site.nodes["a"]._unnamed) == MOST_UNNAMED


@pytest.mark.parametrize(("nobody", "heard"), [(False, [d.Bool(True)]), (True, [])])
def test_fleets_that_the_release_cannot_name_are_all_told_or_none(
    nobody: bool, heard: list[d.Message]
) -> None:
    site = Site(EMERGENCY_SIGNAL, RELEASES["jazzy"])
    site.start("a", ("x",), tells_nobody=nobody)
    site.until(4.0)
    site.tells("a", FIRE)
    assert site.heard == heard
    untold = " ALARM_NOT_TOLD" if nobody else ""
    assert site.state("a") == f"alarm ALARM_RAISED{untold}"


def test_named_fleets_are_told_on_their_topic() -> None:
    site = Site(EMERGENCY_SIGNAL)
    heard: list[d.Message] = []
    site.adapter.subscribe(EMERGENCY_SIGNAL, heard.append)
    site.start("a", ("y", "x"))
    site.until(4.0)
    site.tells("a", FIRE)
    site.tells("a", CLEAR)
    site.resets("a")
    told = [d.EmergencySignal(("x", "y"), on) for on in (True, False)]
    assert (heard, site.heard) == (told, [])


def test_a_second_daemon_with_our_node_name_is_a_fault_as_long_as_it_is_there() -> None:
    """Neither daemon hears the other one's alarm, because each takes it for its own earlier one."""
    site = Site()
    site.start("a")
    one = site.nodes.pop("a")
    ours = site.transports.pop("a")
    site.start("a")
    site.until(4.0)
    twin, site.nodes["a"] = site.nodes["a"], one
    assert site.state("a") == "quiet TWO_NODES_OF_ONE_NAME"
    site.nodes["a"] = twin
    site.kill("a")
    site.nodes["a"], site.transports["a"] = one, ours
    site.until(8.0)
    assert site.state("a") == "quiet"
