"""The effects of a ChargerState on its request, which goes on, ends or fails. After a failure the core
also decides whether the station or the robot is at fault.

Each test builds a memory, and lets a station show a state. Then the test compares the whole memory.
"""

import pytest
from msgspec.structs import replace

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator import stations
from bridges.kinds.charger_coordinator.memory import (
    ASSIGNED,
    CHARGING,
    ERROR,
    IDLE,
    RELEASED,
    By,
    Grant,
    SiteLimits,
    SiteMemory,
    Standing,
    StationSeen,
    Wish,
)
from bridges.kinds.charger_coordinator.signals import ChargerStateHeard, Sighting
from bridges.kinds.shared.durations import AGES_AGO, NEVER
from tests.kinds.charger_coordinator.virtual_site import settings

SITE = SiteLimits.of(settings())
ONE, TWO = RobotName("tiny", "AMR01"), RobotName("tiny", "AMR02")
A, B = "charger_a", "charger_b"
WISHES = (Wish(ONE, "fleet"), Wish(TWO, "fleet"))
GRANT = Grant(ONE, "r1", 10.0, 60.0, shown=True, sent_at=10.0)
LOST, MISPLACED = "Charger unreachable", "wrong docking: tiny/AMR02 is not assigned here"


def at(who: RobotName, place: str | None, since: float = AGES_AGO) -> Standing:
    """Return a robot without a task. Its fleet has reported it at `place` since the time `since`."""
    return Standing(Sighting(who, False, place, 50.0, ""), 20.0, since, since)


def site(**changes: object) -> SiteMemory:
    """Return a memory in which charger_a is assigned to AMR01, and AMR02 waits for a station. Both
    robots stand at their waiting places."""
    robots = {ONE: at(ONE, "wait_1"), TWO: at(TWO, "wait_2")}
    known = {"may_speak": True, "wishes": WISHES, "grants": {A: GRANT}, "robots": robots}
    return SiteMemory(**{**known, **changes})  # type: ignore[arg-type]


def shows(state: int, error: str = "", since: float = 10.0, heard: float = 20.0) -> StationSeen:
    return StationSeen(ChargerStateHeard(A, state).state, "r1", ONE, error, heard, since)  # type: ignore[arg-type]


def after(memory: SiteMemory, state: int, error: str = "", request_id: str = "r1") -> SiteMemory:
    """Return the memory after charger_a has shown this state at 30 s.

    The stored states of the stations are those of `memory`, because a test compares only the other
    changes.
    """
    heard = ChargerStateHeard(A, state, request_id, ONE, error)  # type: ignore[arg-type]
    return replace(stations.heard(memory, heard, 30.0, SITE), stations=memory.stations)


def test_the_memory_has_the_state_of_a_station_with_its_beginning_and_remaining_time() -> None:
    heard = ChargerStateHeard(B, CHARGING, "r9", TWO, "", 720.0)
    first = stations.heard(SiteMemory(), heard, 30.0, SITE)
    assert first.stations == {B: StationSeen(CHARGING, "r9", TWO, "", 30.0, 30.0, 720.0)}
    again = stations.heard(first, replace(heard, full_in_s=719.0), 31.0, SITE)
    assert again.stations == {B: StationSeen(CHARGING, "r9", TWO, "", 31.0, 30.0, 719.0)}
    error = stations.heard(again, ChargerStateHeard(B, ERROR, "r9", TWO, "fan"), 32.0, SITE)
    assert error.stations == {B: StationSeen(ERROR, "r9", TWO, "fan", 32.0, 32.0, 0.0)}


# ---- COORDINATOR-STATIONS-1, COORDINATOR-STATIONS-2: how a request ends


def test_a_shown_request_counts_as_accepted_and_begins_with_the_charge() -> None:
    memory = site(grants={A: replace(GRANT, shown=False)})
    assert after(memory, ASSIGNED) == replace(memory, grants={A: GRANT})
    assert after(memory, CHARGING) == replace(memory, grants={A: replace(GRANT, started=True)})


