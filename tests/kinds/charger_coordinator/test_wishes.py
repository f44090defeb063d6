"""Robots' wishes to be charged, rule by rule.

Each test builds a memory, and compares it with the memory after one report of a robot.
"""

import pytest
from msgspec.structs import replace

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator import wishes
from bridges.kinds.charger_coordinator.memory import (
    By,
    Grant,
    SiteLimits,
    SiteMemory,
    Standing,
    Wish,
)
from bridges.kinds.charger_coordinator.schedule import Charging, LocalTime
from bridges.kinds.charger_coordinator.signals import ChargeWanted, Sighting
from bridges.kinds.shared.durations import AGES_AGO
from tests.kinds.charger_coordinator.virtual_site import settings

NIGHT = Charging(at="22:00", until="05:00", robots=["tiny/AMR01"], percent=95.0)
SITE = SiteLimits.of(settings())
SCHEDULED = SiteLimits.of(settings(schedule=[NIGHT]))
ONE, TWO = RobotName("tiny", "AMR01"), RobotName("tiny", "AMR02")
A, B = "charger_a", "charger_b"
CALLED = Grant(ONE, "r1", 10.0, shown=True)
AT_NIGHT, AT_NOON = LocalTime(0, 23 * 60), LocalTime(0, 12 * 60)


def seen(
    place: str | None = "wait_1", percent: float = 50.0, task: str = "", charges: bool = False
) -> Sighting:
    """Return AMR01 as the coordinator reads it from a FleetState."""
    return Sighting(ONE, charges, place, percent, task)


def after(
    memory: SiteMemory, sighting: Sighting, now: float, site: SiteLimits = SITE
) -> SiteMemory:
    """Return the memory after this report of AMR01.

    The stored reports of the robots are those of `memory`, because a test compares only the other
    changes.
    """
    return replace(wishes.sighted(memory, sighting, now, site), robots=memory.robots)


# ---- COORDINATOR-1: an operator's request


def test_the_request_of_an_operator_counts_only_once() -> None:
    asked = ChargeWanted(ONE, B, "op-1", 30.0)
    wish = Wish(ONE, "operator", "", False, B, "op-1", 30.0)
    taken = SiteMemory(wishes=(Wish(TWO, "fleet"), wish), strikes={TWO: (A,)})
    before = replace(taken, wishes=taken.wishes[:1], strikes={TWO: (A,), ONE: (B,)})
    assert wishes.wanted(before, asked, SITE) == (taken, "")
    again = replace(taken, strikes={ONE: (B,)})
    assert wishes.wanted(again, asked, SITE) == (again, "")
    over = replace(before, over=("op-1",))
    assert wishes.wanted(over, asked, SITE) == (over, "request is over")
    three = RobotName("tiny", "AMR03")
    unsuited = (before, "station does not suit the robot")
    assert wishes.wanted(before, ChargeWanted(three, A, "op-2", 0.0), SITE) == unsuited
    unknown = (before, "unknown charger")
    assert wishes.wanted(before, ChargeWanted(three, "lost", "op-2", 0.0), SITE) == unknown


def test_a_newer_request_of_an_operator_takes_the_robot_from_another_station() -> None:
    wish = Wish(ONE, "operator", request_id="op-1")
    memory = SiteMemory(wishes=(wish, Wish(TWO, "fleet")), grants={A: CALLED})
    for station, grant in ((A, CALLED), ("", CALLED), (B, replace(CALLED, over=True))):
        changed, refused = wishes.wanted(memory, ChargeWanted(ONE, station, "op-2", 0.0), SITE)
        newer = Wish(ONE, "operator", station=station, request_id="op-2")
        assert (changed.wishes, refused) == ((newer, Wish(TWO, "fleet")), "")
        assert changed.grants == {A: grant}


def test_an_operator_withdraws_a_request_by_its_own_id_or_by_the_shown_id() -> None:
    wish = Wish(ONE, "operator", request_id="op-1")
    memory = SiteMemory(wishes=(wish, Wish(TWO, "fleet")), grants={A: CALLED}, over=("op-0",))
    left = replace(memory, wishes=memory.wishes[1:], grants={A: replace(CALLED, over=True)})
    withdrawn = replace(left, over=("op-0", "op-1"))
    assert wishes.unwanted(memory, "op-1") == (withdrawn, "")
    assert wishes.unwanted(memory, "r1") == (withdrawn, "")
    assert wishes.unwanted(memory, "op-0") == (memory, "")
    assert wishes.unwanted(memory, "op-9") == (memory, "no such request")
    assert wishes.unwanted(memory, "") == (memory, "no such request")
    assert wishes.unwanted(left, "r1") == (left, "no such request")


