"""Reads the two RMF files that a fleet's YAML names, and compares them with that YAML.

RMF's adapter ends at many mistakes in these files. Therefore the daemon refuses such files before the
adapter starts. A recording also holds the texts of the files, because a replay of its decisions needs
them.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, Final

from msgspec import Struct
from msgspec.structs import replace
from yaml import MappingNode, SequenceNode

from bridges.kinds.fleet.memory import RobotLimits
from bridges.kinds.fleet.places import EVERY_LEVEL, NavGraph, RobotSite
from bridges.kinds.fleet.settings import FleetFiles
from bridges.kinds.shared.similarity import Similarity, estimate, fits_mirrored, odd_pair
from bridges.settings.building_map import MAP
from bridges.settings.config import Config
from bridges.settings.fleet_config import (
    FLEET,
    OF_MAPPING,
    ROBOTS,
    FleetFile,
    Pairs,
    load_fleet,
    parking_spot,
)
from bridges.settings.nav_graph import load_graph
from bridges.yaml.parsing import Problem, SettingsError, Sort, YamlFile, compose, read
from bridges.yaml.positions import Spot, below, locate
from bridges.yaml.spelling import nearest, short, unknown
from drivers.profiles import texts

NEEDED: Final = (
    ("limits", "linear"),
    ("limits", "angular"),
    ("profile", "footprint"),
    ("profile", "vicinity"),
    ("battery_system", "voltage"),
    ("battery_system", "capacity"),
    ("battery_system", "charging_current"),
    ("mechanical_system", "mass"),
    ("mechanical_system", "moment_of_inertia"),
    ("mechanical_system", "friction_coefficient"),
    ("ambient_system", "power"),
    ("tool_system", "power"),
)
"""Keys below `rmf_fleet` without which RMF's adapter does not read the file (EasyFullControl.cpp,
`from_config_files`)."""
READ: Final = frozenset(
    (
        *(section for section, _ in NEEDED),
        *("account_for_battery_drain", "actions", "finishing_request", "fleet_manager"),
        *("lift_emergency_levels", "max_delay", "max_merge_lane_distance"),
        *("max_merge_waypoint_distance", "min_lane_length", "name", "publish_fleet_state"),
        *("recharge_soc", "recharge_threshold", "responsive_wait", "retreat_to_charger_interval"),
        *("reversible", "robots", "skip_rotation_commands", "strict_lanes", "task_capabilities"),
        *("task_assignment_strategy", "transforms", "use_parking_reservations"),
    )
)
READ_OF_ROBOT: Final = frozenset(
    (
        *("charger", "finishing_request", "max_merge_lane_distance"),
        *("max_merge_waypoint_distance", "min_lane_length", "responsive_wait"),
    )
)
"""The keys below `rmf_fleet`, and below each of its robots, that an adapter reads (the same place, and
`fleet_manager` of fleet_adapter_template). RMF passes over any other key without a word."""
OFF_M: Final = 0.5
"""The greatest error (m) of the pairs of coordinates. With a greater error, RMF would see a robot
beside its lane."""


class FleetSite(Struct, frozen=True):
    """The two RMF files of a fleet.

    - `transforms`: maps a level to the transform from RMF's map to the robots' map
    - `estimated`: the levels whose transform we have estimated from pairs of points. RMF does not know
      these transforms, so the daemon must give them to RMF.
    """

    fleet: FleetFile
    graph: NavGraph
    transforms: Mapping[str, Similarity]
    estimated: tuple[str, ...]
    config_file: str
    graph_file: str

    def of(self, robot: str) -> RobotSite:
        """Return the facts about one robot."""
        return RobotSite(self.graph, self.transforms, self.chargers().get(robot) or "")

    def chargers(self) -> dict[str, str | None]:
        """Map robot -> its charger's waypoint."""
        return {name: robot.waypoint()[1] for _, name, robot in self.fleet.robots()}

    def notes(self) -> Iterator[str]:
        """Yield texts for a person: the transforms with their errors, misspelt keys, chargers that
        robots share, and waypoints without a lane."""
        name, references = Path(self.config_file).name, self.fleet.references()
        for level, found in self.transforms.items():
            of = f" for {level}" if level else ""
            yield (
                f"{name}: the robots' map{of} is RMF's map, turned by {found.rotation:.4f} rad and"
                f" scaled by {found.scale:.5g}; the pairs differ by {found.error:.2f} m on RMF's map"
            )
            pairs = references.get(level)
            if pairs and fits_mirrored(pairs.rmf, pairs.robot, OFF_M):
                yield (
                    f"{name}: the pairs{of} lie on one line, so they cannot show whether the robots'"
                    " map is the mirror image of RMF's: add a pair away from that line"
                )
        yield from _misspelt(self.fleet)
        for waypoint, count in Counter(self.chargers().values()).items():
            if waypoint and count > 1:
                yield f"{name}: {count} robots have the charger '{waypoint}': all drive there"
        reached = {lane.end for lane in self.graph.lanes}
        for number, vertex in enumerate(self.graph.vertices):
            if vertex.name and number not in reached:
                where = Path(self.graph_file).name
                yield f"{where}: no lane leads to '{vertex.name}', so RMF sends no robot there"


