"""Compares the YAML of a charger coordinator with the configuration of a fleet adapter, and with RMF's
map.

Different people write these files, and RMF reports no mismatch. A robot with a mismatch waits for ever,
or never leaves its charging pad. This module reports each mismatch with its file, its line and the
remedy.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal

from msgspec import Struct, field
from yaml import MappingNode

from bridges.kinds.charger_coordinator.settings import CoordinatorSettings, FleetSettings, Waypoint
from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.shared.similarity import Point, Similarity, estimate, odd_pair
from bridges.settings.building_map import BuildingMap
from bridges.settings.config import Config
from bridges.settings.fleet_config import EVERY_LEVEL, FleetFile
from bridges.yaml.parsing import Problem, YamlFile, compose
from bridges.yaml.positions import Spot, locate
from bridges.yaml.spelling import unknown

Transforms = Mapping[str, Similarity]
"""Level -> transform from RMF's map to the robot's map. If one transform holds for all levels, the
level is EVERY_LEVEL."""
LEAST_HZ = 1.0


class Compared(Struct):
    """The findings: errors, possible mistakes, and notes."""

    errors: list[Problem] = field(default_factory=list)
    warnings: list[Problem] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def compared(config: Config, fleet: FleetFile, building: BuildingMap | None) -> Compared:
    """Compare a coordinator's file with one fleet's configuration. With `building`, compare positions
    too."""
    found = _Comparing(config, fleet)
    found.names()
    found.percentages()
    found.finishing()
    found.needed()
    found.positions(building)
    return found.all


def emergency_levels(lifts: Config, fleet: FleetFile) -> Compared:
    """Check that the fleet has a recall floor for each lift that raises an alarm. At this floor a robot
    in the car gets out. Also check that each recall floor is a floor of its lift."""
    found, path = Compared(), ("rmf_fleet", "lift_emergency_levels")
    theirs = fleet.fleet.lift_emergency_levels
    for name, lift in lifts.devices.items():
        assert isinstance(lift, LiftSettings)
        floors = [floor for _, _, floor in lift.on_map()]
        level = theirs.get(name)
        if level is not None and level not in floors:
            text = f"'{name}' has an {unknown('floor', level, floors)}"
            found.errors.append(fleet.problem((*path, name), text))
        elif level is None and lift.alarm != "none":
            text = (
                f"'{name}' raises an alarm ({lift.alarm}) and has no recall floor here: a robot in its"
                " car would still wait for the floor to which it was going. Write"
                f" lift_emergency_levels: {{{name}: FLOOR}}. In Humble let the adapter call"
                " set_lift_emergency_level instead"
            )
            found.warnings.append(fleet.problem(path, f"warning: {text}"))
    return found


class _Comparing:
    def __init__(self, config: Config, fleet: FleetFile) -> None:
        assert isinstance(config.section, CoordinatorSettings)
        self.all = Compared()
        self._settings: CoordinatorSettings = config.section
        self._page = YamlFile(str(config.path))
        self._root: MappingNode = compose(self._page, config.text)
        self._fleet = fleet
        self._name = fleet.fleet.name

    def names(self) -> None:
        """Compare the names of the fleet, its robots, and their chargers' waypoints."""
        if self._name not in self._settings.fleets:
            text = unknown("fleet", self._name, self._settings.fleets)
            self._theirs("errors", ("rmf_fleet", "name"), f"{self._ours_file()} has an {text}")
            return
        fleet = self._settings.fleets[self._name]
        theirs = {name: (path, robot) for path, name, robot in self._fleet.robots()}
        for name in fleet.robots.keys() - theirs.keys():
            text = unknown("robot", name, theirs)
            self._ours(("robots", name), f"{self._file()} has an {text}")
        for name in theirs.keys() - fleet.robots.keys():
            self._theirs("warnings", theirs[name][0], f"no station of ours charges '{name}'")
        chargers: dict[str, str] = {}
        for name in sorted(theirs.keys() & fleet.robots.keys()):
            path, robot = theirs[name]
            below, waypoint = robot.waypoint()
            if waypoint is None:
                text = f"'{name}' has no charger: RMF never sends this robot to charge"
                self._theirs("errors", path, text)
                continue
            owner = chargers.setdefault(waypoint, name)
            if owner != name:
                text = f"'{waypoint}' is the charger of '{owner}' too: RMF would send both robots there"
                self._theirs("errors", (*path, *below), text)
            self._charger(fleet, name, (*path, *below), waypoint)

    def _charger(
        self, fleet: FleetSettings, name: str, path: tuple[str, ...], waypoint: str
    ) -> None:
        robot = fleet.robots[name]
        places = [self._settings.places()[station][self._name] for station in robot.stations]
        if waypoint not in fleet.waypoints:
            text = f"{self._ours_file()} has an {unknown('waypoint', waypoint, fleet.waypoints)}"
            self._theirs("errors", path, text)
        elif waypoint not in (*places, robot.waits_at):
            known = ", ".join((*places, robot.waits_at))
            text = f"'{name}' charges or waits at {known}, but RMF first drives it to '{waypoint}'"
            self._theirs("warnings", path, text)

    def percentages(self) -> None:
        """Compare the battery percentages at which charging begins and ends."""
        soc, threshold = self._fleet.fleet.recharge_soc, self._fleet.fleet.recharge_threshold
        full, again = self._settings.full_percent, self._settings.again_percent
        if soc is not None and full < 100 * soc:
            text = (
                f"a station releases a robot at full_percent {full:g} %, but the robot waits there for"
                f" recharge_soc {100 * soc:g} %: write recharge_soc: {full / 100:g}, or less"
            )
            self._theirs("errors", ("rmf_fleet", "recharge_soc"), text)
        elif soc is not None and full > 100 * soc:
            text = (
                f"RMF's task ends at recharge_soc {100 * soc:g} %, and the robot keeps its station"
                f" until full_percent {full:g} %: write full_percent: {max(100 * soc, 50):g}"
            )
            self._theirs("warnings", ("rmf_fleet", "recharge_soc"), text)
        if threshold is not None and again <= 100 * threshold:
            text = (
                f"below recharge_threshold {100 * threshold:g} % RMF gives a robot no task, but the"
                f" coordinator charges it again only below again_percent {again:g} %:"
                f" write again_percent above {100 * threshold:g}"
            )
            self._theirs("errors", ("rmf_fleet", "recharge_threshold"), text)

    def finishing(self) -> None:
        """Check each `finishing_request`, which tells a robot what to do after a task."""
        self.all.errors += self._fleet.unfit_finishing()
        for path, request in self._fleet.finishing():
            if request in (None, "nothing"):
                text = (
                    "if finishing_request is 'nothing' or missing, a charged robot stays on its pad"
                    " until it gets a task, and the next robot waits: write finishing_request 'charge'"
                )
                self._theirs("warnings", path if request else ("rmf_fleet",), text)

    def needed(self) -> None:
        """Check the keys that charging needs. Without these keys the coordinator sees no robot, or RMF
        charges no robot."""
        hz = self._fleet.fleet.publish_fleet_state
        if hz is not None and hz < LEAST_HZ:
            text = f"{hz:g} Hz is too seldom for the coordinator to see the robots: write 1 or more"
            self._theirs("errors", ("rmf_fleet", "publish_fleet_state"), text)
        if self._fleet.fleet.account_for_battery_drain is False:
            text = "with false, RMF never sends a robot to charge: write true"
            self._theirs("errors", ("rmf_fleet", "account_for_battery_drain"), text)

    def positions(self, building: BuildingMap | None) -> None:
        """Check the transforms between the maps, and compare each waypoint with the navigation
        graph."""
        transforms = dict(self._transforms())
        fleet = self._settings.fleets.get(self._name)
        if fleet is None:
            return
        levels = {at.level for at in fleet.waypoints.values()}
        for level in sorted(levels - transforms.keys()) if transforms else ():
            if EVERY_LEVEL not in transforms:
                text = f"no pairs for level '{level}', where this fleet has waypoints"
                self._theirs("warnings", ("reference_coordinates",), text)
        for name, at in fleet.waypoints.items() if building else ():
            self._waypoint(name, at, building, transforms)

    def _transforms(self) -> Iterator[tuple[str, Similarity]]:
        for level, pairs in self._fleet.references().items():
            path = ("reference_coordinates", *([level] if level else []))
            try:
                found = estimate(pairs.rmf, pairs.robot)
            except ValueError as error:
                self._theirs("errors", path, str(error))
                continue
            yield level, found
            of = f" for {level}" if level else ""
            self.all.notes.append(
                f"{self._file()}: transformation error estimate{of}: {found.mse:g}"
                f" (turned by {found.rotation:.4f} rad, scaled by {found.scale:.5g},"
                f" error {found.error:.2f} m on RMF's map)"
            )
            if found.error > self._settings.near_m:
                text = (
                    f"the pairs do not fit: they differ by {found.error:.2f} m on RMF's map, but near_m"
                    f" is {self._settings.near_m:g} m: a robot would not be seen at its waypoint"
                    f"{odd_pair(pairs.rmf, pairs.robot, self._settings.near_m)}"
                )
                if estimate(pairs.rmf, _mirrored(pairs.robot)).error <= self._settings.near_m:
                    text = "one map is the other's mirror image: change the sign of every robot's y"
                self._theirs("errors", path, text)

    def _waypoint(
        self, name: str, at: Waypoint, building: BuildingMap | None, transforms: Transforms
    ) -> None:
        if building is None or name not in building.places:
            return
        level, x, y = building.places[name]
        near_m, path = self._settings.near_m, ("waypoints", name)
        where = f"{Path(building.file).name}:{building.named['waypoint'][name]}"
        if level != at.level:
            self._ours((*path, "level"), f"{where} has '{name}' on level '{level}'")
            return
        off_m = math.dist((at.x, at.y), (x, y))
        if off_m <= near_m:
            return
        text = f"{where} has '{name}' at x {x:g}, y {y:g}: {off_m:.2f} m away, near_m is {near_m:g}"
        found = transforms.get(level, transforms.get(EVERY_LEVEL))
        if found is not None and math.dist(found.back((at.x, at.y)), (x, y)) <= near_m:
            text = (
                f"this place is on the robot's map; on RMF's map write x: {x:g}, y: {y:g} ({where})"
            )
        self._ours(path, text)

    def _file(self) -> str:
        return Path(self._fleet.file).name

    def _ours_file(self) -> str:
        return Path(self._page.file).name

    def _theirs(
        self, sort: Literal["errors", "warnings"], path: tuple[str, ...], text: str
    ) -> None:
        said = f"warning: {text}" if sort == "warnings" else text
        getattr(self.all, sort).append(self._fleet.problem(path, said))

    def _ours(self, path: tuple[str, ...], text: str) -> None:
        spot = Spot(self._root, self._root, "the file")
        entry = locate(spot, ("coordinator", "fleets", self._name, *path))
        self.all.errors.append(self._page.problem(entry.key, text))


def _mirrored(points: Sequence[Point]) -> list[Point]:
    return [(x, -y) for x, y in points]
