"""The coordinator's own charging schedule: its settings, its times of day, and which robots it
calls."""

from pathlib import Path

import pytest

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator import messages
from bridges.kinds.charger_coordinator.schedule import DAYS, Charging, LocalTime, target
from bridges.kinds.charger_coordinator.settings import warnings
from bridges.settings.load import SettingsError, load
from tests.kinds.charger_coordinator.virtual_site import settings

CONFIG = Path(__file__).parents[3] / "config" / "charger_coordinator.yaml"
ONE, TWO = RobotName("tiny", "AMR01"), RobotName("tiny", "AMR02")
MON, TUE, SUN = 0, 1, 6


def at(clock: str, day: int = MON) -> LocalTime:
    hours, minutes = clock.split(":")
    return LocalTime(day, int(hours) * 60 + int(minutes))


@pytest.mark.parametrize(
    ("when", "under_way"),
    [
        (at("21:59", MON), False),
        (at("22:00", MON), True),
        (at("23:59", MON), True),
        (at("00:00", TUE), True),
        (at("04:59", TUE), True),
        (at("05:00", TUE), False),
        (at("22:00", TUE), False),
        (at("00:00", MON), False),
    ],
)
def test_a_time_past_midnight_belongs_to_the_day_on_which_it_begins(
    when: LocalTime, under_way: bool
) -> None:
    assert Charging(at="22:00", until="05:00", days=["mon"]).under_way(when) is under_way


def test_sunday_night_reaches_into_monday() -> None:
    night = Charging(at="22:00", until="05:00", days=["sun"])
    assert [night.under_way(at("01:00", day)) for day in range(7)] == [True] + [False] * 6


def test_a_time_with_equal_beginning_and_end_lasts_a_day() -> None:
    days = [Charging(at=clock, until=clock) for clock in ("00:00", "12:00")]
    minutes = range(0, 24 * 60, 7)
    assert all(one.under_way(LocalTime(day, m)) for one in days for day in (0, 6) for m in minutes)


@pytest.mark.parametrize(
    ("fleets", "robots", "percents"),
    [
        ([], [], [80.0, 80.0]),
        (["tiny"], [], [80.0, 80.0]),
        (["other"], [], [0.0, 0.0]),
        ([], ["tiny/AMR01"], [80.0, 0.0]),
        (["other"], ["tiny/AMR02"], [0.0, 80.0]),
    ],
)
def test_a_schedule_is_for_the_robots_and_fleets_that_it_names(
    fleets: list[str], robots: list[str], percents: list[float]
) -> None:
    one = Charging(at="00:00", until="00:00", fleets=fleets, robots=robots, percent=80.0)
    assert [target([one], who, at("12:00")) for who in (ONE, TWO)] == percents


def test_the_highest_percent_of_several_times_counts_and_without_a_clock_no_time_counts() -> None:
    two = [Charging(at="08:00", until="20:00", percent=p) for p in (90.0, 95.0)]
    assert (target(two, ONE, at("12:00")), target(two, ONE, None)) == (95.0, 0.0)
    assert target(two, ONE, at("20:00")) == 0.0


def test_the_text_of_a_schedule_names_time_days_robots_and_percent() -> None:
    night = Charging(at="22:00", until="05:00", days=["mon", "tue"], fleets=["tiny"], percent=95)
    assert [night.text(when) for when in (None, at("22:00"), at("12:00"))] == [
        "22:00-05:00 mon tue tiny to 95 %",
        "22:00-05:00 mon tue tiny to 95 %: under way",
        "22:00-05:00 mon tue tiny to 95 %: not now",
    ]
    assert Charging(at="22:00", until="05:00").text(None) == "22:00-05:00 everybody to 100 %"


@pytest.mark.parametrize(
    ("timezone", "local"),
    [
        ("UTC", (DAYS.index("tue"), 22 * 60 + 13)),
        ("Asia/Singapore", (DAYS.index("wed"), 6 * 60 + 13)),
    ],
)
def test_the_local_time_follows_the_time_zone(timezone: str, local: tuple[int, int]) -> None:
    assert messages.local_time(1.7e9, timezone) == local


