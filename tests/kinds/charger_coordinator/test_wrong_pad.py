"""Robots on the wrong pad, rule by rule. Each test builds a memory, and compares what the core finds in
it."""

from collections.abc import Mapping

import pytest
from msgspec.structs import replace

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator import wrong_pad
from bridges.kinds.charger_coordinator.memory import (
    ASSIGNED,
    CHARGING,
    ERROR,
    IDLE,
    Grant,
    Nudge,
    SiteLimits,
    SiteMemory,
    Standing,
    StationSeen,
    Wish,
)
from bridges.kinds.charger_coordinator.signals import Sighting
from bridges.kinds.charger_coordinator.wrong_pad import OnWrongPad
from bridges.kinds.shared.durations import NEVER
from bridges.messages.definitions import ChargerStateValue
from tests.kinds.charger_coordinator.virtual_site import settings

SITE = SiteLimits.of(settings())
ONE, TWO, THREE = (RobotName("tiny", f"AMR0{i}") for i in (1, 2, 3))
A, B = "charger_a", "charger_b"
AT = {A: "charger_a", B: "dock_b"}
"""The waypoint at which each station stands."""
PAD = "wrong docking: tiny/AMR01 is not assigned here"


def at(
    who: RobotName, place: str | None, since: float, task: str = "", heard: float = 85.0
) -> Standing:
    """Return a robot that has stood at this waypoint since `since`. Its fleet's last report was at
    `heard`."""
    return Standing(Sighting(who, False, place, 50.0, task), heard, since, since)


def shows(state: ChargerStateValue = IDLE, since: float = 0.0, error: str = "") -> StationSeen:
    """Return a station that has shown this state since `since` (s)."""
    return StationSeen(state, "", None, error, 85.0, since)


def site(*robots: Standing, **changes: object) -> SiteMemory:
    """Return a memory in which both stations are idle and the coordinator may publish."""
    found: Mapping[str, object] = {
        "may_speak": True,
        "robots": {standing.sighting.who: standing for standing in robots},
        "stations": {A: shows(), B: shows()},
    }
    return SiteMemory(**{**found, **changes})  # type: ignore[arg-type]


def found(memory: SiteMemory, *times: float) -> list[list[OnWrongPad]]:
    """Return a list for each of these times, with the robots that are on a wrong pad at that time."""
    return [list(wrong_pad.found(memory, now, SITE).values()) for now in times]


# ---- COORDINATOR-WRONG-PAD-1: a robot with a station, on the pad of another station

EXPECTED = {A: Grant(ONE, "r1", 10.0, shown=True)}


@pytest.mark.parametrize(("came_at", "since"), [(20.0, 22.0), (10.0, 40.0), (5.0, 40.0)])
def test_a_robot_that_came_after_its_call_is_astray_before_a_robot_that_stood_there(
    came_at: float, since: float
) -> None:
    memory = site(at(ONE, AT[B], came_at), grants=EXPECTED)
    one = OnWrongPad(ONE, B, since, "r1", 2, expected=A)
    assert found(memory, since - 0.1, since, NEVER) == [[], [one], [one]]


def test_a_robot_at_its_own_station_or_away_from_stations_is_not_astray() -> None:
    for place in (AT[A], "wait_1", None):
        assert found(site(at(ONE, place, 20.0), grants=EXPECTED), NEVER) == [[]]


def test_only_a_robot_with_a_station_and_without_a_charge_is_astray() -> None:
    two = OnWrongPad(TWO, A, 22.0, "r2", 2, expected=B)
    for first in (replace(EXPECTED[A], started=True), replace(EXPECTED[A], over=True)):
        grants = {A: first, B: Grant(TWO, "r2", 10.0, shown=True)}
        memory = site(at(ONE, AT[B], 20.0), at(TWO, AT[A], 20.0), grants=grants)
        assert found(memory, 50.0) == [[two]]


def test_only_a_station_in_error_names_the_robot_on_its_pad() -> None:
    for state, strays in ((ERROR, [OnWrongPad(ONE, B, 15.0, "r1", 2, expected=A)]), (IDLE, [])):
        stations = {A: shows(), B: shows(state, 15.0, PAD)}
        memory = site(at(ONE, None, 12.0), grants=EXPECTED, stations=stations)
        assert found(memory, 15.0) == [strays]


