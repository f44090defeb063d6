"""Tests of the door's rules in all states near the start, and in all states near each stage of a
robot's passage."""

import pytest
from msgspec.structs import replace

from bridges.kinds.door.memory import DoorLimits
from bridges.kinds.door.settings import Pulse
from tests.depth import depth
from tests.kinds.door.invariants import check, nothing_changes_before_wake_at
from tests.kinds.door.virtual import DEBOUNCED
from tests.kinds.door.walk import MOVES, Step, World, limits_of, moved, start, walker

SITES = {
    "fire releases": limits_of(),
    "fire holds open": limits_of(on_fire="open"),
    "no contacts": limits_of({"open_delay_s": 4.0}, estimated=True),
    "pulses": limits_of(pulse=Pulse(on_s=0.5, every_s=3.0)),
    "pulses and no contacts": limits_of(
        {"open_delay_s": 4.0}, estimated=True, pulse=Pulse(on_s=0.5, every_s=3.0)
    ),
    "debounced": limits_of(debounce=DEBOUNCED),
}
PLAIN = SITES["fire releases"]

OPENING = ("between", 1.0, "A opens", 1.0)
OPEN = (*OPENING, "at open", 1.0)
LEFT = (*OPEN, "A closes", 4.0)
STAGES: dict[str, tuple[str | float, ...]] = {
    "shut": (1.0,),
    "opening": OPENING,
    "open": OPEN,
    "in the grace": (*OPEN, "A closes", 1.0),
    "let go": LEFT,
    "somebody in the way": (*LEFT, "between", "obstruction", 1.0),
    "fire": (*OPEN, "fire", 1.0),
    "blind": (*OPEN, "bus lost or back", 64.0),
    "rivalled": (*OPEN, "rival"),
    "at neither end for long": (*OPENING, 16.0),
}


def path(*steps: str | float, limits: DoorLimits = PLAIN) -> World:
    """Return the world (the core and its door) after these moves and waits (s)."""
    return walker(limits).path(start(limits), *steps)


class Scan:
    """One more scan of a world. It has the core's decision, and the rules check this decision."""

    def __init__(self, world: World, limits: DoorLimits) -> None:
        self._steps: list[Step] = []
        moved(world, MOVES["reset"], limits, self._note)
        report = self._steps[0].decision.report
        self.mode = report.mode.name.removeprefix("MODE_")
        self.hold = report.hold
        self.codes = tuple(fault.code for fault in report.faults)

    def _note(self, step: Step) -> None:
        check(step)
        self._steps.append(step)


def test_each_stage_of_a_passage_is_what_its_name_says() -> None:
    scans = {name: Scan(path(*steps), PLAIN) for name, steps in STAGES.items()}
    assert {name: (scan.mode, scan.hold, *scan.codes) for name, scan in scans.items()} == {
        "shut": ("CLOSED", False),
        "opening": ("MOVING", True),
        "open": ("OPEN", True),
        "in the grace": ("OPEN", True),
        "let go": ("OPEN", False),
        "somebody in the way": ("MOVING", True, "DOOR_OBSTRUCTED"),
        "fire": ("UNKNOWN", False, "FIRE_ALARM"),
        "blind": ("OFFLINE", False, "COMMUNICATION_LOST", "DOOR_OPEN_TOO_LONG"),
        "rivalled": ("OFFLINE", False, "TWO_NODES_FOR_ONE_DEVICE"),
        "at neither end for long": (
            "UNKNOWN",
            True,
            "DOOR_TRAVEL_TIMEOUT",
            "DOOR_OPENING_FAULT",
        ),
    }


def check_rules_within(steps: int, roots: list[World], limits: DoorLimits) -> int:
    """Check the rules at every step within `steps` steps from the roots. Also check `wake_at` in every
    state.

    Return the number of states.
    """
    found = walker(limits).walk(roots, steps, check)
    for world in found:
        nothing_changes_before_wake_at(world, limits)
    return len(found)


@pytest.mark.parametrize("site", SITES)
def test_the_rules_of_a_door_hold_within_some_steps_of_the_start(site: str) -> None:
    limits = SITES[site]
    assert check_rules_within(depth(2, 3), [start(limits)], limits) > depth(80, 500)


@pytest.mark.parametrize("stage", STAGES)
def test_the_rules_hold_within_some_steps_of_each_stage_of_a_passage(stage: str) -> None:
    assert check_rules_within(depth(2, 3), [path(*STAGES[stage])], PLAIN) > depth(100, 500)


@pytest.mark.parametrize("site", SITES)
def test_the_rules_of_a_door_hold_near_all_stages_at_each_kind_of_site(site: str) -> None:
    limits = SITES[site]
    roots = [path(*steps, limits=limits) for steps in STAGES.values()]
    assert check_rules_within(depth(1, 2), roots, limits) > depth(80, 800)


def mended(world: World, limits: DoorLimits) -> World:
    """Return the world after a repair of everything. The door is shut, the doorway is empty, nothing
    burns, and the contacts answer."""
    world = replace(world, sample=start(limits).sample, readable=True, writable=True)
    return path_checked(world, limits, 6.0)


def path_checked(world: World, limits: DoorLimits, *steps: str | float) -> World:
    """Return the world after these moves and waits (s). The rules check each step."""
    return walker(limits).path(world, *steps, seen=check)


def states_around_all_stages(limits: DoorLimits) -> list[World]:
    """Return every state within one step of a stage of a robot's passage."""
    roots = [path(*steps, limits=limits) for steps in STAGES.values()]
    return walker(limits).walk(roots, 1, check)


@pytest.mark.parametrize("site", SITES)
def test_from_every_state_a_sound_door_opens_on_open_and_is_released_on_close(
    site: str,
) -> None:
    limits = SITES[site]
    for world in states_around_all_stages(limits):
        sound = mended(world, limits)
        wanted = path_checked(sound, limits, "A opens", "at open", 5.0)
        assert (Scan(wanted, limits).mode, Scan(wanted, limits).hold) == ("OPEN", True)
        asked = path_checked(wanted, limits, "A closes", 2.0)
        assert Scan(asked, limits).hold
        assert not Scan(path_checked(asked, limits, 1.0), limits).hold
        shut = path_checked(asked, limits, 1.0, "at closed", 16.0)
        assert (Scan(shut, limits).mode, Scan(shut, limits).hold) == ("CLOSED", False)


@pytest.mark.parametrize("site", SITES)
def test_from_every_state_a_wanted_door_stays_held_in_silence(site: str) -> None:
    limits = SITES[site]
    for world in states_around_all_stages(limits):
        wanted = path_checked(mended(world, limits), limits, "A opens", "at open", 200.0)
        scan = Scan(wanted, limits)
        assert (scan.mode, scan.hold) == ("OPEN", True)
        assert scan.codes == ("DOOR_OPEN_TOO_LONG",)