@pytest.mark.parametrize(
    ("by", "place", "queue", "strikes"),
    [
        ("fleet", "wait_1", (TWO, ONE), {}),
        ("schedule", "wait_1", (TWO, ONE), {}),
        ("operator", "wait_1", (TWO,), {}),
        ("fleet", None, (TWO,), {}),
        ("fleet", "charger_a", (TWO, ONE), {ONE: (A,)}),
        ("fleet", "dock_b", (TWO, ONE), {}),
    ],
)
def test_a_robot_released_without_a_charge_did_not_come_or_has_failed(
    by: By,
    place: str | None,
    queue: tuple[RobotName, ...],
    strikes: dict[RobotName, tuple[str, ...]],
) -> None:
    wishes = (Wish(ONE, by), Wish(TWO, "fleet"))
    memory = site(wishes=wishes, robots={ONE: at(ONE, place), TWO: at(TWO, "wait_2")})
    found = after(memory, RELEASED)
    assert [wish.robot for wish in found.wishes] == list(queue)
    assert found == replace(
        memory, wishes=found.wishes, strikes=strikes, grants={A: replace(GRANT, over=True)}
    )


def test_a_station_that_forgets_a_charge_of_the_robot_on_its_pad_is_asked_again() -> None:
    grant = replace(GRANT, request_id="charger_coordinator/tiny/AMR01/1", started=True)
    memory = site(grants={A: grant}, robots={ONE: at(ONE, "charger_a")})
    assert after(memory, IDLE, request_id="").grants == {
        A: replace(grant, shown=False, started=False, sent_at=AGES_AGO, forgotten_at=30.0)
    }


def test_a_charge_that_ends_fulfils_the_wish() -> None:
    memory = site(grants={A: replace(GRANT, started=True)}, strikes={ONE: (B,)})
    over = replace(GRANT, started=True, over=True)
    assert after(memory, RELEASED) == replace(
        memory, wishes=WISHES[1:], grants={A: over}, strikes={}, served={ONE: ""}
    )
    assert after(memory, IDLE) == replace(
        memory, wishes=WISHES[1:], grants={}, strikes={}, served={ONE: ""}
    )


@pytest.mark.parametrize(
    ("error", "before", "strikes", "waits"),
    [
        ("station: fan", {}, {}, True),
        ("robot: NTC", {}, {ONE: (A,)}, True),
        ("over temperature", {TWO: (B,)}, {TWO: (B,), ONE: (A,)}, True),
        ("robot: NTC", {ONE: (B,)}, {ONE: (B, A)}, False),
    ],
)
def test_after_an_error_the_station_must_release_the_robot_which_keeps_its_place_in_the_queue(
    error: str,
    before: dict[RobotName, tuple[str, ...]],
    strikes: dict[RobotName, tuple[str, ...]],
    waits: bool,
) -> None:
    memory = site(strikes=before)
    assert after(memory, ERROR, error) == replace(
        memory,
        wishes=WISHES if waits else WISHES[1:],
        strikes=strikes,
        grants={A: replace(GRANT, over=True, sent_at=AGES_AGO)},
    )


@pytest.mark.parametrize("error", [LOST, MISPLACED])
def test_a_station_that_is_unreachable_or_occupied_keeps_the_request(error: str) -> None:
    assert after(site(), ERROR, error) == site()


# ---- COORDINATOR-6: requests of other nodes


@pytest.mark.parametrize(("state", "started"), [(ASSIGNED, False), (CHARGING, True)])
def test_a_charge_without_a_name_belongs_to_the_robot_waiting_at_the_pad(
    state: int, started: bool
) -> None:
    robots = {who: at(who, "charger_a") for who in (ONE, TWO)}
    seen = StationSeen(shows(state).state, "r9", None, "", 20.0, 10.0)
    memory = site(grants={B: GRANT}, robots=robots, stations={A: seen})
    granted = Grant(TWO, "r9", 30.0, shown=True, started=started)
    assert stations.adopted(memory, 30.0, SITE).grants == {B: GRANT, A: granted}


# ---- COORDINATOR-3, COORDINATOR-STATIONS-4: time limits


