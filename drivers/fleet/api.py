"""The HTTP interface of a fleet manager, as the YAML describes it: paths of calls, fields of answers,
and tests of answers. The calls are those of the RobotAPI class in the tutorial of RMF's fleet
adapter.

Paths and bodies may contain these placeholders for values of the command:

    $robot        the robot's name at its manager
    $id           the command's number, which the manager must report as completed
    $running      for stop, the number of the stopped command
    $map $x $y $yaw   the goal, in the manager's units
    $goal $dock   the goal's waypoint and its dock in RMF's graph
    $speed_limit  m/s; null in a body if there is no limit
    $activity     the action's category, or `dock`
    $description  the action's description as JSON; $description.zone is one of its values

If a text in a body consists only of a placeholder (`"$x"`), the value itself replaces the text, for
example a number.
"""

import math
import re
from collections.abc import Iterator, Mapping
from typing import Annotated, Final, Literal
from urllib.parse import quote

import msgspec

from bridges.kinds.fleet.signals import Pose, RobotCommand
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from drivers.hal import http
from drivers.http_call import Call
from drivers.json_fields import Field, JsonFlag

PLACE: Final = re.compile(r"\$([a-z_]+)((?:\.[A-Za-z0-9_]+)*)")
GOAL: Final = ("map", "x", "y", "yaw", "goal", "dock", "speed_limit")
KNOWN: Final = ("robot", "id", "running", *GOAL, "activity", "description")
Part = Literal["position", "map", "battery", "completed", "path", "status"]
Json = object
LENGTHS: Final = {"m": 1.0, "cm": 0.01, "mm": 0.001}


