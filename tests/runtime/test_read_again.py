"""Readings that repeat the last reading. On such a reading the daemon skips the core (its decision
code). It must behave as if the core had decided."""

from collections.abc import Sequence
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from bridges.kinds import door, lift
from bridges.kinds.door.memory import DoorLimits
from bridges.kinds.door.settings import DoorDurations, DoorSettings, Pulse
from bridges.kinds.door.signals import CloseRequested, DoorOutputs, DoorSample, OpenRequested
from bridges.kinds.lift.signals import LiftSample
from bridges.kinds.shared.decision import Attended, OperatorReset, RivalSeen, Sampled
from bridges.kinds.shared.kind import AnyDeviceKind
from bridges.runtime.clock import Clock
from bridges.runtime.device import Node
from bridges.runtime.ring_writer import NoWriter
from drivers import DriverError
from tests.depth import examples
from tests.kinds.lift.story import STANDING, Building, Controller, Story
from tests.kinds.lift.test_properties import HAPPENINGS, happens

FEW = settings(max_examples=examples(60))
WAITS = st.sampled_from([0.0, 0.05, 0.3, 1.0, 3.0, 12.0])
SCAN_S = 0.05


def counted(kind: AnyDeviceKind, readings: list[object]) -> AnyDeviceKind:
    """Return the kind with a changed core. The new core adds each reading on which it decides to
    `readings`."""

    def decide(memory: Any, event: Any, now: float, limits: Any) -> Any:
        if isinstance(event, Sampled):
            readings.append(event)
        return kind.decide(memory, event, now, limits)

    return replace(kind, decide=decide)


def deciding_always(kind: AnyDeviceKind) -> AnyDeviceKind:
    return replace(kind, repeated=None)


@FEW
@given(st.lists(st.tuples(WAITS, HAPPENINGS), max_size=30), st.sampled_from([Building, Controller]))
def test_a_lift_behaves_as_if_its_core_decided_on_every_reading(
    happenings: Sequence[tuple[float, Any]], building: type[Building]
) -> None:
    some, every = Story(building()), Story(building(), kind=deciding_always(lift.KIND))
    for wait_s, what in happenings:
        for story in (some, every):
            happens(story, what)
            story.run(story.now + wait_s)
        assert (some.edges, some.told, some.now) == (every.edges, every.told, every.now)
        assert some.node.subject.memory == every.node.subject.memory
        assert told(some.node) == told(every.node)


def told(node: Any) -> dict[str, Any]:
    """Return the node's status without the times of its scans."""
    return {k: v for k, v in node.status().items() if k != "counts"}


class Operator:
    """A door operator whose contacts a test sets (`drivers.Driver[DoorSample, DoorOutputs]`)."""

    def __init__(self) -> None:
        self.sample = DoorSample(opened=False, closed=True)
        self.broken = False
        self.written: list[DoorOutputs] = []

    def open(self) -> None: ...

    def read(self) -> DoorSample:
        if self.broken:
            raise DriverError("timeout")
        return self.sample

    def write(self, outputs: DoorOutputs) -> None:
        self.written.append(outputs)

    def make_safe(self) -> None: ...

    def close(self) -> None: ...


class Entrance:
    """A door's node in virtual time, scanned as the daemon's loop scans it."""

    def __init__(self, kind: AnyDeviceKind, limits: DoorLimits) -> None:
        self.now = 0.0
        self.operator = Operator()
        self.told: list[tuple[float, object]] = []
        clock = Clock(lambda: self.now, lambda: 1e6 + self.now)
        own = DoorSettings(limits=limits.t)
        self.node: Any = Node(
            "d", kind, own, limits, self.operator, self._publish, clock, NoWriter()
        )
        self.node.scan(())

    def _publish(self, topic: object, message: object) -> None:
        self.told.append((self.now, message))

    def run(self, until: float) -> None:
        while self.now < until:
            self.now = min(until, self.now + SCAN_S, max(self.node.wake_at, self.now + 0.001))
            self.node.scan(())

    def happens(self, what: Any) -> None:
        if isinstance(what, DoorSample):
            self.operator.sample = what
        elif what == "bus":
            self.operator.broken = not self.operator.broken
        else:
            self.node.scan((what,))


CONTACT = st.sampled_from([True, False, None])
DOOR_HAPPENINGS = st.one_of(
    st.builds(DoorSample, st.booleans(), CONTACT, CONTACT, CONTACT),
    st.sampled_from([OpenRequested("a"), CloseRequested("a"), RivalSeen(), Attended(False)]),
    st.sampled_from(["bus", OperatorReset(), Attended(True)]),
)
LIMITS = st.builds(
    DoorLimits,
    t=st.builds(
        DoorDurations,
        max_hold_s=st.sampled_from([None, 5.0]),
        supervisor_lost_s=st.sampled_from([None, 4.0]),
    ),
    debounce=st.sampled_from([{}, {"opened": 0.07, "fire": 0.12}]),
    estimated=st.booleans(),
    on_fire=st.sampled_from(["open", "release"]),
    pulse=st.sampled_from([None, Pulse(on_s=0.5, every_s=3.0)]),
)


@FEW
@given(st.lists(st.tuples(WAITS, DOOR_HAPPENINGS), max_size=30), LIMITS)
def test_a_door_behaves_as_if_its_core_decided_on_every_reading(
    happenings: Sequence[tuple[float, Any]], limits: DoorLimits
) -> None:
    some, every = Entrance(door.KIND, limits), Entrance(deciding_always(door.KIND), limits)
    for wait_s, what in happenings:
        for entrance in (some, every):
            entrance.happens(what)
            entrance.run(entrance.now + wait_s)
        assert (some.operator.written, some.told) == (every.operator.written, every.told)
        assert some.node.subject.memory == every.node.subject.memory
        assert told(some.node) == told(every.node)


def test_the_core_decides_on_few_readings_of_a_standing_lift_and_on_each_change_at_once() -> None:
    readings: list[object] = []
    story = Story(Building(STANDING), kind=counted(lift.KIND, readings))
    story.run(10.0)
    readings.clear()
    story.run(20.0)
    # Of 200 readings, the core decides only if a state is due or a reading would be stale.
    assert len(readings) < 35
    story.building.set(level=None)
    story.run(20.05)
    assert readings[-1] == Sampled(
        LiftSample(None, STANDING.door, motion=STANDING.motion, agv=False)
    )


def test_a_request_and_a_failed_write_are_decided_at_once() -> None:
    story = Story(Controller())
    story.run(5.0)
    story.asks("A", "L1")
    assert story.outputs.agv_request
    story.run(10.0)
    story.building.unwritable = "timeout"
    story.run(10.05)
    assert story.node.subject.memory.write_failed


def test_an_equal_reading_that_still_changes_the_memory_is_decided() -> None:
    story = Story(Building(STANDING))
    story.run(5.32)
    story.building.unwritable = "timeout"
    story.run(5.37)
    story.building.unwritable = ""
    story.run(5.42)  # the write succeeds again, and only the next reading tells the core
    assert story.node.subject.memory.unwritten_since is not None
    story.run(5.47)
    assert story.node.subject.memory.unwritten_since is None


def test_a_published_report_that_changes_the_memory_lets_the_core_decide_again() -> None:
    readings: list[object] = []
    story = Story(Building(STANDING), kind=counted(lift.KIND, readings))
    story.run(5.32)
    subject = story.node.subject
    before = len(readings)
    story.run(5.37)
    assert len(readings) == before
    subject.published(replace(subject.memory, fire_latched=False))
    story.run(5.42)
    assert len(readings) == before + 1
