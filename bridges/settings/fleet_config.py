"""The configuration file of a fleet adapter (EasyFullControl). These are the keys that our files must
match:

    rmf_fleet:
      name: tiny
      recharge_threshold: 0.2           # below this charge RMF gives a robot no task
      recharge_soc: 1.0                 # at this charge RMF's ChargeBattery ends
      finishing_request: charge         # charge, park or nothing; since 2.10 also {type: park}
      publish_fleet_state: 10.0         # Hz
      account_for_battery_drain: true
      lift_emergency_levels: {Lift1: L1}   # since Iron; where a robot in the car gets out in an alarm
      robots: {AMR01: {charger: charger_a}}
    reference_coordinates: {L1: {rmf: [[x, y], ...], robot: [[x, y], ...]}}

Older files have `robots:` beside `rmf_fleet:`, with `rmf_config: {charger: {waypoint: charger_a}}`.
RMF's own reader does not know these. They are for `check --fleet-config`, because an adapter's program
may read them. `fleet_site.py` refuses them.
Their `reference_coordinates` have no levels, so one list for `rmf` and one for `robot` serve all
levels. rmf_demos has these lists below `fleet_manager`. All other keys are ignored. Source:
open-rmf/fleet_adapter_template, config.yaml and fleet_adapter.py.
"""

import cmath
import re
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Final, TypeVar, cast

import msgspec
from yaml import MappingNode, YAMLError
from yaml.constructor import SafeConstructor

from bridges.kinds.shared.similarity import Point, Similarity
from bridges.yaml.parsing import Problem, SettingsError, Sort, YamlFile, compose, read
from bridges.yaml.positions import Spot, locate
from bridges.yaml.spelling import unknown

FLEET = Sort("fleet configuration", "rmf_fleet: ...", 256 * 1024, 20_000)
EVERY_LEVEL = ""
"""The level name of reference coordinates that hold for every level."""
Soc = Annotated[float, msgspec.Meta(ge=0, le=1)]
Path = tuple[str, ...]
ROBOTS: Final = ("rmf_fleet", "robots")
"""The only place where RMF's adapter reads robots. It reads the text `charger` of each robot."""
OF_MAPPING: Final = ("charger", "waypoint")
FINISHES: Final = "finishing_request"
FINISHING: Final = ("charge", "park", "nothing")
OF_ADAPTER: Final = "is this a fleet adapter's configuration?"
T = TypeVar("T")


class Charger(msgspec.Struct, frozen=True):
    """A robot's charger, if it is written as a mapping. `waypoint`: the charger's name in the
    navigation graph."""

    waypoint: str | None = None


class OlderRobot(msgspec.Struct, frozen=True):
    """A robot's settings for RMF in an older file."""

    charger: Charger | None = None


class FinishingTask(msgspec.Struct, frozen=True):
    """A `finishing_request` in the form of a mapping. `waypoint_name`: where the robot parks; RMF reads
    it only for the type park."""

    type: str
    waypoint_name: str | None = None


FinishingRequest = str | FinishingTask | None


class RobotConfig(msgspec.Struct, frozen=True):
    """One robot with its charger's waypoint, in the new or the older form. Its `finishing_request`, if
    there is one, takes the place of the fleet's (since 2.10)."""

    charger: str | Charger | None = None
    finishing_request: FinishingRequest = None
    rmf_config: OlderRobot | None = None

    def waypoint(self) -> tuple[Path, str | None]:
        """Return the path of the charger's waypoint below the robot, and the waypoint's name."""
        if isinstance(self.charger, str):
            return ("charger",), self.charger
        if self.charger is not None:
            return OF_MAPPING, self.charger.waypoint
        older = self.rmf_config.charger if self.rmf_config else None
        return ("rmf_config", "charger", "waypoint"), older.waypoint if older else None


class Limits(msgspec.Struct, frozen=True):
    """The robots' greatest velocity and acceleration: linear (m/s, m/s²) and angular (rad/s,
    rad/s²)."""

    linear: tuple[float, float]
    angular: tuple[float, float]


class FootprintProfile(msgspec.Struct, frozen=True):
    """The robots' radii (m)."""

    footprint: float
    vicinity: float | None = None


class MapTransform(msgspec.Struct, frozen=True):
    """A transform from RMF's map to the robot's map (m, rad), as RMF writes it."""

    translation: Point = (0.0, 0.0)
    rotation: float = 0.0
    scale: float = 1.0

    def similarity(self) -> Similarity:
        """Return this transform as a `Similarity`."""
        return Similarity(cmath.rect(self.scale, self.rotation), complex(*self.translation), 0.0)


class RmfFleet(msgspec.Struct, frozen=True):
    """The section `rmf_fleet`. Its percentages are fractions of 1."""

    name: str
    limits: Limits | None = None
    profile: FootprintProfile | None = None
    actions: list[str] = msgspec.field(default_factory=list)
    transforms: dict[str, MapTransform] = msgspec.field(default_factory=dict)
    recharge_threshold: Soc | None = None
    recharge_soc: Soc | None = None
    finishing_request: FinishingRequest = None
    publish_fleet_state: float | None = None
    account_for_battery_drain: bool | None = None
    lift_emergency_levels: dict[str, str] = msgspec.field(default_factory=dict)
    robots: dict[str, RobotConfig | None] = msgspec.field(default_factory=dict)


