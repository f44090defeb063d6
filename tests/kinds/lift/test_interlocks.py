"""Relays that must not be on together, relays that must stay off for some time, and switching off at
once."""

from typing import Any

import pytest
from msgspec.structs import replace

from bridges.kinds.lift.relays import Channel, Relays
from bridges.kinds.lift.settings import LiftDurations
from bridges.kinds.lift.signals import DoorReading, Hazard, LiftOutputs, LiftSample, Motion, Side
from tests.kinds.lift.story import Building, Controller, Story

AT_L1 = LiftSample("L1", DoorReading.OPEN, motion=Motion.STOPPED, agv=True)


def limits(**changes: float) -> LiftDurations:
    return LiftDurations(**changes)  # type: ignore[arg-type]


def driven(
    relays: Relays, wishes: list[tuple[float, LiftOutputs]], rules: LiftDurations
) -> list[str]:
    """Return the outputs after each of these ordered outputs (`wishes`), as text.

    `A` stands for the request of AGV mode. The called floor or the held door follows.
    """
    shown = []
    for now, wish in wishes:
        relays = relays.step(wish, now, rules).confirm(now)
        on = relays.outputs()
        side = on.hold_door.value if on.hold_door else ""
        shown.append(" ".join(filter(None, ("A" if on.agv_request else "", on.call, side))))
    return shown


def call(floor: str) -> LiftOutputs:
    return LiftOutputs(agv_request=True, call=floor)


def hold(side: Side = Side.FRONT) -> LiftOutputs:
    return LiftOutputs(agv_request=True, hold_door=side)


# ---- LIFT-DRIVE-3: relays that are never on together


def test_two_calls_are_never_on_together_and_relays_rest_between_them() -> None:
    wishes = [(0.0, call("L1")), (1.0, call("L2")), (1.29, call("L2")), (1.3, call("L2"))]
    assert driven(Relays(), wishes, limits(min_off_s=0)) == ["A L1", "A", "A", "A L2"]


def test_relays_rest_between_a_call_and_a_door_command() -> None:
    wishes = [(0.0, hold()), (1.0, call("L1")), (1.2, call("L1")), (1.3, call("L1")),
              (2.0, hold()), (2.2, hold()), (2.3, hold())]  # fmt: skip
    assert driven(Relays(), wishes, limits(min_off_s=0)) == [
        "A front", "A", "A", "A L1", "A", "A", "A front"]  # fmt: skip


class BadWire(Controller):
    """A lift at which one switching of the call takes `slow_s`, or fails for `lost_s`. `call` is that
    switching: a landing, or None for "off"."""

    since: float | None = None
    story: Story

    def __init__(self, call: str | None, slow_s: float, lost_s: float) -> None:
        super().__init__()
        self.bad_call, self.slow_s, self.lost_s = call, slow_s, lost_s

    def write(self, outputs: LiftOutputs) -> None:
        switches = outputs.call != self.driven.call
        if switches and outputs.call == self.bad_call and self.since is None:
            self.since = self.now
            self.story.now += self.slow_s
            self.now = self.story.now
        lost = self.since is not None and self.now < self.since + self.lost_s
        self.unwritable = "no reply" if lost else ""
        super().write(outputs)


@pytest.mark.parametrize(("slow_s", "lost_s"), [(0.0, 0.0), (0.45, 0.0), (0.0, 0.45)])
def test_relays_rest_from_the_time_when_the_off_was_written(slow_s: float, lost_s: float) -> None:
    wire = BadWire(None, slow_s, lost_s)
    wire.story = story = Story(wire)
    story.run(1.0)
    story.asks("A", "L2")
    story.until(lambda: story.outputs.hold_door)
    (off_at, _, off), (on_at, _, on) = story.edges[-2:]
    assert (off, on) == (None, "front")
    assert 0.29 < on_at - off_at < 0.36


# ---- LIFT-DRIVE-4: the length of a call's pulse


@pytest.mark.parametrize(("slow_s", "lost_s"), [(0.0, 0.0), (0.45, 0.0), (0.0, 0.45), (0.0, 0.7)])
def test_a_pulse_lasts_from_the_time_when_it_was_written(slow_s: float, lost_s: float) -> None:
    wire = BadWire("L2", slow_s, lost_s)
    wire.story = story = Story(wire, call_pulse_s=0.5)
    story.run(1.0)
    story.asks("A", "L2")
    story.run(10.0)
    (on_at, *on), (off_at, *off) = story.edges[1:3]
    assert (on, off) == (["call", "L2"], ["call", None])
    assert 0.49 < off_at - on_at < 0.56
    assert story.state == "AGV, open at L2, A to L2"


