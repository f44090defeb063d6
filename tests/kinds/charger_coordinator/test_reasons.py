"""The complete texts that tell why a robot waits in the queue."""

from msgspec.structs import replace

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator.memory import (
    ASSIGNED,
    CHARGING,
    ERROR,
    IDLE,
    Grant,
    SiteLimits,
    SiteMemory,
    Standing,
    StationSeen,
    Wish,
)
from bridges.kinds.charger_coordinator.queue import queued
from bridges.kinds.charger_coordinator.reasons import reasons
from bridges.kinds.charger_coordinator.schedule import Charging
from bridges.kinds.charger_coordinator.signals import Sighting
from bridges.messages.definitions import ChargerStateValue
from tests.kinds.charger_coordinator.virtual_site import settings

ONE, TWO, THREE = (RobotName("tiny", f"AMR0{i}") for i in (1, 2, 3))
X, Y = RobotName("big", "X"), RobotName("big", "Y")


def site(stations: int) -> SiteLimits:
    """Return the limits of a site with this number of stations. Every robot may use every station."""
    names = tuple(f"s{i + 1}" for i in range(stations))
    robots = dict.fromkeys((ONE, TWO, THREE), names)
    places: dict[str, dict[str, str]] = {name: {} for name in names}
    return SiteLimits(robots, {}, places, {}, 60.0, 100.0, 90.0, 60.0)


def shows(state: ChargerStateValue, full_in_s: float = 0.0) -> StationSeen:
    return StationSeen(state, "", None, "", 10.0, 0.0, full_in_s)


BUSY = SiteMemory(
    may_speak=True,
    wishes=tuple(Wish(who, "fleet") for who in (ONE, THREE, TWO)),
    grants={
        "s1": Grant(X, "r1", 0.0, started=True),
        "s2": Grant(Y, "r2", 0.0, started=True),
        "s4": Grant(THREE, "r3", 0.0),
    },
    stations={
        "s1": shows(CHARGING, 609.0),
        "s2": shows(CHARGING, 90.0),
        "s4": shows(ASSIGNED, 9.0),
        "s5": shows(ERROR),
        "s6": shows(IDLE),
    },
    shunned={"s6": 13.0},
)


def test_the_report_tells_each_waiting_robot_its_obstacle_and_its_next_station() -> None:
    assert [wish.robot for wish in queued(BUSY)] == [ONE, TWO]
    why = "s1 charges big/X, s2 charges big/Y, s3 is silent, s4 is assigned to tiny/AMR03"
    assert list(reasons(BUSY, 12.0, site(6))) == [
        f"tiny/AMR01 by the robot: {why}, and 2 more, s2 is free in 88 s",
        f"tiny/AMR02 by the robot: {why}, and 2 more, s1 is free in 10 min",
    ]
    four = list(reasons(BUSY, 12.0, site(4)))
    assert four[0] == f"tiny/AMR01 by the robot: {why}, s2 is free in 88 s"


def test_the_station_at_the_place_of_the_robot_comes_first_and_is_not_occupied_by_it() -> None:
    last_two = {name: BUSY.stations[name] for name in ("s5", "s6")}
    stands_there = Standing(Sighting(ONE, False, "p6", 50.0, ""), 10.0)
    memory = SiteMemory(
        may_speak=True,
        wishes=BUSY.wishes[:1],
        stations=last_two,
        shunned=BUSY.shunned,
        robots={ONE: stands_there},
    )
    places = {"s5": {"tiny": "p5"}, "s6": {"tiny": "p6"}}
    two = SiteLimits({ONE: ("s5", "s6")}, {}, places, {}, 60.0, 100.0, 90.0, 60.0)
    assert [list(reasons(memory, now, two)) for now in (12.0, 13.0)] == [
        ["tiny/AMR01 by the robot: s6 takes no request, s5 is out of service"],
        ["tiny/AMR01 by the robot: s6 is not free yet, s5 is out of service"],
    ]


def test_without_permission_to_publish_robots_wait_for_the_permission() -> None:
    memory = replace(BUSY, may_speak=False, passive="until rival leaves")
    assert list(reasons(memory, 12.0, site(6))) == [
        "tiny/AMR01 by the robot: until rival leaves",
        "tiny/AMR02 by the robot: until rival leaves",
    ]


def said(now: float, seen: StationSeen, *robots: RobotName) -> str:
    """Return the reason why AMR01 waits, if it may use only station s1 and `robots` stand on the pad of
    s1."""
    one = SiteLimits({ONE: ("s1",)}, {}, {"s1": {"tiny": "p1"}}, {}, 60.0, 100.0, 90.0, 60.0)
    there = {who: Standing(Sighting(who, False, "p1", 50.0, ""), 10.0) for who in robots}
    memory = replace(BUSY, wishes=BUSY.wishes[:1], grants={}, stations={"s1": seen}, robots=there)
    (text,) = reasons(memory, now, one)
    return text.removeprefix("tiny/AMR01 by the robot: ")


def test_the_reason_names_a_silent_station_and_a_station_with_another_robot() -> None:
    assert [said(15.0, shows(IDLE)), said(12.0, shows(IDLE), TWO)] == [
        "s1 is silent",
        "tiny/AMR02 stands at s1",
    ]


def test_the_remaining_time_of_a_charge_is_shown_in_seconds_or_minutes() -> None:
    found = [said(12.0, shows(CHARGING, full_s)) for full_s in (1.0, 101.0, 102.0, 3602.0)]
    assert found == [
        f"s1 is not free yet, s1 is free in {lasts}" for lasts in ("0 s", "99 s", "2 min", "60 min")
    ]


def test_a_robot_without_any_station_waits_for_the_schedule() -> None:
    memory = SiteMemory(may_speak=True, wishes=BUSY.wishes[:1], alone=False)
    assert list(reasons(memory, 12.0, site(2))) == [
        "tiny/AMR01 by the robot: the charging schedule has no station for this robot"
    ]


# ---- the memory of stations and of requests


def test_a_station_is_silent_five_seconds_after_its_last_state() -> None:
    memory = SiteMemory(stations={"s1": shows(IDLE)})
    assert [memory.speaks("s1", now) for now in (14.9, 15.0)] == [True, False]
    assert memory.speaks("s2", 0.0) is False


def test_the_last_eight_finished_requests_are_remembered() -> None:
    memory = SiteMemory(over=tuple("abcdefgh"), wishes=(Wish(ONE, "operator", request_id="i"),))
    assert memory.without_wish(ONE) == SiteMemory(over=tuple("bcdefghi"))


def test_the_site_follows_the_schedule_of_the_yaml() -> None:
    night = Charging(at="22:00", until="05:00")
    assert SiteLimits.of(settings(schedule=[night])).schedule == (night,)