@pytest.mark.parametrize(
    ("seen", "timeout_s", "at_"),
    [
        (None, 60.0, 42.0),
        (shows(ASSIGNED), 60.0, 55.0),
        (shows(ERROR, "station: fan"), 60.0, 55.0),
        (shows(ERROR, LOST), 60.0, 40.0),
        (shows(ERROR, LOST, since=18.0, heard=18.0), 60.0, 48.0),
        (shows(ERROR, MISPLACED, heard=99.0), 60.0, 70.0),
        (shows(ERROR, MISPLACED, heard=99.0), 20.0, 40.0),
        (shows(ERROR, MISPLACED), 60.0, 55.0),
    ],
)
def test_a_station_that_is_silent_or_lost_or_blocked_for_long_has_no_hope(
    seen: StationSeen | None, timeout_s: float, at_: float
) -> None:
    known = {B: shows(ERROR, LOST, since=1.0, heard=1.0)} | ({A: seen} if seen else {})
    grant = replace(GRANT, start_timeout_s=timeout_s)
    memory = site(began_at=7.0, stations=known, grants={A: grant})
    assert stations.hopeless_at(memory, A, grant) == at_


def test_a_robot_that_stays_away_loses_its_station_a_minute_after_its_call() -> None:
    coming = site(robots={ONE: at(ONE, "wait_1", 15.0)})
    not_shown = replace(GRANT, shown=False)
    assert [
        stations.absent_at(site(), A, GRANT, SITE),
        stations.absent_at(coming, A, GRANT, SITE),
        stations.absent_at(site(may_speak=False), A, GRANT, SITE),
        stations.absent_at(site(grants={A: not_shown}), A, not_shown, SITE),
    ] == [70.0, NEVER, NEVER, NEVER]


def test_a_station_that_does_not_accept_a_request_is_passed_over_for_a_while() -> None:
    memory = site(grants={A: replace(GRANT, shown=False)}, shunned={B: 5.0})
    passed_over = replace(
        memory, grants={}, shunned={B: 5.0, A: 50.0}, wishes=(WISHES[1], WISHES[0])
    )
    assert stations.in_time(memory, 19.9, SITE) == memory
    assert stations.in_time(memory, 20.0, SITE) == passed_over
    quiet = replace(memory, may_speak=False)
    assert stations.in_time(quiet, 99.0, SITE) == quiet


@pytest.mark.parametrize(("error", "at_"), [(LOST, 40.0), (MISPLACED, 70.0)])
def test_a_station_without_hope_must_release_the_robot_which_keeps_its_place_in_the_queue(
    error: str, at_: float
) -> None:
    robots = {ONE: at(ONE, "wait_1", 15.0)}
    memory = site(stations={A: shows(ERROR, error, heard=99.0)}, robots=robots)
    let_go = replace(memory, grants={A: replace(GRANT, over=True, sent_at=AGES_AGO)})
    assert stations.in_time(memory, at_ - 0.1, SITE) == memory
    assert stations.in_time(memory, at_, SITE) == let_go


def test_an_unreachable_station_that_shows_no_request_keeps_its_charging_robot() -> None:
    """COORDINATOR-STATIONS-4: its restarted daemon does not know whether the charge goes on."""
    charging = site(grants={A: replace(GRANT, started=True)})
    assert after(charging, ERROR, LOST, request_id="") == charging


@pytest.mark.parametrize(
    ("place", "since", "seen_at", "loses"),
    [
        ("wait_1", 25.0, 40.0, True),
        (None, 25.0, 40.0, True),
        ("wait_1", 25.0, 39.9, False),
        ("wait_1", 30.1, 40.0, False),
        ("charger_a", 25.0, 90.0, False),
    ],
)
def test_a_robot_loses_the_lost_station_that_charged_it_once_its_fleet_has_seen_it_elsewhere(
    place: str | None, since: float, seen_at: float, loses: bool
) -> None:
    charging = replace(GRANT, started=True)
    known = {A: shows(ERROR, LOST, heard=89.0)}
    robots = {ONE: replace(at(ONE, place, since), at=seen_at)}
    memory = site(grants={A: charging}, stations=known, robots=robots)
    left = replace(memory, grants={A: replace(charging, over=True, sent_at=AGES_AGO)})
    assert stations.in_time(memory, 90.0, SITE) == (left if loses else memory)
    unseen = replace(memory, robots={})
    assert stations.in_time(unseen, 90.0, SITE) == unseen


