"""Tests of the charger's rules in all states near the start, and in all states near each stage of a
charge."""

import pytest
from msgspec.structs import replace

from bridges.kinds.charger.memory import ChargerLimits
from bridges.kinds.charger.signals import ChargeRequested
from tests.depth import depth
from tests.kinds.charger.invariants import check
from tests.kinds.charger.walk import SITES, Step, World, moved, walker

ASSIGNED = (1.0, "A asks")
CHARGING = (*ASSIGNED, "A docks", 1.0, "handshake", "charging", 1.0)
STAGES: dict[str, tuple[str | float, ...]] = {
    "idle": (1.0,),
    "assigned": ASSIGNED,
    "on the pad": (*ASSIGNED, "A docks", "in range", 1.0),
    "charging": CHARGING,
    "released": (*CHARGING, "idle"),
    "cancelled": (*CHARGING, "A cancels"),
    "wrong robot": (*ASSIGNED, "B docks", 1.0),
    "at fault": (*CHARGING, "error"),
    "out of service": (*CHARGING, "error", "idle", 1.0),
    "lost": (*CHARGING, "link lost or back", 5.0),
    "adopted": ("A docks", "link lost or back", 5.0, "charging", "link lost or back"),
}


def path(limits: ChargerLimits, *steps: str | float) -> World:
    """Return the world (the core and its station) after these moves and waits (s)."""
    return walker(limits).path(World(), *steps, seen=check)


def shown(world: World, limits: ChargerLimits) -> tuple[str, str, bool | None]:
    """Scan once more. Return the reported state, the request's id, and the core's order for the
    power."""
    steps: list[Step] = []
    walker(limits).path(world, 0.5, seen=steps.append)
    decision = steps[-1].decision
    state = decision.report.state.name.removeprefix("CHARGER_")
    return state, decision.report.request_id, decision.outputs.power


def test_each_stage_of_a_charge_is_what_its_name_says() -> None:
    limits = SITES["refuses"]
    assert {name: shown(path(limits, *steps), limits) for name, steps in STAGES.items()} == {
        "idle": ("IDLE", "", False),
        "assigned": ("ASSIGNED", "req-A", False),
        "on the pad": ("ASSIGNED", "req-A", True),
        "charging": ("CHARGING", "req-A", True),
        "released": ("RELEASED", "req-A", False),
        "cancelled": ("CHARGING", "req-A", False),
        "wrong robot": ("ERROR", "req-A", False),
        "at fault": ("ERROR", "req-A", False),
        "out of service": ("ERROR", "req-A", False),
        "lost": ("ERROR", "req-A", None),
        "adopted": ("CHARGING", "", None),
    }


@pytest.mark.parametrize("site", SITES)
def test_the_rules_of_a_charger_hold_within_some_steps_of_the_start(site: str) -> None:
    found = walker(SITES[site]).walk([World()], depth(3, 4), check)
    assert len(found) > depth(1000, 5000)


@pytest.mark.parametrize("site", SITES)
def test_the_rules_hold_within_some_steps_of_each_stage_of_a_charge(site: str) -> None:
    limits = SITES[site]
    roots = [path(limits, *steps) for steps in STAGES.values()]
    found = walker(limits).walk(roots, depth(1, 2), check)
    assert len(found) > depth(100, 1000)


@pytest.mark.parametrize("stage", STAGES)
def test_the_rules_hold_within_some_steps_of_a_stage_at_a_verified_station(stage: str) -> None:
    limits = SITES["refuses"]
    found = walker(limits).walk([path(limits, *STAGES[stage])], depth(2, 3), check)
    assert len(found) > depth(100, 1000)


@pytest.mark.parametrize("site", SITES)
def test_from_every_state_a_station_without_faults_recovers_and_charges_the_robot_that_asks(
    site: str,
) -> None:
    limits = SITES[site]
    roots = [path(limits, *steps) for steps in STAGES.values()]
    for world in walker(limits).walk(roots, 1, check):
        sound = _mended(world, limits)
        assert shown(sound, limits)[:2] == ("IDLE", "")
        assert shown(_charged(sound, limits), limits)[:2] == ("CHARGING", "req-new")


def _mended(world: World, limits: ChargerLimits) -> World:
    """Return the world after a repair of everything. The pad is clear, all parts work and answer, and
    no error is left."""
    world = replace(world, readable=True, writable=True)
    steps = ("idle", "the pad is clear", "in range", "gap right", "pad at height")
    then = ("A cancels", "B cancels", 32.0, "reset", 4.0)
    return walker(limits).path(world, *steps, *then, seen=check)


def _charged(world: World, limits: ChargerLimits) -> World:
    """Return the world after robot A has sent a request, has docked, and has begun to charge."""
    asked = ChargeRequested("req-new", "tiny", "A")
    world = moved(world, lambda before: (before, [asked]), limits, check)
    world = walker(limits).path(world, "A docks", 2.0, seen=check)
    assert shown(world, limits) == ("ASSIGNED", "req-new", True)
    return walker(limits).path(world, "charging", seen=check)