def history(
    memory: SiteMemory, *times: float
) -> list[tuple[float, dict[RobotName, Nudge], bool, bool]]:
    """Return (s, nudges so far, whether robot ONE is nudged now, whether an alarm is on) for each time.

    A nudge changes the robot's charging assignment for TOLD_S, so that RMF's adapter moves the robot.
    """
    lines = []
    for now in times:
        memory = wrong_pad.nudged(memory, now, SITE)
        alarms = any(
            wrong_pad.alarming(memory, a, now) for [*all_] in found(memory, now) for a in all_
        )
        lines.append((now, dict(memory.nudges), wrong_pad.is_nudged(memory, ONE, now), alarms))
    return lines


# ---- COORDINATOR-WRONG-PAD-1, COORDINATOR-WRONG-PAD-4: the nudges of a robot


def test_a_stray_robot_is_nudged_twice_for_one_request_and_then_a_person_is_told() -> None:
    memory = site(at(ONE, AT[B], 20.0), grants=EXPECTED)
    first, second = {ONE: Nudge("r1", 1, 22.0)}, {ONE: Nudge("r1", 2, 37.0)}
    assert history(memory, 21.9, 22.0, 22.9, 23.0, 36.9, 37.0, 37.9, 38.0, 51.9, 52.0, 99.0) == [
        (21.9, {}, False, False),
        (22.0, first, True, False),
        (22.9, first, True, False),
        (23.0, first, False, False),
        (36.9, first, False, False),
        (37.0, second, True, False),
        (37.9, second, True, False),
        (38.0, second, False, False),
        (51.9, second, False, False),
        (52.0, second, False, True),
        (99.0, second, False, True),
    ]


def test_a_stray_robot_is_nudged_again_for_a_new_request() -> None:
    memory = site(at(ONE, AT[B], 20.0), grants=EXPECTED, nudges={ONE: Nudge("r0", 2, 21.0)})
    assert wrong_pad.nudged(memory, 22.0, SITE).nudges == {ONE: Nudge("r1", 1, 22.0)}
    left = site(at(ONE, None, 50.0), grants=EXPECTED, nudges={ONE: Nudge("r1", 1, 22.0)})
    assert wrong_pad.nudged(left, 60.0, SITE).nudges == {ONE: Nudge("r1", 1, 22.0)}


# ---- COORDINATOR-WRONG-PAD-3, COORDINATOR-WRONG-PAD-4: robots that the coordinator cannot order to
# leave


@pytest.mark.parametrize("why", ["it works", "another node assigns", "we may not speak"])
def test_a_person_is_alerted_at_once_if_the_robot_cannot_be_nudged(why: str) -> None:
    standing = at(ONE, AT[B], 20.0, task="work" if why == "it works" else "")
    memory = site(standing, grants=EXPECTED)
    if why == "another node assigns":
        memory = replace(memory, alone=False)
    if why == "we may not speak":
        memory = replace(memory, may_speak=False)
    assert history(memory, 21.9, 22.0) == [(21.9, {}, False, False), (22.0, {}, False, True)]


def test_the_core_wakes_for_every_step_with_a_robot_astray() -> None:
    memory = site(at(ONE, AT[B], 20.0), grants=EXPECTED)
    dues = []
    for now in (21.0, 22.0, 37.0):
        memory = wrong_pad.nudged(memory, now, SITE)
        dues.append(sorted(wrong_pad.due(memory, SITE)))
    assert dues == [[22.0, 22.0, NEVER], [22.0, 23.0, 37.0, NEVER], [22.0, 38.0, 52.0, NEVER]]


# ---- COORDINATOR-WRONG-PAD-2: a robot without a station, on a pad for which another robot waits

WAITS = (Wish(ONE, "fleet"),)
BLOCKS = OnWrongPad(TWO, A, 90.0, A, 1, waiter=ONE)


def blocks(station: str) -> OnWrongPad:
    """Return the result of the core that robot TWO blocks this station."""
    return BLOCKS._replace(station=station, why=station)


def blocked(came_at: float = 30.0, **changes: object) -> SiteMemory:
    """Return a memory in which robot ONE waits for a station. Robot TWO stands at charger_a and does
    not charge."""
    return site(at(TWO, AT[A], came_at), **{"wishes": WAITS, **changes})