@pytest.mark.parametrize(("seen_at", "loses"), [(69.9, False), (70.0, True)])
def test_a_robot_loses_the_station_that_charged_it_if_another_robot_keeps_its_pad(
    seen_at: float, loses: bool
) -> None:
    robots = {ONE: replace(at(ONE, "wait_1", 25.0), at=seen_at)}
    known = {A: shows(ERROR, MISPLACED, heard=89.0)}
    memory = site(grants={A: replace(GRANT, started=True)}, stations=known, robots=robots)
    assert stations.in_time(memory, 90.0, SITE).grants[A].over is loses


def test_a_robot_that_stays_away_is_given_up() -> None:
    memory = site(stations={A: shows(ASSIGNED, heard=69.0)})
    assert stations.in_time(memory, 69.9, SITE) == memory
    assert stations.in_time(memory, 70.0, SITE) == replace(
        memory,
        wishes=WISHES[1:],
        grants={A: replace(GRANT, over=True, sent_at=AGES_AGO)},
        absent={ONE: 670.0},
    )


def test_a_time_limit_ends_no_charge_but_ends_the_next_request() -> None:
    second = Grant(TWO, "r2", 10.0, 60.0)
    for first in (replace(GRANT, started=True), replace(GRANT, over=True)):
        memory = site(grants={A: first, B: second}, stations={})
        assert stations.in_time(memory, 99.0, SITE).grants == {A: first}


# ---- COORDINATOR-STATIONS-2, COORDINATOR-STATIONS-3: whether the station or the robot is at fault


@pytest.mark.parametrize(
    ("state", "error", "strikes"),
    [
        (ERROR, "station: fan", {ONE: (B,), TWO: (B,)}),
        (ERROR, "out of service after: station: fan", {ONE: (B,), TWO: (B,)}),
        (ERROR, "over temperature", {ONE: (A, B), TWO: (B,)}),
        (ERROR, "out of service after: over temperature", {ONE: (A, B), TWO: (B,)}),
        (IDLE, "", {ONE: (A, B), TWO: (B,)}),
    ],
)
def test_an_error_on_the_side_of_the_station_accuses_no_robot(
    state: int, error: str, strikes: dict[RobotName, tuple[str, ...]]
) -> None:
    memory = site(grants={}, strikes={ONE: (A, B), TWO: (B,)})
    assert after(memory, state, error).strikes == strikes
    alone = site(grants={}, strikes={ONE: (A,)})
    assert after(alone, ERROR, "station: fan").strikes == {}


@pytest.mark.parametrize(
    ("error", "robot", "acquitted"),
    [
        ("over temperature", at(ONE, "wait_1", 20.0), True),
        ("station: fan", at(ONE, "wait_1", 20.0), True),
        ("over temperature", at(ONE, "wait_1", 20.1), False),
        ("over temperature", at(ONE, "charger_a", 5.0), False),
        ("robot: NTC", at(ONE, "wait_1", 20.0), False),
        ("over temperature", at(TWO, "wait_2", 20.0), False),
    ],
)
def test_a_station_that_recovers_after_its_robot_has_left_accuses_no_robot(
    error: str, robot: Standing, acquitted: bool
) -> None:
    memory = site(
        grants={},
        strikes={ONE: (A,)},
        robots={robot.sighting.who: robot},
        stations={A: shows(ERROR, error)},
    )
    assert after(memory, IDLE).strikes == ({} if acquitted else {ONE: (A,)})


def test_a_robot_that_has_been_charged_for_a_while_has_not_failed() -> None:
    charging = replace(GRANT, started=True)
    memory = site(grants={A: charging}, strikes={ONE: (B,), TWO: (B,)})
    seen = {A: shows(CHARGING, since=15.0), B: shows(CHARGING, since=0.0)}
    memory = replace(memory, stations=seen)
    assert [stations.proven_at(memory, who) for who in (ONE, TWO)] == [25.0, NEVER]
    assert stations.in_time(memory, 24.9, SITE) == memory
    assert stations.in_time(memory, 25.0, SITE) == replace(memory, strikes={TWO: (B,)})
    for unproven in (
        replace(memory, grants={A: GRANT}),
        replace(memory, stations={A: shows(ASSIGNED)}),
        replace(memory, stations={}),
    ):
        assert stations.proven_at(unproven, ONE) == NEVER