# ---- COORDINATOR-WISHES-5: whether a robot came after the coordinator had called it


@pytest.mark.parametrize(
    ("place", "since", "task", "by", "stays"),
    [
        ("wait_1", 5.0, "", "fleet", True),
        ("wait_1", 10.0, "", "fleet", True),
        ("wait_1", 10.5, "", "fleet", False),
        ("charger_a", 5.0, "", "fleet", False),
        ("dock_b", 5.0, "", "schedule", True),
        (None, 5.0, "", "fleet", True),
        ("wait_1", 5.0, "work", "fleet", False),
        ("wait_1", 5.0, "", "operator", False),
    ],
)
def test_a_robot_without_a_task_that_has_not_moved_since_its_call_stays_away(
    place: str | None, since: float, task: str, by: By, stays: bool
) -> None:
    standing = Standing(seen(place, task=task), 60.0, since, since)
    memory = SiteMemory(robots={ONE: standing}, wishes=(Wish(ONE, by),), grants={A: CALLED})
    assert wishes.stays_away(memory, A, CALLED, SITE) is stays


def test_a_robot_that_is_not_seen_or_wants_nothing_does_not_stay_away() -> None:
    standing = Standing(seen(), 60.0)
    for memory in (SiteMemory(wishes=(Wish(ONE, "fleet"),)), SiteMemory(robots={ONE: standing})):
        assert wishes.stays_away(memory, A, CALLED, SITE) is False


def test_a_robot_that_did_not_come_gets_no_call_for_ten_minutes() -> None:
    memory = SiteMemory(
        wishes=(Wish(TWO, "fleet"), Wish(ONE, "fleet")),
        grants={A: replace(CALLED, sent_at=60.0)},
        absent={TWO: 300.0},
    )
    assert wishes.gives_up(memory, ONE, 70.0) == replace(
        memory,
        wishes=(Wish(TWO, "fleet"),),
        grants={A: replace(CALLED, over=True, sent_at=AGES_AGO)},
        absent={TWO: 300.0, ONE: 670.0},
    )


# ---- COORDINATOR-WISHES-2, COORDINATOR-WISHES-3: a charged robot


def charged(by: By = "fleet", **changes: object) -> SiteMemory:
    """Return a memory in which AMR01 charges at charger_a during its task "t1".

    AMR01 has failed at charger_b before.
    """
    return SiteMemory(
        wishes=(Wish(ONE, by, "t1"), Wish(TWO, "fleet")),
        grants={A: Grant(ONE, "r1", 10.0, shown=True, started=True, sent_at=10.0)},
        strikes={ONE: (B,), TWO: (A,)},
        robots={ONE: Standing(seen("charger_a", 99.0, "t1", True), 20.0)},
        **changes,  # type: ignore[arg-type]
    )


@pytest.mark.parametrize("by", ["fleet", "operator"])
def test_a_full_robot_counts_as_served_and_its_failures_are_forgotten(by: By) -> None:
    memory = charged(by)
    assert after(memory, seen("charger_a", 100.0, "t1", True), 30.0) == replace(
        memory,
        wishes=(Wish(TWO, "fleet"),),
        grants={A: replace(memory.grants[A], over=True, sent_at=AGES_AGO)},
        strikes={TWO: (A,)},
        served={ONE: "t1"},
    )
    assert after(memory, seen("charger_a", 99.9, "t1", True), 30.0) == memory


def test_a_robot_that_the_schedule_has_charged_far_enough_counts_as_served() -> None:
    memory = charged("schedule", when=AT_NIGHT)
    enough = after(memory, seen("charger_a", 95.0, "t1", True), 30.0, SCHEDULED)
    assert (enough.served, enough.reached) == ({ONE: "t1"}, {ONE: 95.0})
    assert after(memory, seen("charger_a", 94.9, "t1", True), 30.0, SCHEDULED) == memory