def limits_of(config: Config, robot: str, debounce: Mapping[str, float]) -> RobotLimits:
    """Return the limits of a robot's core, with the facts about its site. Raises SettingsError."""
    assert isinstance(config.section, FleetFiles)
    limits = RobotLimits.of(config.devices[robot], debounce)
    light = config.section.control == "traffic_light"
    return replace(limits, site=read_site(config).of(robot), light=light)


def read_site(config: Config) -> FleetSite:
    """Read the files of a fleet's YAML. Raises SettingsError with every problem."""
    section = config.section
    assert isinstance(section, FleetFiles)
    comparing = _Comparing(config)
    fleet = comparing.read(section.config, "config", FLEET, load_fleet)
    graph = comparing.read(section.graph, "graph", MAP, load_graph)
    if fleet is None or graph is None:
        raise SettingsError(comparing.problems)
    comparing.needed(fleet)
    transforms = comparing.transforms(fleet, graph)
    comparing.robots(fleet, graph)
    comparing.names(fleet, graph)
    if comparing.problems:
        raise SettingsError(comparing.problems)
    files = _file(config, section.config), _file(config, section.graph)
    return FleetSite(fleet, graph, transforms, tuple(fleet.references()), *map(str, files))


def _not_in_graph(waypoint: str, known: Sequence[str]) -> str:
    return f"the graph has no {unknown('waypoint', waypoint, known)[8:]}"


def _misspelt(fleet: FleetFile) -> Iterator[str]:
    """Yield a text for each key that is probably a misspelt key of RMF's adapter."""
    robots = [path for path, _, _ in fleet.robots()]
    for path, known in ((("rmf_fleet",), READ), *((path, READ_OF_ROBOT) for path in robots)):
        section = locate(Spot(fleet.root, fleet.root, "the file"), path).value
        entries = section.value if isinstance(section, MappingNode) else ()
        present = {key.value for key, _ in entries}
        for key in sorted(present - known):
            if near := nearest(key, known - present):
                text = f"RMF's adapter does not read '{short(key)}': did you mean '{near}'?"
                found = fleet.problem((*path, key), text)
                yield str(replace(found, file=Path(fleet.file).name))


def _misfit(pairs: Pairs) -> str:
    """Return a clause that says what is wrong with the pairs, as far as they show it."""
    if fits_mirrored(pairs.rmf, pairs.robot, OFF_M):
        return (
            "; the robots' map is the mirror image of RMF's: change the sign of each y of the robots'"
            " points, and write y_axis: down below units (HTTP)"
        )
    return odd_pair(pairs.rmf, pairs.robot, OFF_M)


def _numbers(fleet: FleetFile) -> Iterator[tuple[tuple[str, ...], float]]:
    """Yield the robots' sizes and limits, with their paths."""
    root = below(fleet.root, "rmf_fleet")
    for path in NEEDED:
        section = root and below(root.value, path[0])
        entry = section and below(section.value, path[1])
        nodes = entry.value.value if entry and isinstance(entry.value, SequenceNode) else ()
        for node in nodes or ([entry.value] if entry else []):
            with suppress(ValueError):
                yield (
                    ("rmf_fleet", *path),
                    float(node.value.replace(".nan", "nan").replace(".inf", "inf")),
                )


def _file(config: Config, path: str) -> Path:
    return _folder(str(config.path.parent)) / path


@cache
def _folder(folder: str) -> Path:
    """Return the absolute path of a folder. The path is cached, so that it stays the same if the daemon
    changes its working directory."""
    return Path(folder).absolute()


