"""What `check` says of a coordinator's settings."""

import math
from collections.abc import Iterator

from bridges.charger_coordinator.settings import Settings

HEADINGS = ("robot", "charges at", "waits at", "receivers")


def described(settings: Settings) -> list[tuple[str, ...]]:
    """Each robot and its places, then each station and its waypoint, then the numbers."""
    places = settings.places()
    rows: list[tuple[str, ...]] = [HEADINGS]
    for who, robot in settings.robots().items():
        stations, receivers = ", ".join(robot.stations), ", ".join(robot.receivers)
        rows.append((str(who), stations, robot.waits_at, receivers or "-"))
    rows += [("", "", "", ""), ("charger", "at waypoint", "", "")]
    rows += [(name, place, "", "") for name, place in places.items()]
    numbers = {
        "start_timeout_s": f"{settings.start_timeout_s:g} s",
        "near_m": f"{settings.near_m:g} m",
        "full_percent": f"{settings.full_percent:g} %",
        "again_percent": f"{settings.again_percent:g} %",
        "quiet_start_s": f"{settings.quiet_start_s:g} s",
    }
    return [*rows, ("", "", "", ""), *((key, text, "", "") for key, text in numbers.items())]


def warnings(settings: Settings) -> Iterator[tuple[tuple[str, ...], str]]:
    """What works, but not as well as it could."""
    used = {name for robot in settings.robots().values() for name in robot.stations}
    for name in settings.stations:
        if name not in used:
            yield ("stations", name), f"no robot charges at '{name}'"
    for who, robot in settings.robots().items():
        path = ("fleets", who.fleet, "robots", who.name)
        if len(set(robot.stations)) == 1:
            only = f"{who} charges at '{robot.stations[0]}' alone"
            yield path, f"{only}: when it fails there, nothing tells whose fault it is"
    yield from _near(settings)


def _near(settings: Settings) -> Iterator[tuple[tuple[str, ...], str]]:
    """Places that a robot's position hardly tells apart."""
    for fleet_name, fleet in settings.fleets.items():
        names = list(fleet.waypoints)
        for i, name in enumerate(names):
            a = fleet.waypoints[name]
            for other in names[:i]:
                b = fleet.waypoints[other]
                apart = math.dist((a.x, a.y), (b.x, b.y))
                if a.level == b.level and apart < settings.near_m:
                    text = f"'{name}' is less than near_m ({settings.near_m:g} m) from '{other}'"
                    yield ("fleets", fleet_name, "waypoints", name), text