def test_a_robot_blocks_a_pad_some_time_after_its_arrival_or_its_release() -> None:
    assert found(blocked(), 89.9, 90.0, NEVER) == [[], [BLOCKS], [BLOCKS]]
    later = blocked(5.0, stations={A: shows(since=30.0), B: shows()})
    assert found(later, 89.9, 90.0, NEVER) == [[], [BLOCKS], [BLOCKS]]


def test_no_robot_blocks_a_pad_for_which_no_other_robot_waits() -> None:
    for wishes in ((), (Wish(TWO, "fleet"),)):
        assert found(blocked(wishes=wishes), NEVER) == [[]]
    has_another = blocked(grants={B: Grant(ONE, "r1", 10.0, shown=True)})
    assert found(has_another, NEVER) == [[]]


def test_the_pads_of_all_waiting_robots_are_checked_in_the_order_of_the_queue() -> None:
    """Robot THREE is first in the queue, and a station is already assigned to it. ONE and TWO wait. TWO
    stands on a pad."""
    memory = blocked(
        wishes=(Wish(THREE, "fleet"), Wish(TWO, "fleet"), Wish(ONE, "fleet")),
        grants={B: Grant(THREE, "r3", 10.0, shown=True)},
    )
    assert found(memory, 90.0) == [[BLOCKS]]
    memory = site(at(TWO, AT[B], 30.0), wishes=WAITS)
    assert found(memory, 90.0) == [[blocks(B)]]
    both = site(at(ONE, AT[A], 0.0), at(TWO, AT[B], 30.0), wishes=WAITS)
    assert found(both, 90.0) == [[blocks(B)]]


def test_a_station_that_serves_a_robot_or_was_never_heard_is_not_blocked() -> None:
    grant = Grant(THREE, "r3", 10.0, shown=True)
    not_blocked = [
        blocked(stations={A: shows(CHARGING)}),
        blocked(stations={B: shows()}),
        blocked(stations={A: shows(ASSIGNED)}, grants={A: grant}),
        blocked(grants={B: replace(grant, robot=TWO, started=True)}),
    ]
    assert [found(memory, NEVER) for memory in not_blocked] == [[[]]] * 4
    over = blocked(grants={A: replace(grant, over=True)})
    assert found(over, 90.0) == [[BLOCKS]]


def test_the_robot_without_a_station_blocks_a_pad_with_two_robots() -> None:
    grants = {B: Grant(THREE, "r3", 10.0, shown=True, started=True)}
    memory = site(at(THREE, AT[A], 0.0), at(TWO, AT[A], 30.0), wishes=WAITS, grants=grants)
    assert found(memory, 90.0) == [[BLOCKS]]


def test_a_robot_of_a_silent_fleet_blocks_the_pad_where_it_was_last_seen() -> None:
    memory = site(at(TWO, AT[A], 30.0, heard=60.0), wishes=WAITS)
    assert found(memory, 89.9, 90.0, NEVER) == [[], [BLOCKS], [BLOCKS]]
    before_our_start = replace(memory, robots={}, stood={TWO: AT[A]}, began_at=30.0)
    assert found(before_our_start, 89.9, 90.0, NEVER) == [[], [BLOCKS], [BLOCKS]]


def test_a_blocking_robot_is_nudged_once_and_then_a_person_is_told() -> None:
    memory, told = blocked(), {TWO: Nudge(A, 1, 90.0)}
    assert history(memory, 89.9, 90.0, 104.9, 105.0, 110.0) == [
        (89.9, {}, False, False),
        (90.0, told, False, False),
        (104.9, told, False, False),
        (105.0, told, False, True),
        (110.0, told, False, True),
    ]
    memory = wrong_pad.nudged(memory, 90.0, SITE)
    assert sorted(wrong_pad.due(memory, SITE)) == [90.0, 91.0, 105.0, NEVER]
    for place in (None, "wait_2"):
        gone = replace(memory, robots={TWO: at(TWO, place, 95.0)})
        assert wrong_pad.nudged(gone, 96.0, SITE).nudges == {}
    elsewhere = replace(memory, robots={TWO: at(TWO, AT[B], 30.0)})
    assert wrong_pad.nudged(elsewhere, 96.0, SITE).nudges == {TWO: Nudge(B, 1, 96.0)}