def test_a_call_stays_on_when_the_car_leaves_before_the_call_is_known_to_be_written() -> None:
    building = Building(replace(AT_L1, door=DoorReading.CLOSED))
    story = Story(building, call_pulse_s=0.5)
    story.run(1.0)
    story.asks("A", "L3")
    building.set(level=None, motion=Motion.UP)
    story.run(2.0)
    assert story.edges[1:] == [(1.0, "call", "L3"), (1.5, "call", None)]


def test_two_doors_are_never_held_together_and_relays_rest_between_them() -> None:
    wishes = [(0.0, hold()), (1.0, hold(Side.REAR)), (1.2, hold(Side.REAR)), (1.3, hold(Side.REAR))]
    assert driven(Relays(), wishes, limits(min_off_s=0)) == ["A front", "A", "A", "A rear"]


# ---- LIFT-DRIVE-6: a relay stays off for some time, but switching off never waits


def test_an_output_stays_off_for_its_least_time() -> None:
    wishes = [(0.0, call("L1")), (1.0, LiftOutputs()), (1.1, call("L1")), (2.9, call("L1")),
              (3.0, call("L1"))]  # fmt: skip
    assert driven(Relays(), wishes, limits(min_off_s=2.0)) == ["A L1", "", "", "", "A L1"]


def test_a_resting_agv_relay_permits_no_call_and_no_door_command() -> None:
    wishes = [(0.0, LiftOutputs(agv_request=True)), (1.0, LiftOutputs()),
              (1.1, call("L1")), (1.5, call("L1"))]  # fmt: skip
    assert driven(Relays(), wishes, limits()) == ["A", "", "", "A L1"]


def test_a_relay_switches_on_no_more_often_than_max_cycles_per_min() -> None:
    on, off = LiftOutputs(agv_request=True), LiftOutputs()
    wishes = [(float(i), (on, off)[i % 2]) for i in range(12)]
    rules = limits(max_cycles_per_min=3)
    assert driven(Relays(), [*wishes, (59.9, on), (60.0, on)], rules) == [
        "A", "", "A", "", "A", "", "", "", "", "", "", "", "", "A"]  # fmt: skip


def test_switching_off_never_waits() -> None:
    rules = limits(min_off_s=60, dead_time_s=60, max_cycles_per_min=1)
    relays = Relays().step(call("L1"), 0.0, rules)
    assert relays.step(LiftOutputs(), 0.0, rules).outputs() == LiftOutputs()


def test_the_core_wakes_when_relays_have_rested() -> None:
    rules = limits(min_off_s=2.0, max_cycles_per_min=2)
    relays = Relays()
    for now, wish in ((0.0, call("L1")), (1.0, call("L2")), (3.0, call("L2")), (4.0, hold())):
        assert relays.changes_at(wish, now, rules) > now
        relays = relays.step(wish, now, rules).confirm(now)
    assert relays.changes_at(hold(), 4.0, rules) == 4.3
    assert relays.changes_at(call("L1"), 4.0, rules) == 60.0
    assert relays.changes_at(LiftOutputs(), 4.0, rules) == float("inf")
    rested = Relays(agv=Channel(None, 4.0))
    assert rested.changes_at(call("L1"), 4.0, rules) == 6.0
    assert rested.changes_at(LiftOutputs(agv_request=True), 4.0, rules) == 6.0
    rested = replace(rested, call=Channel(None, 4.9))
    assert rested.changes_at(call("L1"), 5.0, rules) == 6.0
    worn = Relays(agv=Channel(True, 4.0, (0.0, 5.0)), call=Channel(None, 5.0))
    assert worn.changes_at(call("L1"), 6.0, rules) == 7.0


# ---- LIFT-DRIVE-2, LIFT-DRIVE-3: which output is switched first


def test_a_call_comes_before_a_door_command() -> None:
    both = LiftOutputs(agv_request=True, call="L1", hold_door=Side.FRONT)
    assert driven(Relays(), [(0.0, both), (9.0, both)], limits()) == ["A L1", "A L1"]


def test_without_rest_times_a_call_still_goes_off_before_the_next_call() -> None:
    story = Story(Building(replace(AT_L1, level="L4")), dead_time_s=0, min_off_s=0)
    story.run(1.0)
    story.asks("A", "L1")
    story.run(2.0)
    story.asks("A", "L2")
    story.run(2.04)
    assert story.edges == [
        (1.0, "agv_request", True),
        (1.0, "call", "L1"),
        (2.0, "call", None),
        (2.0, "call", "L2"),
    ]


