"""Tests of the lift's rules in all states near the start, and in all states near each stage of a
ride."""

from math import inf

import pytest
from msgspec.structs import replace

from bridges.kinds.lift.signals import DoorReading, LiftOutputs, Motion
from tests.depth import depth
from tests.kinds.lift.invariants import check, nothing_changes_before_wake_at
from tests.kinds.lift.walk import IDLE, World, limits_of, start, walker

LIMITS = limits_of()
OFF = LiftOutputs()


WALKER = walker(LIMITS)
DEPTH = depth(2, 3)


CALLED = (1.0, "A asks L3", 1.0, "agv on", 0.05)
ARRIVED = (*CALLED, "moving", "at None", 1.0, "at L2", 1.0, "at L3", "standing", 1.0)
BOARDED = (*ARRIVED, "door open", 1.0)
RIDING = (*BOARDED, "A asks L1", 1.0, "door closed", "moving", "at None", 1.0)
ROOTS = {
    "idle": (1.0,),
    "called": CALLED,
    "arrived": ARRIVED,
    "boarded": BOARDED,
    "riding": RIDING,
    "called to and fro, worn": (*CALLED, *("A asks L1", 1.0, "A asks L3", 1.0) * 20),
    "riding, disowned": (*RIDING, "A's adapter asks L3", 0.05, "A ends, stamped", 1.0),
    "left in the car": (*RIDING, "A's adapter asks L3", 6.0, "A ends", 4.0),
    "in the grace": (*BOARDED, "A ends", 0.05),
    "burnt out, latched": (*BOARDED, "fire_alarm", 1.0, "fire_alarm", 4.0),
    "failed, latched": (*ARRIVED, *("A asks L3", 25.0) * 7),
}


def test_each_stage_of_a_ride_is_what_its_name_says() -> None:
    def stage(name: str) -> tuple[object, ...]:
        memory = WALKER.path(start(LIMITS), *ROOTS[name]).memory
        session = memory.session
        return (session and (session.boarded, session.retry_at), memory.grace is not None,
                memory.relays.outputs().call, memory.fire_latched)  # fmt: skip

    assert {name: stage(name) for name in ROOTS} == {
        "idle": (None, False, None, False),
        "called": ((False, None), False, "L3", False),
        "arrived": ((False, None), False, None, False),
        "boarded": ((True, None), False, None, False),
        "riding": ((True, None), False, "L1", False),
        "called to and fro, worn": ((False, None), False, None, False),
        "riding, disowned": ((True, None), False, "L1", False),
        "left in the car": (None, True, None, False),
        "in the grace": (None, True, None, False),
        "burnt out, latched": ((True, None), False, None, True),
        "failed, latched": ((False, inf), False, None, False),
    }


def check_rules_around(*roots: World) -> int:
    """Check the rules at every step within DEPTH steps from the roots. Also check `wake_at` in every
    state.

    Return the number of states.
    """
    found = WALKER.walk(roots, DEPTH, check)
    for world in found:
        nothing_changes_before_wake_at(world, LIMITS)
    return len(found)


def test_the_rules_hold_within_some_steps_of_the_start() -> None:
    assert check_rules_around(start(LIMITS)) > depth(300, 4000)


@pytest.mark.parametrize("root", ROOTS)
def test_the_rules_hold_within_some_steps_of_each_stage_of_a_ride(root: str) -> None:
    stage = WALKER.path(start(LIMITS), *ROOTS[root])
    assert check_rules_around(stage) > depth(150, 1000)


def mended_and_idle(world: World) -> World:
    """Return the world after a repair of everything. The car stands idle at L1, without a session and
    without a latch."""
    world = replace(world, sample=IDLE, readable=True, writable=True)
    world = WALKER.path(world, 6.0, "A ends", "B ends", "reset", 9.0, seen=check)
    assert world.memory.session is None
    return WALKER.path(world, 64.0, seen=check)


def serves(world: World) -> bool:
    """Return whether a new request makes the core request AGV mode, and leads to an open door for the
    robot."""
    world = WALKER.path(world, "B asks L1", seen=check)
    wanted = WALKER.path(world, 1.0, seen=check).memory.relays.outputs()
    sample = replace(IDLE, agv=True, door=DoorReading.OPEN, motion=Motion.STOPPED)
    world = WALKER.path(replace(world, sample=sample), 1.0, seen=check)
    session = world.memory.session
    return wanted.agv_request and session is not None and session.boarded


def test_from_every_state_a_building_without_faults_returns_to_idle_and_serves_again() -> None:
    roots = [WALKER.path(start(LIMITS), *steps) for steps in ((), *ROOTS.values())]
    for world in WALKER.walk(roots, depth(1, 2)):
        idle = mended_and_idle(world)
        assert (idle.memory.session, idle.memory.grace) == (None, None)
        assert idle.memory.relays.outputs() == OFF
        assert serves(idle)
