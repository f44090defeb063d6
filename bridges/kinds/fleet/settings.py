"""The part of a fleet's YAML that does not depend on the interface to its robots."""

from collections.abc import Collection
from typing import Annotated, Literal

import msgspec
from msgspec import Meta
from msgspec.structs import replace

from bridges.kinds.fleet.signals import Pose, RobotCommand
from bridges.kinds.shared.fields import DeviceSettings, Name, Timeout, tells
from bridges.kinds.shared.remarks import Remarks

Silence = Annotated[float, Meta(ge=0.5, le=300, extra={"unit": "s"})]
Distance = Annotated[float, Meta(ge=0.05, le=50, extra={"unit": "m"})]
Angle = Annotated[float, Meta(ge=1, le=180, extra={"unit": "°"})]
FilePath = Annotated[str, Meta(min_length=1, max_length=4096, pattern=r"^[^\x00-\x1f\x7f]*$(?!\n)")]
"""The path of a file: absolute, or relative to the folder of the YAML."""


class FleetFiles(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The two files that RMF itself has about the fleet, and whether RMF sends the robots or only
    pauses them."""

    config: Annotated[
        FilePath,
        tells("""the fleet adapter's `config.yaml`, in the form of RMF's tutorial. The path is
        absolute, or relative to this file's folder."""),
    ]
    graph: Annotated[FilePath, tells("the fleet's navigation graph, made by RMF's traffic editor.")]
    control: Annotated[
        Literal["full", "traffic_light"],
        tells("""`full`: RMF sends the robots to their goals. `traffic_light`: the robots' own
        manager sends them, and RMF can only pause and resume them."""),
    ] = "full"
    server_uri: Annotated[
        Name | None,
        tells("the api-server of rmf-web (`ws://host:8000/_internal`), if there is one."),
    ] = None


class RobotDurations(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Durations and distances of a robot."""

    stale_after_s: Annotated[
        Silence,
        tells("""the time without a good reading after which the robot counts as silent and gets no
        new task. RMF never gets a place that was not read."""),
    ] = 5.0
    obeys_s: Annotated[
        Timeout,
        tells("how long a robot may stand after a command; then the command is sent again."),
    ] = 10.0
    stops_s: Annotated[
        Timeout, tells("how long a robot may drive on after a stop; then the stop is sent again.")
    ] = 3.0
    docks_s: Annotated[
        Timeout,
        tells("how long a docked robot may wait for its charge; then it is sent to dock again."),
    ] = 60.0
    attempts: Annotated[
        Annotated[int, Meta(ge=1, le=20)],
        tells("""the number of failed attempts of one command after which the robot gets no new
        task. The daemon still sends the command again."""),
    ] = 3
    arrived_m: Annotated[
        Distance, tells("the greatest distance from its goal at which a robot counts as arrived.")
    ] = 0.5
    arrived_deg: Annotated[
        Angle,
        tells("""the greatest turn away from its goal's direction at which a robot counts as arrived, if
        the robot does not report completed commands."""),
    ] = 20.0
    pauses_m: Annotated[
        Distance,
        tells("""with `control: traffic_light`: the longest distance that a robot still drives
        after an order to pause. It includes the way during the network's delay."""),
    ] = 1.0
    off_graph_m: Annotated[
        Distance,
        tells("the distance from every lane of the graph beyond which a robot is off the graph."),
    ] = 1.0


class FleetRobotSettings(DeviceSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The settings of one robot, except its interface. Its key is the robot's name in `config.yaml`."""

    known_as: Annotated[
        Name | None, tells("the robot's name or id at its manager, if it differs.")
    ] = None
    maps: Annotated[
        dict[Name, Name],
        tells("""level of RMF's graph -> the name that the robot has for the map of this level, if
        different."""),
    ] = msgspec.field(default_factory=dict)
    limits: Annotated[
        RobotDurations, tells("the durations and distances that differ from their defaults.")
    ] = RobotDurations()
    on_death: Annotated[
        Literal["finish", "stop", "pause"],
        tells("""what a robot does when the daemon ends. `finish`: it drives on to its last goal,
        as RMF has planned. With any other fleet adapter, robots do the same. `stop`, `pause`: it
        is stopped or paused, wherever it is."""),
    ] = "finish"

    def level_of(self, at: Pose) -> Pose:
        """Return the same place under RMF's name of the level, in place of the robot's name of that
        map."""
        levels = {theirs: level for level, theirs in self.maps.items()}
        return replace(at, map=levels.get(at.map, at.map)) if levels else at

    def theirs(self, command: RobotCommand) -> RobotCommand:
        """Return the same command under the robot's name of the map, in place of RMF's name of that
        level."""
        if command.goal is None or not self.maps:
            return command
        at = command.goal.at
        at = replace(at, map=self.maps.get(at.map, at.map))
        return replace(command, goal=replace(command.goal, at=at))

    def lacks(self, control: str) -> str:
        """Return the reason why RMF cannot control this robot with this `control`; "" if it can."""
        return ""

    def known_actions(self) -> Collection[str]:
        """Return the names of RMF's actions that the robot can carry out."""
        return ()

    def stale_after(self) -> float:
        """Return `stale_after_s` of the limits."""
        return self.limits.stale_after_s

    def problems(self) -> Remarks:
        """Yield the fields that contradict each other."""
        if len(set(self.maps.values())) < len(self.maps):
            yield ("maps",), "two levels have the same map: RMF could not tell them apart"
        if self.limits.arrived_m > self.limits.off_graph_m:
            text = "is longer than off_graph_m: a robot beside the graph would count as arrived"
            yield ("limits", "arrived_m"), text