def test_a_robot_that_leaves_before_it_is_full_does_not_count_as_served() -> None:
    memory = charged()
    assert after(memory, seen(None, 99.0, "t2"), 30.0) == replace(
        memory,
        wishes=(Wish(TWO, "fleet"),),
        grants={A: replace(memory.grants[A], over=True, sent_at=AGES_AGO)},
    )


def test_a_robot_charged_by_the_schedule_rests_until_the_end_of_the_scheduled_time() -> None:
    memory = charged("schedule", when=AT_NIGHT)
    for site, reached in ((SCHEDULED, {ONE: 95.0}), (SITE, {})):
        assert wishes.fulfilled(memory, ONE, site).reached == reached
    by_day = replace(memory, when=AT_NOON, reached={TWO: 95.0})
    assert wishes.fulfilled(by_day, ONE, SCHEDULED).reached == {TWO: 95.0}
    two = replace(memory, reached={ONE: 95.0})
    assert wishes.fulfilled(two, TWO, SCHEDULED).reached == {ONE: 95.0}
    both = replace(memory, reached={TWO: 70.0, ONE: 99.0})
    assert wishes.fulfilled(both, ONE, SCHEDULED).reached == {TWO: 70.0, ONE: 99.0}


@pytest.mark.parametrize(
    ("sighting", "rests"),
    [
        (seen(percent=94.9), True),
        (seen(percent=94.9, task="t2"), True),
        (seen(None, percent=94.9), True),
        (seen(None, percent=94.9, task="t2"), False),
        (seen(None, percent=96.0, task="t2"), False),
    ],
)
def test_a_robot_rests_until_its_next_task(sighting: Sighting, rests: bool) -> None:
    memory = SiteMemory(when=AT_NIGHT, reached={ONE: 95.0, TWO: 95.0})
    reached = after(memory, sighting, 30.0, SCHEDULED).reached
    assert reached == ({ONE: 95.0, TWO: 95.0} if rests else {TWO: 95.0})


def test_a_robot_that_is_full_enough_rests_only_during_the_scheduled_time() -> None:
    for when, percent, reached in (
        (AT_NIGHT, 96.0, {ONE: 95.0, TWO: 95.0}),
        (AT_NIGHT, 95.0, {ONE: 95.0, TWO: 95.0}),
        (AT_NIGHT, 94.9, {TWO: 95.0}),
        (AT_NOON, 100.0, {TWO: 95.0}),
        (None, 100.0, {TWO: 95.0}),
    ):
        memory = SiteMemory(when=when, reached={TWO: 95.0})
        assert after(memory, seen(percent=percent), 30.0, SCHEDULED).reached == reached
    over = SiteMemory(when=AT_NOON, reached={ONE: 95.0, TWO: 95.0})
    assert after(over, seen(), 30.0, SCHEDULED).reached == {TWO: 95.0}


@pytest.mark.parametrize(
    ("begins", "percent", "again"),
    [("02:00", 70.0, True), ("23:00", 75.0, True), ("02:00", 100.0, False)],
)
def test_a_later_entry_with_a_higher_percentage_charges_a_robot_again(
    begins: str, percent: float, again: bool
) -> None:
    evening = Charging(at="20:00", until="02:00" if begins == "02:00" else "06:00", percent=70.0)
    entries = [evening, Charging(at=begins, until="06:00", percent=100.0)]
    site = SiteLimits.of(settings(schedule=entries, again_percent=50.0))
    memory = SiteMemory(when=LocalTime(0, 21 * 60), robots={ONE: Standing(seen(), 10.0)})
    rests = after(memory, seen(percent=percent), 30.0, site)
    assert rests.wishes == ()
    later = replace(rests, when=LocalTime(1, 3 * 60))
    found = after(later, seen(percent=percent), 30.0, site).wishes
    assert found == ((Wish(ONE, "schedule"),) if again else ())


@pytest.mark.parametrize(
    ("sighting", "served"),
    [
        (seen(None, task="t2"), {TWO: "t9"}),
        (seen(None, task="t1"), {ONE: "t1", TWO: "t9"}),
        (seen(None), {ONE: "t1", TWO: "t9"}),
        (seen("wait_1", 95.0, "t2"), {ONE: "t1", TWO: "t9"}),
    ],
)
def test_a_served_robot_that_left_in_another_task_is_not_remembered_as_served(
    sighting: Sighting, served: dict[RobotName, str]
) -> None:
    memory = SiteMemory(served={ONE: "t1", TWO: "t9"})
    assert after(memory, sighting, 30.0).served == served