class _Comparing:
    def __init__(self, config: Config) -> None:
        self.problems: list[Problem] = []
        self._config = config
        self._page = YamlFile(str(config.path))
        self._root = compose(self._page, config.text)

    def read(self, path: str, key: str, sort: Sort, load: Any) -> Any:
        """Read one of the two files. If that fails, note a problem and return None."""
        file = _file(self._config, path)
        try:
            return load(str(file), texts.text(file, lambda: read(str(file), sort)))
        except SettingsError as error:
            self.problems += error.problems
            first = error.problems[0]
            if first.file == str(file) and not file.is_file():
                self._ours(("fleet", key), f"{file} cannot be read")
            return None

    def needed(self, fleet: FleetFile) -> None:
        """Check the keys that RMF's adapter needs."""
        root = below(fleet.root, "rmf_fleet")
        for section, key in NEEDED:
            entry = root and below(root.value, section)
            if not entry or not below(entry.value, key):
                text = f"needs {section}: {key}, without which RMF's adapter does not start"
                self.problems.append(fleet.problem(("rmf_fleet", section), text))
        for path, number in _numbers(fleet):
            least = number > 0 if path[1] in ("limits", "profile") else number >= 0
            if not (least and number < math.inf):  # so NaN is refused too
                text = "is not possible for a robot: RMF's planner would fail"
                self.problems.append(fleet.problem(path, text))
        self.problems += fleet.unfit_finishing()

    def transforms(self, fleet: FleetFile, graph: NavGraph) -> dict[str, Similarity]:
        """Return level -> transform, from RMF's own transforms and from pairs of points."""
        found = {level: t.similarity() for level, t in fleet.fleet.transforms.items()}
        for level, pairs in fleet.references().items():
            path = ("reference_coordinates", *([level] if level else []))
            try:
                found[level] = estimate(pairs.rmf, pairs.robot)
            except ValueError as error:
                self.problems.append(fleet.problem(path, str(error)))
                continue
            if found[level].error > OFF_M:
                differ = (
                    f"the pairs do not fit: they differ by {found[level].error:.2f} m on RMF's map"
                )
                self.problems.append(fleet.problem(path, differ + _misfit(pairs)))
            if level and level not in graph.levels():
                self.problems.append(fleet.problem(path, unknown("level", level, graph.levels())))
        lacking = [level for level in graph.levels() if level not in found]
        if found and EVERY_LEVEL not in found and lacking:
            text = f"no pairs for {', '.join(lacking)}: RMF cannot place a robot on that level"
            self.problems.append(fleet.problem(("reference_coordinates",), text))
        return found

    def robots(self, fleet: FleetFile, graph: NavGraph) -> None:
        """Compare the robots of the YAML with the robots of the fleet's configuration. Compare the
        robots' chargers with the navigation graph."""
        theirs = {name: (path, robot) for path, name, robot in fleet.robots()}
        ours = self._config.devices
        section = self._config.section
        assert isinstance(section, FleetFiles)
        real: dict[tuple[str, ...], str] = {}
        for name, robot in ours.items():
            known = robot.known_as or name
            claims = self._config.driver_type(name).claims(replace(robot, known_as=known))
            place = (self._config.bus_of(name), *([text for text, _ in claims] or [known]))
            if (other := real.setdefault(place, name)) != name:
                text = f"'{known}' is the robot '{other}' already: it would get two orders"
                self._ours(("robots", name, *(["known_as"] if robot.known_as else [])), text)
            if lacks := robot.lacks(section.control):
                self._ours(("robots", name), lacks)
            for level in robot.maps.keys() - set(graph.levels()):
                text = unknown("level", level, graph.levels())
                self._ours(("robots", name, "maps", level), text)
            for action in set(fleet.fleet.actions) - set(robot.known_actions()):
                where = Path(fleet.file).name
                text = f"{where} has the action '{action}': write below actions: how it is started"
                self._ours(("robots", name), text)
            if name not in theirs:
                text = f"{Path(fleet.file).name} has an {unknown('robot', name, theirs)}"
                self._ours(("robots", name), text)
        for name, (path, robot) in theirs.items():
            if name not in ours:
                where = Path(self._config.path).name
                text = f"{where} has no robot '{name}': add it below robots:"
                self.problems.append(fleet.problem(path, text))
            inner, charger = robot.waypoint()
            in_place = (*path, *inner) == (*ROBOTS, name, "charger")
            strict = section.control == "full" or inner == OF_MAPPING
            vertex = graph.called(charger) if charger else None
            known = [v.name for v in graph.vertices if v.name]
            if charger is None:
                text = f"'{name}' has no charger: RMF's adapter does not add the robot"
                self.problems.append(fleet.problem(path, text))
            elif strict and not in_place:
                line = f"{name}: {{charger: {charger}}}"
                text = f"RMF's adapter does not read this form: below {': '.join(ROBOTS)} write"
                self.problems.append(fleet.problem((*path, *inner), f"{text} '{line}'"))
            elif vertex is None:
                self.problems.append(fleet.problem((*path, *inner), _not_in_graph(charger, known)))
            spot = parking_spot(robot.finishing_request)
            if spot is not None and not graph.called(spot):
                text = _not_in_graph(spot, known)
                self.problems.append(
                    fleet.problem((*path, "finishing_request", "waypoint_name"), text)
                )

    def names(self, fleet: FleetFile, graph: NavGraph) -> None:
        """Compare the fleet's recall floors with the stops of the graph's lifts. At its recall floor a
        robot in the car gets out in an alarm."""
        lifts = {vertex.lift for vertex in graph.vertices if vertex.lift}
        for lift, level in fleet.fleet.lift_emergency_levels.items():
            path = ("rmf_fleet", "lift_emergency_levels", lift)
            stops = [v.level for v in graph.vertices if v.lift == lift]
            if lift not in lifts:
                self.problems.append(fleet.problem(path, unknown("lift", lift, sorted(lifts))))
            elif level not in stops:
                self.problems.append(fleet.problem(path, unknown("floor", level, stops)))

    def _ours(self, path: tuple[str, ...], text: str) -> None:
        spot = Spot(self._root, self._root, "the file")
        self.problems.append(self._page.problem(locate(spot, path).key, text))
