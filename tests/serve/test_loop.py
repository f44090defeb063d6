"""A bus and its devices in rounds, in virtual time: who is scanned when, and what the end does."""

from collections.abc import Callable

from bridges.door import KIND
from bridges.door.memory import DoorLimits
from bridges.door.settings import DoorSettings
from bridges.door.signals import DoorOutputs, DoorSample
from bridges.rmf import topics
from bridges.rmf.definitions import DoorMode, DoorModeValue, DoorRequest
from bridges.serve.clock import Clock
from bridges.serve.device import Node
from bridges.serve.loop import Loop
from drivers import DriverError
from drivers.hal import Bus

SCAN_S = 0.25


class Door:
    """One door's driver; `during` is called in the middle of each reading. It can be `lost`."""

    def __init__(self, name: str, log: Callable[[str], None]) -> None:
        self.during: Callable[[], None] = lambda: None
        self.lost = False
        self._name = name
        self._log = log

    def open(self) -> None:
        self._log(f"{self._name} claimed")

    def read(self) -> DoorSample:
        self._log(f"{self._name} read")
        self.during()
        return DoorSample(opened=False, closed=True)

    def write(self, outputs: DoorOutputs) -> None:
        if outputs.hold_open:
            self._log(f"{self._name} held")

    def make_safe(self) -> None:
        if self.lost:
            raise DriverError("no answer")
        self._log(f"{self._name} off")

    def close(self) -> None:
        self._log(f"{self._name} closed")


class Wires(Bus):
    """A bus that tells of edges."""

    def __init__(self, log: Callable[[str], None]) -> None:
        self._log = log
        self.edge: Callable[[], None] = lambda: None

    def on_edge(self, wake: Callable[[], None]) -> None:
        self.edge = wake

    def insist(self) -> None:
        self._log("bus insists")

    def close(self) -> None:
        self._log("bus closed")


class Corridor:
    """Two doors on one bus. `story`: (s, what)."""

    def __init__(self) -> None:
        self.now = 0.0
        self.story: list[tuple[float, str]] = []
        self.bus = Wires(self.tell)
        self.doors = {name: Door(name, self.tell) for name in ("ward", "lab")}
        clock = Clock(lambda: self.now, lambda: 1e6 + self.now)
        settings = DoorSettings()
        limits = DoorLimits.of(settings, {})
        nodes = [
            Node(name, KIND, settings, limits, door, lambda topic, message: None, clock)
            for name, door in self.doors.items()
        ]
        self.loop = Loop("module", self.bus, nodes, SCAN_S, clock)

    def tell(self, what: str) -> None:
        self.story.append((self.now, what))

    def round(self, at: float) -> list[str]:
        """A round at this time; what happened in it."""
        self.now = at
        before = len(self.story)
        self.loop.round()
        return [what for _, what in self.story[before:]]

    def asks(self, door: str) -> None:
        """RMF wants it open."""
        request = DoorRequest(
            requester_id="a",
            door_name=door,
            requested_mode=DoorMode(int(DoorModeValue.MODE_OPEN)),
        )
        node = next(node for node in self.loop.nodes if node.name == door)
        self.loop.inbox.put(door, node.event(topics.DOOR_REQUESTS, request))


def test_each_device_is_scanned_once_a_period() -> None:
    corridor = Corridor()
    assert not corridor.loop.ready
    assert corridor.round(0.0) == ["ward claimed", "ward read", "lab claimed", "lab read"]
    assert (corridor.loop.ready, corridor.loop.wake_at) == (True, SCAN_S)
    assert corridor.round(0.1) == []
    assert corridor.round(SCAN_S) == ["ward read", "lab read"]


def test_a_request_scans_its_device_and_no_other() -> None:
    corridor = Corridor()
    corridor.round(0.0)
    corridor.asks("lab")
    assert corridor.round(0.1) == ["lab read", "lab held"]


def test_an_edge_scans_every_device_once() -> None:
    corridor = Corridor()
    corridor.round(0.0)
    corridor.bus.edge()
    assert corridor.round(0.1) == ["ward read", "lab read"]
    assert corridor.round(0.11) == []


def test_an_edge_during_a_round_is_seen_in_the_next_one() -> None:
    corridor = Corridor()
    corridor.doors["lab"].during = corridor.bus.edge
    corridor.round(0.0)
    corridor.doors["lab"].during = lambda: None
    assert corridor.loop.inbox.wait(0.0), "the bell rings"
    assert corridor.round(0.01) == ["ward read", "lab read"]


def test_a_round_ends_after_the_device_under_way_when_the_loop_is_told_to_end() -> None:
    corridor = Corridor()
    corridor.doors["ward"].during = corridor.loop.inbox.close
    assert corridor.round(0.0) == ["ward claimed", "ward read"]


def test_at_the_end_every_output_is_switched_off_before_anything_is_let_go() -> None:
    corridor = Corridor()
    assert corridor.loop.end()
    off = ["bus insists", "ward off", "lab off", "ward closed", "lab closed", "bus closed"]
    assert [what for _, what in corridor.story] == off


def test_one_device_that_cannot_be_switched_off_keeps_no_other_on_and_is_told() -> None:
    corridor = Corridor()
    corridor.doors["ward"].lost = True
    assert not corridor.loop.end()
    assert (0.0, "lab off") in corridor.story