# ---- COORDINATOR-WISHES-4: a robot that begins a task after its wish to be charged

IDLE_WISH = Wish(ONE, "fleet")
ON_ITS_WAY = Wish(ONE, "fleet", "t2", called=True)


@pytest.mark.parametrize(
    ("wish", "changed", "now", "then"),
    [
        (IDLE_WISH, {}, 69.9, ON_ITS_WAY),
        (IDLE_WISH, {}, 70.0, None),
        (IDLE_WISH, {"started": True}, 20.0, None),
        (IDLE_WISH, {"over": True}, 20.0, None),
        (Wish(ONE, "operator"), {}, 20.0, Wish(ONE, "operator")),
        (Wish(ONE, "fleet", "t1"), {}, 20.0, None),
    ],
)
def test_a_task_that_begins_soon_after_the_call_is_the_drive_to_the_station(
    wish: Wish, changed: dict[str, bool], now: float, then: Wish | None
) -> None:
    two = Wish(TWO, "fleet")
    memory = SiteMemory(wishes=(two, wish), grants={A: replace(CALLED, **changed)})
    found = after(memory, seen(None, task="t2"), now).wishes
    assert found == (two, then) if then else found == (two,)


# ---- COORDINATOR-WISHES-1, COORDINATOR-WISHES-2, COORDINATOR-WISHES-3: how a wish begins


def test_a_wish_begins_after_the_robot_has_stood_at_the_charger_for_two_seconds() -> None:
    memory = SiteMemory(
        robots={ONE: Standing(seen(), 12.0, 11.0, 11.0)},
        served={ONE: "t0"},
        absent={ONE: 5.0, TWO: 99.0},
    )
    assert after(memory, seen(), 12.9) == memory
    begun = replace(memory, wishes=(Wish(ONE, "fleet"),), served={}, absent={TWO: 99.0})
    assert after(memory, seen(), 13.0) == begun


@pytest.mark.parametrize(
    ("changed", "since", "here_since"),
    [
        (seen("wait_1", 49.0, "t1", True), 5.0, 4.0),
        (seen("wait_1", 50.0, "t2", True), 9.0, 4.0),
        (seen("wait_1", 50.0, "t1", False), 9.0, 4.0),
        (seen("wait_2", 50.0, "t1", True), 9.0, 9.0),
    ],
)
def test_the_memory_has_the_time_since_a_robot_has_stood_and_done_the_same(
    changed: Sighting, since: float, here_since: float
) -> None:
    memory = SiteMemory(robots={ONE: Standing(seen("wait_1", 50.0, "t1", True), 8.0, 5.0, 4.0)})
    found = wishes.sighted(memory, changed, 9.0, SITE).robots
    assert found == {ONE: Standing(changed, 9.0, since, here_since)}


@pytest.mark.parametrize(
    ("sighting", "changes", "by"),
    [
        (seen(percent=89.9), {}, "fleet"),
        (seen(percent=90.0), {}, None),
        (seen(None, percent=10.0), {}, None),
        (seen(percent=10.0, task="work"), {}, None),
        (seen(percent=10.0, task="t1", charges=True), {}, "fleet"),
        (seen(percent=99.9, task="t1", charges=True), {}, "fleet"),
        (seen(percent=100.0, task="t1", charges=True), {}, None),
        (seen(percent=99.9, task="t1", charges=True), {"served": {ONE: "t1"}}, None),
        (seen(percent=89.9, task="t1", charges=True), {"served": {ONE: "t1"}}, "fleet"),
        (seen(percent=10.0), {"absent": {ONE: 30.1}}, None),
        (seen(percent=10.0), {"absent": {ONE: 30.0}}, "fleet"),
        (seen(percent=10.0), {"absent": {TWO: 99.0}}, "fleet"),
        (seen(percent=10.0, charges=True), {"absent": {ONE: 99.0}}, "fleet"),
        (seen(percent=10.0), {"strikes": {ONE: (A, B)}}, None),
        (seen(percent=10.0), {"strikes": {ONE: (A,), TWO: (A, B)}}, "fleet"),
        (seen(percent=94.9), {"when": AT_NIGHT}, "schedule"),
        (seen(percent=10.0), {"when": AT_NIGHT}, "schedule"),
        (seen(percent=95.0), {"when": AT_NIGHT}, None),
        (seen(percent=94.9), {"when": AT_NOON}, None),
        (seen(percent=94.9), {"when": AT_NIGHT, "reached": {ONE: 95.0}}, None),
        (seen(percent=94.9), {"when": AT_NIGHT, "reached": {ONE: 94.0}}, "schedule"),
        (seen(percent=94.9), {"when": AT_NIGHT, "reached": {TWO: 95.0}}, "schedule"),
        (seen(percent=80.0), {"when": AT_NIGHT, "reached": {ONE: 95.0}}, "fleet"),
        (seen(percent=9.0, charges=True), {"preferred": {ONE: A}, "alone": False}, "fleet"),
    ],
)
def test_battery_task_and_schedule_decide_whether_a_standing_robot_has_a_wish(
    sighting: Sighting, changes: dict[str, object], by: By | None
) -> None:
    before = SiteMemory(robots={ONE: Standing(sighting, 29.0)}, **changes)  # type: ignore[arg-type]
    found = wishes.sighted(before, sighting, 30.0, SCHEDULED).wishes
    assert found == (() if by is None else (Wish(ONE, by, sighting.task_id),))


