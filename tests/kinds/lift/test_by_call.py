"""LIFT-DRIVE-2, LIFT-DRIVE-5: a lift with `agv_mode: by_call`. A call brings AGV mode, and no output
requests it."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from msgspec.structs import replace

from bridges.kinds.lift.signals import (
    DoorReading,
    Hazard,
    LiftOutputs,
    LiftSample,
    Motion,
    Side,
)
from bridges.settings.load import load
from drivers.lift.dry_contact import DryContactLiftSettings
from tests.depth import depth
from tests.kinds.lift.alone import ASKED, CLOSED, Alone
from tests.kinds.lift.invariants import check, nothing_changes_before_wake_at
from tests.kinds.lift.story import STANDING, Building, Story
from tests.kinds.lift.walk import limits_of, start, walker
from tests.kinds.lift.wired import WiredStory

A = "fleet/a"
CONFIG = Path(__file__).parents[3] / "config" / "lift_by_call.yaml"


def simulator() -> WiredStory:
    """Return the lift of `config/lift_by_call.yaml`, wired as the open-source lift simulator needs
    it."""
    settings = load(CONFIG).devices["Lift1"]
    assert isinstance(settings, DryContactLiftSettings)
    story = WiredStory(settings)
    story.run(1.0)
    return story


def relays(story: WiredStory) -> list[tuple[str, object]]:
    edges = story.building.plant.edges
    return [(edge.signal, edge.value) for edge in edges if edge.what == "relay"]


def open_at(story: Story, floor: str) -> None:
    def there() -> bool:
        story.asks(A, floor)
        return story.state == f"AGV, open at {floor}, {A} to {floor}"

    story.until(there)


def test_a_call_to_the_present_floor_brings_agv_mode_and_the_hold_keeps_it() -> None:
    story = simulator()
    open_at(story, "L1")
    story.run(story.now + 60.0)
    assert relays(story) == [("call_L1", True), ("call_L1", False), ("door_open", True)]
    assert (story.state, story.building.plant.agv) == (f"AGV, open at L1, {A} to L1", True)


def test_agv_mode_ends_with_the_hold_after_a_whole_ride() -> None:
    story = simulator()
    open_at(story, "L1")
    story.run(story.now + 5.0)
    open_at(story, "L3")
    story.ends(A)
    story.run(story.now + 10.0)
    assert relays(story) == [
        ("call_L1", True),
        ("call_L1", False),
        ("door_open", True),
        ("door_open", False),
        ("call_L3", True),
        ("call_L3", False),
        ("door_open", True),
        ("door_open", False),
    ]
    assert (story.state, story.faults) == ("HUMAN, closed at L3", [])


def called(agv: bool = True) -> tuple[Building, Story]:
    """Return a car at L1 that a robot has called to L3. If `agv` is true, the lift has granted AGV
    mode."""
    building = Building(replace(STANDING, agv=False))
    story = Story(building, agv_mode="by_call", agv_timeout_s=5)
    story.run(1.0)
    story.asks(A, "L3")
    story.run(1.2)
    building.set(agv=agv)
    story.run(2.0)
    return building, story


def test_a_call_without_agv_mode_is_given_up_after_its_time() -> None:
    _, story = called(agv=False)
    assert story.outputs.call == "L3"
    story.run(7.0)
    assert (story.outputs, story.faults) == (LiftOutputs(), ["AGV_MODE_NOT_GRANTED"])


def test_agv_mode_that_ends_on_the_way_is_a_fault_and_is_requested_by_a_new_call() -> None:
    building, story = called()
    building.set(agv=False, motion=Motion.UP, level=None)
    story.run(3.0)
    assert (story.outputs.call, story.faults) == (None, ["AGV_MODE_LOST"])
    story.asks(A, "L3")
    story.run(14.0)
    assert story.outputs.call == "L3"


def test_agv_mode_that_ends_on_the_way_after_the_pulse_of_the_call_is_a_fault_too() -> None:
    building = Building(replace(STANDING, agv=False))
    story = Story(building, agv_mode="by_call", call_pulse_s=0.5)
    story.run(1.0)
    story.asks(A, "L3")
    building.set(agv=True, motion=Motion.UP, level=None)
    story.run(5.0)
    assert (story.outputs, story.faults) == (LiftOutputs(agv_request=True), [])
    building.set(agv=False)
    story.run(6.0)
    assert story.faults == ["AGV_MODE_LOST"]


def test_agv_mode_may_end_between_two_destinations() -> None:
    building, story = called()
    building.set(level=None, motion=Motion.UP)
    story.run(5.0)
    building.set(level="L3", motion=Motion.STOPPED)
    story.run(6.0)
    building.set(door=DoorReading.OPEN)
    story.run(7.0)
    story.asks(A, "L1")
    building.set(agv=False)
    story.run(8.0)
    assert (story.outputs.hold_door, story.outputs.call, story.faults) == (None, "L1", [])


def calls_and_holds(
    alone: Alone, readings: Sequence[tuple[float, LiftSample]]
) -> list[tuple[float, str | None, Side | None]]:
    """Return (s, called landing, held door) after each reading. A robot repeats its request at each
    reading. Each output is written at once, and the inputs are then read again."""
    shown = []
    for now, reading in readings:
        outputs = alone(now, reading, ASKED).decision.outputs
        shown.append((now, outputs.call, outputs.hold_door))
        alone(now, reading)
    return shown


def test_a_car_that_has_come_is_not_called_again_when_its_floor_is_unknown() -> None:
    """In AGV mode a lift with `by_call` is called again only after a reading at another floor."""
    alone = Alone(by_call=True)
    below = replace(CLOSED, level="L2", agv=False)
    readings = [
        (0.0, below),
        (0.5, replace(below, agv=True)),
        (1.0, CLOSED),
        (1.5, CLOSED),
        (2.0, replace(CLOSED, level=None)),
        (9.0, replace(CLOSED, level=None)),
    ]
    alone(0.0, ASKED)
    assert calls_and_holds(alone, readings) == [
        (0.0, "L1", None),
        (0.5, "L1", None),
        (1.0, None, None),
        (1.5, None, Side.FRONT),
        (2.0, None, None),
        (9.0, None, None),
    ]


def test_a_car_at_its_destination_is_called_again_when_agv_mode_has_ended_by_itself() -> None:
    """On this lift (`by_call`) an overload has ended the hold. Then all outputs went off, because no
    floor was read."""
    alone = Alone(by_call=True)
    below, gone = replace(CLOSED, level="L2"), replace(CLOSED, level=None)
    readings = [
        (0.0, replace(below, agv=False)),
        (0.5, below),
        (1.0, CLOSED),
        (1.5, CLOSED),
        (2.0, replace(gone, hazards=frozenset({Hazard.OVERLOAD}))),
        (3.0, replace(gone, agv=False)),
        (3.5, replace(CLOSED, agv=False)),
        (4.0, CLOSED),
        (4.5, CLOSED),
    ]
    assert calls_and_holds(alone, readings) == [
        (0.0, "L1", None),
        (0.5, "L1", None),
        (1.0, None, None),
        (1.5, None, Side.FRONT),
        (2.0, None, None),
        (3.0, "L1", None),
        (3.5, "L1", None),
        (4.0, None, None),
        (4.5, None, Side.FRONT),
    ]


LIMITS = limits_of(agv_mode="by_call")
WALKER = walker(LIMITS)
CALLED = (1.0, "A asks L3", 1.0, "agv on", 0.05)
ARRIVED = (*CALLED, "moving", "at None", 1.0, "at L2", 1.0, "at L3", "standing", 1.0)
BOARDED = (*ARRIVED, "door open", 1.0)
ROOTS = {
    "idle": (1.0,),
    "called where it stands": (1.0, "A asks L1", 1.0),
    "called": CALLED,
    "arrived": ARRIVED,
    "boarded": BOARDED,
    "called on": (*BOARDED, "A asks L1", 1.0),
    "in the grace": (*BOARDED, "A ends", 0.05),
}


@pytest.mark.parametrize("root", ROOTS)
def test_by_call_the_rules_hold_within_some_steps_of_each_stage_of_a_ride(root: str) -> None:
    stage = WALKER.path(start(LIMITS), *ROOTS[root])
    found = WALKER.walk([stage], depth(2, 3), check)
    for world in found:
        nothing_changes_before_wake_at(world, LIMITS)
    assert len(found) > depth(150, 1000)
