"""The part of a fleet's YAML that does not depend on the way to its robots."""

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
"""The path of a file, from the root or from the YAML's own folder."""


class FleetFiles(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """RMF's own two files about the fleet, and its power over the robots."""

    config: Annotated[
        FilePath,
        tells("""the fleet adapter's `config.yaml`, as RMF's tutorial has it: a path from the root, or
        from this file's folder."""),
    ]
    graph: Annotated[FilePath, tells("the fleet's navigation graph, made by RMF's traffic editor.")]
    control: Annotated[
        Literal["full", "traffic_light"],
        tells("""`full`: RMF sends the robots to their goals. `traffic_light`: their own manager sends
        them, and RMF only lets them pause and go on."""),
    ] = "full"
    server_uri: Annotated[
        Name | None,
        tells("the api-server of rmf-web (`ws://host:8000/_internal`), if there is one."),
    ] = None


class RobotDurations(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Durations and distances of a robot."""

    stale_after_s: Annotated[
        Silence,
        tells("""after so long without a good reading the robot counts as silent and gets no new task;
        a place that was not read is never sent to RMF."""),
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
        tells("""after so many vain attempts of one command the robot gets no new task. The attempts go
        on."""),
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
        tells("""with `control: traffic_light`: the longest way of a robot from the order to pause until
        it stands, with the network's delay."""),
    ] = 1.0
    off_graph_m: Annotated[
        Distance,
        tells("the distance from every lane of the graph beyond which a robot is off the graph."),
    ] = 1.0


class FleetRobotSettings(DeviceSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One robot, except the way to it. Its name is that of `config.yaml`."""

    known_as: Annotated[
        Name | None, tells("the robot's name or id at its manager, if it differs.")
    ] = None
    maps: Annotated[
        dict[Name, Name],
        tells("level of RMF's graph -> the robot's name of that map, if different."),
    ] = msgspec.field(default_factory=dict)
    limits: Annotated[
        RobotDurations, tells("the durations and distances that differ from their defaults.")
    ] = RobotDurations()
    on_death: Annotated[
        Literal["finish", "stop", "pause"],
        tells("""`finish`: when the daemon ends, a robot drives on to its last goal, as RMF has planned
        and as robots with any fleet adapter do. `stop`, `pause`: the robot is stopped or paused,
        wherever it is."""),
    ] = "finish"

    def level_of(self, at: Pose) -> Pose:
        """Return a place on the robot's map under the level's name."""
        levels = {theirs: level for level, theirs in self.maps.items()}
        return replace(at, map=levels.get(at.map, at.map)) if levels else at

    def theirs(self, command: RobotCommand) -> RobotCommand:
        """Return a command under the robot's own name of the map."""
        if command.goal is None or not self.maps:
            return command
        at = command.goal.at
        at = replace(at, map=self.maps.get(at.map, at.map))
        return replace(command, goal=replace(command.goal, at=at))

    def lacks(self, control: str) -> str:
        """Return why RMF cannot control this robot in this way; "" if it can."""
        return ""

    def known_actions(self) -> Collection[str]:
        """Return the names of RMF's actions that the robot can carry out."""
        return ()

    def stale_after(self) -> float:
        """Return `stale_after_s` of the limits."""
        return self.limits.stale_after_s

    def problems(self) -> Remarks:
        """Yield contradictions between fields."""
        if len(set(self.maps.values())) < len(self.maps):
            yield ("maps",), "two levels have the same map: RMF could not tell them apart"
        if self.limits.arrived_m > self.limits.off_graph_m:
            text = "is longer than off_graph_m: a robot beside the graph would count as arrived"
            yield ("limits", "arrived_m"), text