def test_an_end_releases_the_door_before_agv_mode_and_a_hazard_releases_all_at_once() -> None:
    for hazard in (False, True):
        story = Story(Building(AT_L1), release_grace_s=2.0, dead_time_s=0.5)
        story.run(1.0)
        story.asks("A", "L1")
        story.run(2.0)
        if hazard:
            story.building.hazard(Hazard.FIRE)
        else:
            story.ends("A")
        story.run(9.0)
        times = [at for at, _, value in story.edges if not value]
        assert times == ([2.1, 2.1] if hazard else [3.5, 4.0])


# ---- LIFT-DRIVE-6, LIFT-5: too many changes


def test_a_burst_of_changing_requests_does_not_wear_the_relays() -> None:
    story = Story(Controller(), max_cycles_per_min=5)
    story.run(1.0)
    for i in range(600):
        story.asks("A", f"L{i % 4 + 1}")
        story.run(story.now + 0.1)
    ons = [edge for edge in story.edges if edge[1] == "call" and edge[2]]
    assert 0 < len(ons) <= 5


@pytest.mark.parametrize("inside", [False, True])
def test_a_door_that_is_open_only_for_its_dwell_time_is_not_offered(inside: bool) -> None:
    closed = replace(AT_L1, door=DoorReading.CLOSED)
    story = Story(Building(closed), max_cycles_per_min=2, request_timeout_s=99)
    story.run(1.0)
    story.asks("A", "L1")
    if inside:
        story.building.set(door=DoorReading.OPEN)
        story.until(lambda: story.state == "AGV, open at L1, A to L1")
        story.building.set(door=DoorReading.CLOSED)
    for motion in (Motion.UP, Motion.STOPPED) * 2:  # the relay switches on too often
        story.run(story.now + 1.0)
        story.building.set(motion=motion)
    story.run(8.0)
    assert story.outputs == LiftOutputs(agv_request=True)
    story.building.set(door=DoorReading.OPEN)
    story.run(9.0)
    assert (story.faults, story.state) == (["RELAY_RESTS"], "AGV, moving at L1, A to L1")
    story.until(lambda: story.outputs.hold_door)
    assert (story.faults, story.state) == ([], "AGV, open at L1, A to L1")


def test_a_lift_that_waits_for_a_worn_relay_says_so() -> None:
    story = Story(Building(replace(AT_L1, door=DoorReading.CLOSED)), max_cycles_per_min=3)
    story.run(1.0)
    for at, floor in enumerate(["L3", "L4", "L3", "L4"]):
        story.run(2.0 + at)
        story.asks("A", floor)
    said: list[tuple[object, ...]] = []
    while story.now < 64.0:
        story.run(story.now + 0.5)
        status = story.node.status()
        now = (status.get("waits"), *(fault["detail"] for fault in status["faults"]))
        said += [(round(story.now, 1), *now)] if now not in [what[1:] for what in said[-1:]] else []
        story.asks("A", "L4")
    rests = "the call: its relay came on 3 times within a minute"
    assert said == [
        (5.5, "for the call: its relay must rest", rests),
        (62.0, "for the car at L4"),
    ]


def test_a_relay_that_must_rest_is_named() -> None:
    t, on, off = LiftDurations(), Channel(True, ons=(0.0,)), Channel[Any](off_at=10.0)
    wants = LiftOutputs(agv_request=True, call="L1"), LiftOutputs(True, hold_door=Side.FRONT)
    assert [
        Relays(agv=off).resting(wants[0], 10.0, t),
        Relays(on, call=off).resting(wants[0], 10.0, t),
        Relays(on, hold=off).resting(wants[1], 10.0, t),
    ] == [("AGV mode", False), ("the call", False), ("the door", False)]


# ---- LIFT-DRIVE-4: pulses


def test_a_reset_without_a_fault_gives_no_second_pulse() -> None:
    story = Story(Controller(), call_pulse_s=0.5)
    story.run(1.0)
    story.asks("A", "L4")
    story.run(3.0)
    story.resets()
    story.run(5.0)
    assert [edge for edge in story.edges if edge[1] == "call"] == [
        (1.55, "call", "L4"),
        (2.05, "call", None),
    ]


@pytest.mark.parametrize("pulse_s", [0.3, 1.0])
def test_a_pulse_lasts_its_whole_width(pulse_s: float) -> None:
    story = Story(Controller(), call_pulse_s=pulse_s)
    story.run(1.0)
    story.asks("A", "L4")
    story.run(5.0)
    on, off = [at for at, name, _ in story.edges if name == "call"]
    assert round(off - on, 2) == pulse_s


def test_a_relay_cycle_counts_for_exactly_a_minute() -> None:
    once = Channel[str](ons=(0.0, 30.0))
    assert [once.recent(now) for now in (59.9, 60.0, 89.9, 90.0)] == [
        (0.0, 30.0),
        (30.0,),
        (30.0,),
        (),
    ]