@pytest.mark.parametrize(
    ("task", "now", "believed"), [("t1", 999.0, False), ("t2", 309.9, False), ("t2", 310.0, True)]
)
def test_the_mode_of_a_served_robot_is_believed_after_five_minutes_in_another_task(
    task: str, now: float, believed: bool
) -> None:
    sighting = seen("charger_a", 95.0, task, True)
    memory = SiteMemory(robots={ONE: Standing(sighting, 10.0, 10.0, 5.0)}, served={ONE: "t1"})
    found = (Wish(ONE, "fleet", task),) if believed else ()
    assert after(memory, sighting, now).wishes == found


# ---- COORDINATOR-WISHES-4: a robot that still wants to be charged


@pytest.mark.parametrize(
    ("wish", "sighting", "station", "lasts"),
    [
        (Wish(ONE, "fleet", "t1"), seen(task="t1", charges=True), "", True),
        (Wish(ONE, "fleet", "t1"), seen(task="t2", charges=True), "", True),
        (Wish(ONE, "fleet", "t1"), seen(task="t1"), "", False),
        (ON_ITS_WAY, seen(task="t2"), A, True),
        (ON_ITS_WAY, seen(task="t3"), A, False),
        (Wish(ONE, "fleet", "t1"), seen(), "", True),
        (Wish(ONE, "fleet", "t1"), seen(None, task="t1", charges=True), "", True),
        (Wish(ONE, "fleet", "t1"), seen(None, task="t2", charges=True), "", False),
        (Wish(ONE, "fleet", "t1"), seen(None), A, False),
        (Wish(ONE, "fleet"), seen(None), A, True),
        (Wish(ONE, "fleet"), seen(None), "", False),
        (Wish(ONE, "fleet", "t1"), seen(percent=99.9, task="t1", charges=True), "", True),
        (Wish(ONE, "fleet", "t1"), seen(percent=100.0, task="t1", charges=True), "", False),
        (Wish(ONE, "schedule"), seen(percent=94.9), "", True),
        (Wish(ONE, "schedule"), seen(percent=95.0), "", False),
    ],
)
def test_a_wish_lasts_while_the_robot_stands_at_the_charger_or_drives_to_it(
    wish: Wish, sighting: Sighting, station: str, lasts: bool
) -> None:
    grants = {station: replace(CALLED, made_at=-99.0)} if station else {}
    memory = SiteMemory(wishes=(wish,), grants=grants, when=AT_NIGHT)
    assert wishes.sighted(memory, sighting, 30.0, SCHEDULED).wishes[:1] == (
        (wish,) if lasts else ()
    )


def test_a_scheduled_wish_lasts_after_its_time_while_the_battery_is_low() -> None:
    memory = SiteMemory(wishes=(Wish(ONE, "schedule"),), when=AT_NOON)
    for percent, left in ((89.9, memory.wishes), (90.0, ())):
        assert after(memory, seen(percent=percent), 30.0, SCHEDULED).wishes == left
    without_schedule = after(memory, seen(percent=99.9), 30.0, SITE)
    assert without_schedule.wishes == memory.wishes