class PathFields(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The fields of the robot's path. The path is the list of places that the manager has planned for
    the robot, in driving order."""

    list: Annotated[
        Field, tells("the field with the list of places. It is null or [] if there is no path.")
    ]
    x: Annotated[Field, tells("the x coordinate in each item.")] = "x"
    y: Annotated[Field, tells("the y coordinate in each item.")] = "y"
    map: Annotated[
        Field | None,
        tells("the name of the map in each item. Without this key it is the robot's map."),
    ] = None


class RobotFields(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The fields of the answer about one robot. Each field is a path of names with dots between
    them."""

    map: Annotated[
        Field, tells("the name of the robot's map: the name of the level in RMF's graph.")
    ]
    x: Annotated[Field, tells("the robot's x coordinate.")]
    y: Annotated[Field, tells("the robot's y coordinate.")]
    yaw: Annotated[Field, tells("the robot's direction.")]
    battery: Annotated[Field, tells("the battery's charge.")]
    name: Annotated[
        Field | None, tells("the robot's name or id. The daemon refuses an answer about another.")
    ] = None
    completed: Annotated[
        Field | None, tells("the number of the last completed command; null before the first.")
    ] = None
    moving: Annotated[JsonFlag | None, tells("the robot drives or turns.")] = None
    charging: Annotated[JsonFlag | None, tells("the robot is being charged.")] = None
    ready: Annotated[
        JsonFlag | None, tells("the robot takes orders: it is in automatic mode, for example.")
    ] = None
    fault: Annotated[
        Field | None,
        tells("the robot's own fault. Any text means a fault, and null means no fault."),
    ] = None
    path: Annotated[
        PathFields | None, tells("the robot's path; `control: traffic_light` needs it.")
    ] = None
    paused: Annotated[JsonFlag | None, tells("the robot is paused, and waits for `resume`.")] = None
    time: Annotated[
        Field | None,
        tells("""the time or the counter of the robot's last report, a number that only grows. It
        shows when a manager repeats an old answer, because it has lost the robot."""),
    ] = None

    def part_of(self, field: str) -> Part:
        """Return the part of a robot's state (such as `position`) that this field belongs to."""
        parts: dict[str, Part] = {"x": "position", "y": "position", "yaw": "position"}
        own: dict[str, Part] = {"map": "map", "battery": "battery", "completed": "completed"}
        return (parts | own | {"path": "path"}).get(field, "status")


class AllRobots(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The fields of an answer that covers all robots. The daemon requests this answer once in each
    round of readings, however many robots there are."""

    list: Annotated[Field, tells("the field with the list of robots.")]
    name: Annotated[Field, tells("the robot's name or id in each item.")]


class FleetUnits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The units of the manager. The `reference_coordinates` of the YAML are always in metres, with y
    upwards."""

    length: Annotated[Literal["m", "cm", "mm"], tells("the unit of x and y.")] = "m"
    angle: Annotated[Literal["rad", "deg"], tells("the unit of yaw.")] = "rad"
    battery: Annotated[Literal["percent", "fraction"], tells("the unit of battery.")] = "percent"
    y_axis: Annotated[
        Literal["up", "down"],
        tells("`down` for maps in pixels, where y grows downwards: y and yaw change sign."),
    ] = "up"

    def read(self, at: Pose) -> Pose:
        """Convert a place from the manager's units to metres and radians, with y upwards."""
        length, sign = LENGTHS[self.length], -1.0 if self.y_axis == "down" else 1.0
        yaw = math.radians(at.yaw) if self.angle == "deg" else at.yaw
        return Pose(at.map, at.x * length, sign * at.y * length, sign * yaw)

    def written(self, at: Pose) -> Pose:
        """Convert a place in metres and radians to the manager's units."""
        length, sign = LENGTHS[self.length], -1.0 if self.y_axis == "down" else 1.0
        yaw = math.degrees(at.yaw) if self.angle == "deg" else at.yaw
        return Pose(at.map, at.x / length, sign * at.y / length, sign * yaw)


class FleetApi(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The interface of one make of fleet manager. The paths are relative to the bus's `api_base`."""

    state_path: Annotated[
        http.Path, tells("the path where GET reads the state of one robot, or of all robots.")
    ]
    fields: Annotated[RobotFields, tells("the fields of one robot.")]
    navigate: Annotated[
        Call | None, tells("sends the robot to a goal; `control: full` needs it.")
    ] = None
    stop: Annotated[Call | None, tells("stops the robot; `control: full` needs it.")] = None
    pause: Annotated[Call | None, tells("pauses the robot; `control: traffic_light` needs it.")] = (
        None
    )
    resume: Annotated[
        Call | None, tells("lets a paused robot drive on; `control: traffic_light` needs it.")
    ] = None
    robots: Annotated[
        AllRobots | None,
        tells("the fields of the list of robots, if `state_path` answers for all robots."),
    ] = None
    paths: Annotated[
        dict[Part, http.Path],
        tells("""part of the state -> the path to read this part from, if it is not in the answer to
        `state_path`. The parts are `position`, `map`, `battery`, `completed`, `path`, and `status`
        for all other fields. Each path costs one more call for each robot."""),
    ] = {}
    units: Annotated[FleetUnits, tells("the units, if they differ.")] = FleetUnits()
    accepted: Annotated[
        JsonFlag | None,
        tells("""the field that tells whether the manager accepts a command. The daemon reports a
        refusal, and sends the command again later. Without this key the HTTP status decides."""),
    ] = None
    dock: Annotated[
        Call | None,
        tells("docks the robot at `$dock`. Without this call `navigate` sends it there."),
    ] = None
    localize: Annotated[
        Call | None,
        tells("""tells the robot its place after a lift ride. Without this call the robot must find
        its place itself."""),
    ] = None
    actions: Annotated[
        dict[Name, Call],
        tells("the name of an action in `config.yaml` -> the call that begins the action."),
    ] = {}

    def calls(self) -> Iterator[tuple[tuple[str, ...], Call]]:
        """Yield each command with its path in the YAML."""
        for name in ("navigate", "stop", "dock", "localize", "pause", "resume"):
            if call := getattr(self, name):
                yield (name,), call
        for name, call in self.actions.items():
            yield ("actions", name), call

    def lacks(self, control: str) -> str:
        """Return a text that names the keys that `control: CONTROL` needs and the YAML lacks. Return ""
        if nothing is missing."""
        light = {"pause": self.pause, "resume": self.resume, "fields: path": self.fields.path}
        full = {"navigate": self.navigate, "stop": self.stop}
        needed = light if control == "traffic_light" else full
        missing = ", ".join(key for key, there in needed.items() if there is None)
        return f"control: {control} needs {missing} in the interface" if missing else ""

    def problems(self) -> Remarks:
        """Yield a problem for each placeholder that has no value. Yield a problem for settings that
        contradict or need each other."""
        yield from _strangers(("state_path",), self.state_path, ("robot",))
        for part, path in self.paths.items():
            yield from _strangers(("paths", part), path, ("robot",))
        for where, call in self.calls():
            allowed = (
                KNOWN if where[0] == "actions" else ("robot", "id", "running", *GOAL, "activity")
            )
            yield from _strangers((*where, "path"), call.path, allowed)
            yield from _strangers((*where, "body"), call.body or "", allowed)
        if self.robots and "$robot" in self.state_path:
            yield (
                ("robots",),
                "contradicts $robot in state_path, which reads one robot: delete $robot, or robots",
            )
        if self.actions and self.fields.completed is None:
            yield ("actions",), "needs the field 'completed', which shows the end of an action"


def _strangers(where: tuple[str, ...], text: str, allowed: tuple[str, ...]) -> Remarks:
    for found in PLACE.finditer(text):
        if found[1] not in allowed:
            yield (
                where,
                f"'${found[1]}' has no value here; the placeholders here are ${', $'.join(allowed)}",
            )


def values(command: RobotCommand, robot: str, units: FleetUnits) -> Mapping[str, Json]:
    """Return the values of the placeholders for one command."""
    found: dict[str, Json] = {"robot": robot, "id": command.id, "running": command.of}
    found["activity"] = command.activity or command.doing
    found["description"] = msgspec.json.decode(command.description)
    if goal := command.goal:
        at = units.written(goal.at)
        found |= {"map": at.map, "x": at.x, "y": at.y, "yaw": at.yaw}
        found |= {"goal": goal.name, "dock": goal.dock, "speed_limit": goal.speed_limit}
    return found


def path_with(text: str, given: Mapping[str, Json]) -> str:
    """Return a path with the placeholders replaced by their values. Quote the values for a URL."""
    return PLACE.sub(lambda at: quote(_text(_value(at, given)), safe=""), text)


def body_with(text: str, given: Mapping[str, Json]) -> str:
    """Return a JSON body with the placeholders replaced by their values."""
    return msgspec.json.encode(_filled(msgspec.json.decode(text), given)).decode()


def _filled(part: Json, given: Mapping[str, Json]) -> Json:
    match part:
        case dict():
            return {key: _filled(value, given) for key, value in part.items()}
        case list():
            return [_filled(value, given) for value in part]
        case str() if whole := PLACE.fullmatch(part):
            return _value(whole, given)
        case str():
            return PLACE.sub(lambda at: _text(_value(at, given)), part)
    return part


def _value(place: re.Match[str], given: Mapping[str, Json]) -> Json:
    """Return a placeholder's value. Return None if the command has no such value."""
    value = given.get(place[1])
    for key in filter(None, place[2].split(".")):
        value = value.get(key) if isinstance(value, dict) else None
    return value


def _text(value: Json) -> str:
    if value is None:
        return ""
    return value if isinstance(value, str) else msgspec.json.encode(value).decode()