class Pairs(msgspec.Struct, frozen=True):
    """Pairs of points. The two points of a pair are the same place on RMF's map and on the robot's
    map."""

    rmf: list[Point]
    robot: list[Point]


class Manager(msgspec.Struct, frozen=True):
    """The fleet manager's section. We read only the pairs of points in it."""

    reference_coordinates: Pairs | None = None


class Contents(msgspec.Struct, frozen=True):
    """The whole file."""

    rmf_fleet: RmfFleet
    robots: dict[str, RobotConfig | None] = msgspec.field(default_factory=dict)
    reference_coordinates: dict[str, Pairs] | None = None
    fleet_manager: Manager | None = None


class FleetFile(msgspec.Struct, frozen=True):
    """One file: its name, its YAML nodes, and its contents."""

    file: str
    root: MappingNode
    contents: Contents

    @property
    def fleet(self) -> RmfFleet:
        """The section `rmf_fleet`."""
        return self.contents.rmf_fleet

    def robots(self) -> Iterator[tuple[Path, str, RobotConfig]]:
        """Yield each robot's path, name and settings. The robots that RMF reads come last."""
        for top, found in ((("robots",), self.contents.robots), (ROBOTS, self.fleet.robots)):
            for name, robot in found.items():
                yield (*top, name), name, robot or RobotConfig()

    def references(self) -> Mapping[str, Pairs]:
        """Return level -> pairs. If the file has one list for all levels, the level is EVERY_LEVEL."""
        manager = self.contents.fleet_manager
        if manager and manager.reference_coordinates:
            return {EVERY_LEVEL: manager.reference_coordinates}
        return self.contents.reference_coordinates or {}

    def finishing(self) -> Iterator[tuple[Path, str | None]]:
        """Yield what RMF orders after a task (one of FINISHING), with its path: each robot's own order,
        and the fleet's order if it holds for a robot or there are no robots."""
        own = [(path, robot.finishing_request) for path, _, robot in self.robots()]
        if None in [request for _, request in own] or not own:
            yield ("rmf_fleet", FINISHES), _type(self.fleet.finishing_request)
        for path, request in own:
            if request is not None:
                yield (*path, FINISHES), _type(request)

    def unfit_finishing(self) -> Iterator[Problem]:
        """Yield a problem for each finishing request that RMF's adapter refuses."""
        of_fleet, path = self.fleet.finishing_request, ("rmf_fleet", FINISHES)
        requests = {path: _type(of_fleet), **dict(self.finishing())}
        for where, request in requests.items():
            if request is not None and request not in FINISHING:
                yield self.problem(where, unknown(FINISHES, request, FINISHING))
        if parking_spot(of_fleet) is not None:
            text = "would send all robots to one place: write this waypoint below a robot"
            yield self.problem((*path, "waypoint_name"), text)

    def problem(self, path: Path, text: str) -> Problem:
        """Return a problem at this path."""
        return problem_at(self.file, self.root, path, text)


def parking_spot(request: FinishingRequest) -> str | None:
    """Return the waypoint to which a robot goes after a task; None if the request names none."""
    if isinstance(request, FinishingTask) and request.type == "park":
        return request.waypoint_name
    return None


def _type(request: FinishingRequest) -> str | None:
    return request.type if isinstance(request, FinishingTask) else request


def load_fleet(file: str, text: bytes | None = None) -> FleetFile:
    """Read a fleet configuration. Raises SettingsError with its problems.

    `text`: the file's bytes, if the caller has them already.
    """
    page = YamlFile(file)
    root = compose(page, read(file, FLEET) if text is None else text, FLEET)
    page.check()
    plain = plain_values(page, root)
    pairs = plain.get("reference_coordinates")
    if isinstance(pairs, dict) and {"rmf", "robot"} <= pairs.keys():
        plain["reference_coordinates"] = {EVERY_LEVEL: pairs}
    return FleetFile(file, root, converted(file, root, plain, Contents, OF_ADAPTER))


def plain_values(page: YamlFile, root: MappingNode) -> dict[str, Any]:
    """Return a file's nodes as plain values. Raises SettingsError."""
    try:
        return cast(dict[str, Any], SafeConstructor().construct_document(root))
    except (YAMLError, ValueError) as error:
        reason = f"cannot be read: {' '.join(str(error).split())[:200]}"
        raise SettingsError([page.problem(root, reason)]) from None


def converted(file: str, root: MappingNode, plain: dict[str, Any], wanted: type[T], asks: str) -> T:
    """Convert plain values to a struct. Raises SettingsError.

    `asks`: a question to the user, which is put at the end of the problem's text.
    """
    try:
        return msgspec.convert(plain, wanted, strict=False)
    except msgspec.ValidationError as error:
        text, _, where = str(error).partition(" - at `$")
        path = tuple(part for part in re.split(r"[.\[\]`]+", where) if part not in ("", "..."))
        what = f"{text[:1].lower()}{text[1:]}: {asks}"
        raise SettingsError([problem_at(file, root, path, what)]) from None


def problem_at(file: str, root: MappingNode, path: Path, text: str) -> Problem:
    """Return a problem at a path of a file."""
    spot = Spot(root, root, "the file")
    return YamlFile(file).problem(locate(spot, path).key, text)
