"""The fleets of `make demo-charging`, and the pads that their robots stand on.

A robot that arrives at a charger's waypoint stands on that charger's pad. Its battery fills while the
charger reports CHARGING. The first fleet's finishing request is `charge`, and the second fleet's is
`nothing`.
"""

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Final, cast, get_args

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator.settings import CoordinatorSettings
from bridges.messages import definitions as d
from bridges.messages.topics import CHARGING_ASSIGNMENTS, DIAGNOSTICS, AnyTopic
from bridges.settings.fleet_config import load_fleet
from hal_fakes.demo.world import World
from workbench.rmf_model import Party, Said
from workbench.rmf_model.fleet import Finishing, FleetAdapter, FleetRobot, Graph

WARD: Final = "ward"
DRIVE_S: Final = 1.0
FILLS_PER_S: Final = 15.0
CONFIGURED: Final = {"tiny": Path(__file__).parents[2] / "config" / "fleet_tiny.yaml"}
"""The configuration file of each fleet's adapter. A fleet without a file here has only its finishing
request in FINISHING."""
FINISHING: Final[dict[str, Finishing]] = {"porter": "nothing"}


class DemoFleets(Party):
    """Both fleets, as one participant on RMF's side. The participant also hears the coordinator's
    diagnostics. `queue` is the coordinator's queue. `shown` has all keys and values of the
    diagnostics."""

    subscribes: Sequence[AnyTopic] = (CHARGING_ASSIGNMENTS, DIAGNOSTICS)

    def __init__(self, world: World, site: CoordinatorSettings) -> None:
        self.world = world
        self.queue = "-"
        self.shown: dict[str, str] = {}
        self.fleets = {name: _fleet(name, site) for name in site.fleets}
        self._who = {who.name: who for who in site.robots()}
        self._stations = {
            (fleet, place): station
            for station, places in site.places().items()
            for fleet, place in places.items()
        }
        self._on_pad: dict[str, str] = {}
        self._filled_at = world.wall()

    # ---- methods that the world calls

    def hear(self, message: d.Message, now: float) -> list[Said]:
        """Take charging assignments and the coordinator's diagnostics."""
        if isinstance(message, d.DiagnosticArray):
            self._diagnosed(message)
            return []
        return [said for fleet in self.fleets.values() for said in fleet.hear(message, now)]

    def tick(self, now: float) -> list[Said]:
        """Drive robots on, fill batteries, and move robots onto and off pads."""
        said = [said for fleet in self.fleets.values() for said in fleet.tick(now)]
        self._fill(now)
        for who in self._who.values():
            self._stands(who)
        return said

    def wake_at(self) -> float:
        """Return 0, because the fleets are always due."""
        return 0.0

    # ---- methods that the scenarios call

    def robot(self, who: str) -> FleetRobot:
        """Return this robot as its fleet adapter knows it."""
        return self.fleets[self._who[who].fleet].robots[who]

    def needs(self, who: str, percent: float) -> None:
        """Lower the robot's battery, so that RMF finds it low."""
        self.world.note(f"is at {percent:.0f} %: its fleet begins a ChargeBattery", who)
        self.fleets[self._who[who].fleet].charge(who, self.world.wall(), percent)

    def leaves(self, who: str, place: str = WARD) -> None:
        """Give the robot work elsewhere."""
        self.world.note(f"has work at {place}", who)
        self.fleets[self._who[who].fleet].works(who, place, self.world.wall())

    def rests(self, who: str, percent: float) -> None:
        """End the robot's work, with this charge of its battery."""
        robot, fleet = self.robot(who), self.fleets[self._who[who].fleet]
        robot.battery_percent = percent
        finishing = f"finishing_request: {fleet.finishing}"
        self.world.note(f"has done its work, at {percent:.0f} %: {finishing}", who)
        fleet.rests(who, self.world.wall())

    def strays(self, who: str, place: str) -> None:
        """Drive the robot to a place that nobody assigned."""
        self.world.note(f"drives to {place} by mistake", who)
        self.fleets[self._who[who].fleet].strays(who, place, self.world.wall())

    # ---- private methods

    def _diagnosed(self, message: d.DiagnosticArray) -> None:
        """Record the coordinator's queue when it changes."""
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            if values.get("kind") == "charger_coordinator" and "queue" in values:
                if values["queue"] != self.queue and values["queue"] != "-":
                    self.world.note(f"   queue: {values['queue']}")
                self.queue, self.shown = values["queue"], values

    def _fill(self, now: float) -> None:
        passed_s, self._filled_at = now - self._filled_at, now
        for who, charger in self._on_pad.items():
            if self.world.charger_is(charger, "CHARGING", who):
                robot = self.robot(who)
                percent = robot.battery_percent + passed_s * FILLS_PER_S
                robot.battery_percent = min(100.0, percent)

    def _stands(self, who: RobotName) -> None:
        """Put a robot onto the pad of its charger. If the robot has left its pad, take it off this
        pad."""
        before = self._on_pad.get(who.name)
        charger = self._stations.get((who.fleet, self.robot(who.name).place))
        if charger == before:
            return
        if before is not None:
            del self._on_pad[who.name]
            self.world.press(before, str(who), False)
        if charger is not None:
            self._on_pad[who.name] = charger
            self.world.note(f"stands on the pad of {charger}", who.name)
            self.world.press(charger, str(who), True)


def _fleet(name: str, site: CoordinatorSettings) -> FleetAdapter:
    settings = site.fleets[name]
    graph = {place: (at.level, at.x, at.y) for place, at in settings.waypoints.items()}
    graph[WARD] = ("L1", -20.0, 0.0)
    homes = {who: robot.waits_at for who, robot in settings.robots.items()}
    if name in CONFIGURED:
        return tutorial_fleet(CONFIGURED[name], graph, DRIVE_S, only=homes)
    return FleetAdapter(name, graph, homes, DRIVE_S, FINISHING[name])


def tutorial_fleet(
    file: Path, graph: Graph, drive_s: float, only: Collection[str] = ()
) -> FleetAdapter:
    """Make a fleet from its adapter's configuration file (in the form of RMF's tutorial). Each robot
    begins at its charger's waypoint. Raises SettingsError or ValueError.

    `graph`: the fleet's navigation graph. `drive_s`: the time (s) of every drive. `only`: the robots to
    take from the file; if empty, all of them.
    """
    found = load_fleet(str(file))
    places: dict[str, str] = {}
    for _, name, robot in found.robots():
        _, waypoint = robot.waypoint()
        if only and name not in only:
            continue
        if waypoint is None or waypoint not in graph:
            raise ValueError(f"{file}: '{name}' has its charger at {waypoint!r}, not in the graph")
        places[name] = waypoint
    _, request = next(found.finishing())
    request = request or "nothing"
    if request not in get_args(Finishing):
        raise ValueError(f"{file}: no finishing_request {request!r}")
    return FleetAdapter(found.fleet.name, graph, places, drive_s, cast(Finishing, request))
