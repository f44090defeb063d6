"""The coordinator's own charging schedule. Each entry is a time of the week at which robots are charged
up to a target percentage.

The functions are pure. The day of the week and the local time of day are arguments. If an entry's end
is not later than its beginning, the end is on the next day. The whole entry then belongs to the day on
which it begins.
"""

from collections.abc import Iterable
from typing import Annotated, Final, Literal, NamedTuple

import msgspec
from msgspec import Meta

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks

Day = Literal["mon", "tue", "wed", "thu", "fri", "sat", "sun"]
DAYS: Final[tuple[Day, ...]] = ("mon", "tue", "wed", "thu", "fri", "sat", "sun")
DAY_MIN: Final = 24 * 60
TimeOfDay = Annotated[
    str,
    Meta(
        pattern=r"^([01][0-9]|2[0-3]):[0-5][0-9]$(?!\n)",
        extra={"pattern": 'a time of day in quotes ("22:00")'},
    ),
]
Target = Annotated[float, Meta(ge=1, le=100, extra={"unit": "%"})]


class LocalTime(NamedTuple):
    """A local time. `day`: the day of the week, 0 for Monday. `minute`: the minutes since local
    midnight."""

    day: int
    minute: int


class Charging(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One entry of the schedule: a time of the week at which robots without a task are charged."""

    at: Annotated[TimeOfDay, tells("when charging begins.")]
    until: Annotated[TimeOfDay, tells("when charging ends.")]
    days: Annotated[
        list[Day], tells("the days on which charging begins; every day when absent.")
    ] = msgspec.field(default_factory=lambda: list(DAYS))
    fleets: Annotated[
        list[Name],
        tells("the fleets to be charged. When this key and `robots` are absent, all fleets."),
    ] = []
    robots: Annotated[
        list[Name],
        tells("""the robots to be charged, as FLEET/ROBOT. When this key and `fleets` are absent, all
        robots."""),
    ] = []
    percent: Annotated[
        Target, tells("the battery charge up to which these robots are charged.")
    ] = 100.0

    def concerns(self, who: RobotName) -> bool:
        """Return whether this entry of the schedule applies to the robot."""
        everybody = not self.fleets and not self.robots
        return everybody or who.fleet in self.fleets or str(who) in self.robots

    def under_way(self, when: LocalTime) -> bool:
        """Return whether `when` lies between the beginning and the end of this entry."""
        begins, lasts = _minute(self.at), self.lasts_min()
        today, yesterday = DAYS[when.day], DAYS[when.day - 1]
        began_today = today in self.days and 0 <= when.minute - begins < lasts
        return began_today or (yesterday in self.days and when.minute + DAY_MIN - begins < lasts)

    def lasts_min(self) -> int:
        """Return the time from the beginning to the end (minutes): at most a day."""
        return (_minute(self.until) - _minute(self.at) - 1) % DAY_MIN + 1

    def meets_clock_change(self) -> bool:
        """Return whether this entry begins or ends in the hours in which clocks change for daylight
        saving."""
        return "01:00" <= self.at < "03:00" or "01:00" < self.until <= "03:00"

    def text(self, when: LocalTime | None) -> str:
        """Describe the times, robots and target: `22:00-05:00 mon tue tiny to 100 %: under way`."""
        days = "" if set(self.days) == set(DAYS) else f" {' '.join(self.days)}"
        whom = " ".join([*self.fleets, *self.robots]) or "everybody"
        now = "" if when is None else f": {'under way' if self.under_way(when) else 'not now'}"
        return f"{self.at}-{self.until}{days} {whom} to {self.percent:g} %{now}"


def target(schedule: Iterable[Charging], who: RobotName, when: LocalTime | None) -> float:
    """Return the charge (%) up to which the schedule charges this robot at this time; 0 for no
    charging."""
    if when is None:
        return 0.0
    found = (c.percent for c in schedule if c.concerns(who) and c.under_way(when))
    return max(found, default=0.0)


def problems(
    schedule: Iterable[Charging],
    fleets: Iterable[str],
    robots: Iterable[RobotName],
    least: float,
    most: float,
) -> Remarks:
    """Yield a problem for each unknown name, and for each target that is not between `again_percent`
    and `full_percent`."""
    known = {"fleets": set(fleets), "robots": set(map(str, robots))}
    for i, one in enumerate(schedule):
        for key, named in (("fleets", one.fleets), ("robots", one.robots)):
            for n, name in enumerate(named):
                if name not in known[key]:
                    there = ", ".join(sorted(known[key]))
                    yield (str(i), key, str(n)), f"no '{name}' among the {key} ({there})"
        if one.percent > most:
            yield (str(i), "percent"), f"is above full_percent ({most:g} %), so it is never reached"
        elif one.percent <= least:
            text = (
                f"is not above again_percent ({least:g} %), below which robots are charged anyway"
            )
            yield (str(i), "percent"), text


def _minute(text: str) -> int:
    return int(text[:2]) * 60 + int(text[3:])