@pytest.mark.parametrize(
    ("lines", "problem"),
    [
        ('schedule: [{at: "24:00", until: "05:00"}]', "a time of day in quotes"),
        ('schedule: [{at: 22:00, until: "05:00"}]', "YAML may read as the number"),
        ('schedule: [{at: "22:00", until: "05:00", days: [monday]}]', "'monday'"),
        ('schedule: [{at: "22:00", until: "05:00", robots: [tiny/X]}]', "no 'tiny/X' among"),
        ('schedule: [{at: "22:00", until: "05:00", fleets: [big]}]', "no 'big' among the fleets"),
        ('schedule: [{at: "22:00", until: "05:00", percent: 90}]', "not above again_percent"),
        ("timezone: Mars/Olympus", "no time zone 'Mars/Olympus'"),
    ],
)
def test_a_schedule_that_cannot_be_kept_is_refused(
    tmp_path: Path, lines: str, problem: str
) -> None:
    file = tmp_path / "site.yaml"
    start, _, rest = CONFIG.read_text().partition("  schedule:\n")
    file.write_text(f"{start}  {lines}\n" + rest.partition("\n")[2])
    with pytest.raises(SettingsError) as refused:
        load(file)
    assert problem in "\n".join(map(str, refused.value.problems))


def test_every_problem_of_a_schedule_is_named_with_its_place() -> None:
    night = Charging(at="22:00", until="05:00", percent=95.0)
    schedule = [
        night,
        Charging(at="22:00", until="05:00", percent=96.0, fleets=["tiny", "big"]),
        Charging(at="12:00", until="13:00", percent=90.0, robots=["tiny/AMR01", "tiny/X"]),
    ]
    assert list(settings(schedule=schedule, full_percent=95.0).problems()) == [
        (("schedule", "1", "fleets", "1"), "no 'big' among the fleets (tiny)"),
        (("schedule", "1", "percent"), "is above full_percent (95 %), so it is never reached"),
        (
            ("schedule", "2", "robots", "1"),
            "no 'tiny/X' among the robots (tiny/AMR01, tiny/AMR02, tiny/AMR03)",
        ),
        (
            ("schedule", "2", "percent"),
            "is not above again_percent (90 %), below which robots are charged anyway",
        ),
    ]


def test_a_scheduled_time_begins_and_ends_at_its_minutes() -> None:
    lunch = Charging(at="11:45", until="13:20", days=["mon"], fleets=["tiny"], robots=["big/B01"])
    times = ("11:44", "11:45", "13:19", "13:20")
    assert [lunch.under_way(at(clock)) for clock in times] == [False, True, True, False]
    assert lunch.text(None) == "11:45-13:20 mon tiny big/B01 to 100 %"


@pytest.mark.parametrize(
    ("begins", "ends", "timezone", "warned"),
    [
        ("22:00", "02:30", "Europe/Berlin", True),
        ("02:00", "02:45", None, True),
        ("01:00", "05:00", "America/New_York", True),
        ("02:59", "05:00", "Europe/London", True),
        ("22:00", "03:00", "Australia/Sydney", True),
        ("22:00", "01:00", "Europe/Berlin", False),
        ("03:00", "05:00", "Europe/Berlin", False),
        ("22:00", "05:00", "Europe/Berlin", False),
        ("02:00", "02:45", "Asia/Singapore", False),
    ],
)
def test_an_entry_that_a_change_of_the_clocks_may_drop_or_repeat_gives_a_warning(
    begins: str, ends: str, timezone: str | None, warned: bool
) -> None:
    night = Charging(at="22:00", until="05:00")
    entries = [night, Charging(at=begins, until=ends)]
    site = settings(schedule=entries, timezone=timezone)
    found = [(path, text) for path, text in warnings(site) if path[0] == "schedule"]
    text = (
        f"{begins}-{ends} begins or ends between 01:00 and 03:00: when clocks change for daylight"
        " saving, it may be missed or run twice"
    )
    assert found == ([(("schedule", "1"), text)] if warned else [])
