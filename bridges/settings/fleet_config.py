"""The configuration file of a fleet adapter (EasyFullControl): the keys that our files must match.

    rmf_fleet:
      name: tiny
      recharge_threshold: 0.2           # below it RMF gives a robot no task
      recharge_soc: 1.0                 # RMF's ChargeBattery ends there
      finishing_request: charge         # charge, park or nothing
      publish_fleet_state: 10.0         # Hz
      account_for_battery_drain: true
      lift_emergency_levels: {Lift1: L1}   # since Iron; where a robot in the car gets out in an alarm
      robots: {AMR01: {charger: charger_a}}
    reference_coordinates: {L1: {rmf: [[x, y], ...], robot: [[x, y], ...]}}

Older files have `robots:` beside `rmf_fleet:`, with `rmf_config: {charger: {waypoint: charger_a}}`, and
one pair of lists for all levels. Source: open-rmf/fleet_adapter_template, config.yaml and
fleet_adapter.py. All other keys are ignored.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Annotated

import msgspec
from yaml import MappingNode, YAMLError
from yaml.constructor import SafeConstructor

from bridges.settings.similarity import Point
from bridges.yaml.parsing import Problem, SettingsError, Sort, YamlFile, compose, read
from bridges.yaml.positions import Spot, locate

FLEET = Sort("fleet configuration", "rmf_fleet: ...", 256 * 1024, 20_000)
EVERY_LEVEL = ""
"""The level name for reference coordinates that apply to every level."""
Soc = Annotated[float, msgspec.Meta(ge=0, le=1)]
Path = tuple[str, ...]


class Charger(msgspec.Struct, frozen=True):
    """A robot's charger. `waypoint`: its name in the navigation graph."""

    waypoint: str | None = None


class OlderRobot(msgspec.Struct, frozen=True):
    """A robot's settings for RMF in an older file."""

    charger: Charger | None = None


class RobotConfig(msgspec.Struct, frozen=True):
    """One robot with its charger's waypoint, in the new or the older form."""

    charger: str | Charger | None = None
    rmf_config: OlderRobot | None = None

    def waypoint(self) -> tuple[Path, str | None]:
        """Return the waypoint's path below the robot, and its name."""
        if isinstance(self.charger, str):
            return ("charger",), self.charger
        if self.charger is not None:
            return ("charger", "waypoint"), self.charger.waypoint
        older = self.rmf_config.charger if self.rmf_config else None
        return ("rmf_config", "charger", "waypoint"), older.waypoint if older else None


class RmfFleet(msgspec.Struct, frozen=True):
    """The fleet. Percentages are fractions of 1 in this file."""

    name: str
    recharge_threshold: Soc | None = None
    recharge_soc: Soc | None = None
    finishing_request: str | None = None
    publish_fleet_state: float | None = None
    account_for_battery_drain: bool | None = None
    lift_emergency_levels: dict[str, str] = msgspec.field(default_factory=dict)
    robots: dict[str, RobotConfig | None] = msgspec.field(default_factory=dict)


class Pairs(msgspec.Struct, frozen=True):
    """The same points on RMF's map and on the robot's map."""

    rmf: list[Point]
    robot: list[Point]


class Contents(msgspec.Struct, frozen=True):
    """The whole file."""

    rmf_fleet: RmfFleet
    robots: dict[str, RobotConfig | None] = msgspec.field(default_factory=dict)
    reference_coordinates: dict[str, Pairs] | None = None


class FleetFile(msgspec.Struct, frozen=True):
    """One file: its name, its YAML nodes, and its contents."""

    file: str
    root: MappingNode
    contents: Contents

    @property
    def fleet(self) -> RmfFleet:
        """The fleet."""
        return self.contents.rmf_fleet

    def robots(self) -> Iterator[tuple[Path, str, RobotConfig]]:
        """Yield each robot's path, name and settings."""
        for top, found in (
            (("rmf_fleet", "robots"), self.fleet.robots),
            (("robots",), self.contents.robots),
        ):
            for name, robot in found.items():
                yield (*top, name), name, robot or RobotConfig()

    def references(self) -> Mapping[str, Pairs]:
        """Return level -> pairs; the level is EVERY_LEVEL if the file has one list for all levels."""
        return self.contents.reference_coordinates or {}

    def problem(self, path: Path, text: str) -> Problem:
        """Return a problem at this path."""
        return _problem(self.file, self.root, path, text)


def load_fleet(file: str) -> FleetFile:
    """Read a fleet configuration. Raises SettingsError with its problems."""
    page = YamlFile(file)
    root = compose(page, read(file, FLEET), FLEET)
    page.check()
    try:
        plain = SafeConstructor().construct_document(root)
    except (YAMLError, ValueError) as error:
        reason = f"cannot be read: {' '.join(str(error).split())[:200]}"
        raise SettingsError([page.problem(root, reason)]) from None
    pairs = plain.get("reference_coordinates")
    if isinstance(pairs, dict) and {"rmf", "robot"} <= pairs.keys():
        plain["reference_coordinates"] = {EVERY_LEVEL: pairs}
    try:
        return FleetFile(file, root, msgspec.convert(plain, Contents, strict=False))
    except msgspec.ValidationError as error:
        text, _, where = str(error).partition(" - at `$")
        path = tuple(part for part in re.split(r"[.\[\]`]+", where) if part not in ("", "..."))
        what = f"{text[:1].lower()}{text[1:]}: is this a fleet adapter's configuration?"
        raise SettingsError([_problem(file, root, path, what)]) from None


def _problem(file: str, root: MappingNode, path: Path, text: str) -> Problem:
    spot = Spot(root, root, "the file")
    return YamlFile(file).problem(locate(spot, path).key, text)
