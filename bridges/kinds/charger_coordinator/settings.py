"""The coordinator's section of its YAML: stations, and each fleet's waypoints and robots.

`check` prints the results of `tables` and `warnings`.
"""

import math
from collections.abc import Iterator
from datetime import datetime
from typing import Annotated
from zoneinfo import ZoneInfo

import msgspec
from msgspec import Meta

from bridges.kinds.charger.settings import ReceiverId, RobotName, StartTimeout
from bridges.kinds.charger_coordinator import schedule as times
from bridges.kinds.charger_coordinator.schedule import Charging
from bridges.kinds.shared.fields import GraphSettings, Name, Timeout, tells
from bridges.kinds.shared.kind import CHARGER, WAYPOINT, Place
from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table

Metres = Annotated[float, Meta(ge=-100_000, le=100_000, extra={"unit": "m"})]
Near = Annotated[float, Meta(ge=0.1, le=5, extra={"unit": "m"})]
Full = Annotated[float, Meta(ge=50, le=100, extra={"unit": "%"})]
Low = Annotated[float, Meta(ge=1, le=100, extra={"unit": "%"})]
Stations = Annotated[list[Name], Meta(min_length=1)]


class Waypoint(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A named vertex of the fleet's navigation graph, with its coordinates in that graph."""

    level: Annotated[Name, tells("the name of the waypoint's level.")]
    x: Annotated[Metres, tells("the waypoint's x coordinate in the graph.")]
    y: Annotated[Metres, tells("the waypoint's y coordinate in the graph.")]


class StationSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A charger. Its key is the name under which the charger's own daemon publishes."""

    waypoint: Annotated[
        Name | None,
        tells("the place's name in the navigation graphs; when absent, the charger's name."),
    ] = None
    waypoints: Annotated[
        dict[Name, Name], tells("fleet -> the place's name in that fleet's graph, if different.")
    ] = {}


class RobotSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One robot."""

    stations: Annotated[Stations, tells("the robot's suitable stations, best first.")]
    waits_at: Annotated[
        Name,
        tells(
            "the robot's own waypoint, where it waits for a station and stays when it needs no charge."
        ),
    ]
    receivers: Annotated[list[ReceiverId], tells("the ids of the robot's receivers.")] = []
    rcu: Annotated[
        Name | None,
        tells("""the name under which the daemon of the robot's receiver publishes, if the receiver
        has a daemon. The receiver is a part of the robot, so do not list it under `stations`."""),
    ] = None


class FleetSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A fleet. Its key is the name that the fleet's adapter uses."""

    waypoints: Annotated[
        dict[Name, Waypoint],
        tells("""the places of stations and waiting robots in the fleet's navigation graph. RMF's
        fleet adapter crashes on a name that its graph lacks, so the coordinator sends only these
        names."""),
    ]
    robots: Annotated[
        dict[Name, RobotSettings],
        tells("the robots that charge, under the names that the fleet adapter uses."),
    ]


class CoordinatorSettings(GraphSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The stations of a site, the fleets that use them, and the charging policy."""

    stations: Annotated[
        dict[Name, StationSettings],
        tells("the chargers, by the names under which their daemons publish."),
    ]
    fleets: Annotated[
        dict[Name, FleetSettings], tells("the fleets whose robots charge at these stations.")
    ]
    start_timeout_s: Annotated[
        StartTimeout, tells("how long a station stays assigned to a robot that is on its way.")
    ] = 300.0
    near_m: Annotated[
        Near, tells("the greatest distance from which a robot counts as standing at a waypoint.")
    ] = 1.0
    full_percent: Annotated[
        Full, tells("the battery's charge at which a robot leaves its station.")
    ] = 100.0
    again_percent: Annotated[
        Low,
        tells("""a robot without a task is charged if its battery is below this percentage. The
        same holds for a robot that was already charged during its present task."""),
    ] = 90.0
    leaves_s: Annotated[
        Timeout,
        tells(
            "how long a robot that needs no charge may stay on a pad for which another robot waits."
        ),
    ] = 60.0
    schedule: Annotated[
        list[Charging], tells("times of the week at which robots without a task are charged.")
    ] = msgspec.field(default_factory=list)
    timezone: Annotated[
        Name | None,
        tells("the schedule's time zone (Asia/Singapore); when absent, this machine's zone."),
    ] = None

    def on_map(self) -> Iterator[Place]:
        """Yield the stations' places and each fleet's waypoints. RMF's map must have them all."""
        for name, station in self.stations.items():
            if set(self.fleets) - set(station.waypoints):
                path = ("stations", name, *(["waypoint"] if station.waypoint else []))
                yield path, CHARGER, station.waypoint or name
            for fleet, waypoint in station.waypoints.items():
                yield ("stations", name, "waypoints", fleet), CHARGER, waypoint
        for fleet, settings in self.fleets.items():
            for name in settings.waypoints:
                yield ("fleets", fleet, "waypoints", name), WAYPOINT, name

    def problems(self) -> Remarks:
        """Yield a problem for unknown names, for places given twice, and for contradictory
        percentages."""
        for key in ("stations", "fleets"):
            if not getattr(self, key):
                yield (key,), f"'{key}' is empty: there is nothing to coordinate"
        if self.again_percent > self.full_percent:
            yield ("again_percent",), "is above full_percent: a full robot would come back at once"
        for name, station in self.stations.items():
            for path, text in self._of_station(name, station):
                yield ("stations", name, *path), text
        for name, fleet in self.fleets.items():
            for path, text in self._of_fleet(name, fleet):
                yield ("fleets", name, *path), text
        yield from self._doubles()
        yield from self._of_schedule()

    def _of_station(self, name: str, station: StationSettings) -> Remarks:
        places = self.places()[name]
        if not self._graphs_with(name):
            text = (
                f"'{name}' stands at '{station.waypoint or name}', which is in no fleet's waypoints"
            )
            yield ("waypoint",), text
        for fleet in station.waypoints:
            if fleet not in self.fleets:
                yield ("waypoints", fleet), f"no fleet '{fleet}'; there are {', '.join(places)}"
            elif places[fleet] not in self.fleets[fleet].waypoints:
                yield ("waypoints", fleet), f"'{places[fleet]}' is not in that fleet's waypoints"

    def _graphs_with(self, station: str) -> list[str]:
        """List the fleets whose waypoints include the station's place."""
        places = self.places()[station]
        return [name for name, fleet in self.fleets.items() if places[name] in fleet.waypoints]

    def _of_fleet(self, fleet_name: str, fleet: FleetSettings) -> Remarks:
        known = ", ".join(fleet.waypoints) or "none"
        chargers = {places[fleet_name] for places in self.places().values()}
        for name, robot in fleet.robots.items():
            if robot.waits_at not in fleet.waypoints:
                text = f"no waypoint '{robot.waits_at}' in this fleet's list ({known})"
                yield ("robots", name, "waits_at"), text
            elif robot.waits_at in chargers:
                text = f"'{robot.waits_at}' is a charger's place: a robot waits somewhere else"
                yield ("robots", name, "waits_at"), text
            for i, station in enumerate(robot.stations):
                path = ("robots", name, "stations", str(i))
                if station not in self.stations:
                    yield path, f"no station '{station}'; there are {', '.join(self.stations)}"
                elif (place := self.places()[station][fleet_name]) not in fleet.waypoints:
                    if not self._graphs_with(station):
                        continue
                    yield path, f"'{station}' is at '{place}', not in this fleet's list ({known})"

    def _doubles(self) -> Remarks:
        """Yield a problem for each place that two stations or robots share, and for each receiver or
        receiver name that two robots share."""
        taken: dict[tuple[str, str], str] = {}
        for station, places in self.places().items():
            for fleet, place in places.items():
                owner = taken.setdefault((fleet, place), station)
                if owner != station:
                    text = f"'{station}' and '{owner}' both stand at '{place}'"
                    yield ("stations", station), text
                    break
        taken |= {("rcu", station): f"the station '{station}'" for station in self.stations}
        for who, robot in self.robots().items():
            path = ("fleets", who.fleet, "robots", who.name)
            things = [("waits_at", robot.waits_at), *(("receivers", r) for r in robot.receivers)]
            for key, thing in [*things, *([("rcu", robot.rcu)] if robot.rcu else [])]:
                owner = taken.setdefault((key, thing), str(who))
                if owner != str(who):
                    yield (
                        (*path, key),
                        f"'{thing}' already belongs to {owner}: only one robot can have it",
                    )

    def _of_schedule(self) -> Remarks:
        least, most = self.again_percent, self.full_percent
        for path, text in times.problems(self.schedule, self.fleets, self.robots(), least, most):
            yield ("schedule", *path), text
        try:
            ZoneInfo(self.timezone or "UTC")
        except (KeyError, OSError, ValueError):  # KeyError includes ZoneInfoNotFoundError
            yield ("timezone",), f"no time zone '{self.timezone}' on this machine (Asia/Singapore)"

    def robots(self) -> dict[RobotName, RobotSettings]:
        """Map every robot, by fleet and name, to its settings."""
        return {
            RobotName(fleet_name, name): robot
            for fleet_name, fleet in self.fleets.items()
            for name, robot in fleet.robots.items()
        }

    def places(self) -> dict[str, dict[str, str]]:
        """Map each station to a table from fleet to the station's waypoint."""
        return {
            name: {fleet: at.waypoints.get(fleet, at.waypoint or name) for fleet in self.fleets}
            for name, at in self.stations.items()
        }

    def rcus(self) -> dict[str, RobotName]:
        """Map the name of each receiver's own daemon (`rcu`) to the robot that carries the receiver."""
        return {robot.rcu: who for who, robot in self.robots().items() if robot.rcu}


def tables(settings: CoordinatorSettings) -> Iterator[Table]:
    """Yield three tables: each robot with its places, each station with its waypoint, and the
    schedule."""
    yield Table(
        "robots",
        ("robot", "charges at", "waits at", "receivers"),
        tuple(
            (str(who), ", ".join(r.stations), r.waits_at, ", ".join(r.receivers) or "-")
            for who, r in settings.robots().items()
        ),
    )
    yield Table(
        "stations",
        ("charger", "at waypoint"),
        tuple((name, _named(places)) for name, places in settings.places().items()),
    )
    if settings.schedule:
        rows = tuple((one.text(None),) for one in settings.schedule)
        yield Table("schedule", ("robots without a task are charged",), rows)


def _named(places: dict[str, str]) -> str:
    """Write the place's name, such as `dock_b`. If the fleets' names differ, write `tiny: dock_b, big:
    station_2`."""
    names = set(places.values())
    if len(names) == 1:
        return names.pop()
    return ", ".join(f"{fleet}: {place}" for fleet, place in places.items())


def speaks_of(settings: CoordinatorSettings) -> Iterator[Place]:
    """Yield the stations, because another file of the site must define each of them as a charger."""
    for name in settings.stations:
        yield ("stations", name), CHARGER, name


def warnings(settings: CoordinatorSettings) -> Remarks:
    """Yield a warning for each legal setting that may be a mistake."""
    used = {name for robot in settings.robots().values() for name in robot.stations}
    for name in settings.stations:
        if name not in used:
            yield ("stations", name), f"no robot charges at '{name}'"
    for who, robot in settings.robots().items():
        path = ("fleets", who.fleet, "robots", who.name)
        if len(set(robot.stations)) == 1:
            only = f"{who} charges only at '{robot.stations[0]}'"
            yield (
                path,
                f"{only}: if a charge fails there, nothing shows whether robot or charger is at fault",
            )
    yield from _near(settings)
    for i, one in enumerate(settings.schedule):
        if one.meets_clock_change() and _clock_changes(settings.timezone):
            entry = f"{one.at}-{one.until} begins or ends between 01:00 and 03:00"
            why = "when clocks change for daylight saving, it may be missed or run twice"
            yield ("schedule", str(i)), f"{entry}: {why}"


def _clock_changes(timezone: str | None) -> bool:
    """Return whether the zone may have daylight saving. The zone of another machine is not known."""
    if timezone is None:
        return True
    zone = ZoneInfo(timezone)
    return len({datetime(2026, month, 1, tzinfo=zone).utcoffset() for month in (1, 7)}) > 1


def _near(settings: CoordinatorSettings) -> Remarks:
    """Yield a warning for each pair of places that are too close together. A robot's position cannot
    tell such places apart."""
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
