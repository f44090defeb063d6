"""A fleet manager on HTTP. One server answers for all robots of the manager, with the interface that
the YAML describes.

The server matches paths and bodies with the YAML's own templates. So it understands every interface
that the driver can speak. `hal_fakes/http.py` describes the failures of server, headers and body. If
one robot has such a failure, the whole manager has it.
"""

import json
import re
import time
from collections.abc import Sequence
from typing import Final, cast

import msgspec

from bridges.kinds.fleet.signals import Pose
from bridges.settings.config import Config
from drivers.fleet.api import PLACE, FleetApi, PathFields
from drivers.fleet.http import HttpRobotSettings
from drivers.http_call import Call
from drivers.json_fields import found
from hal_fakes.fake import Fake
from hal_fakes.json_answers import put, value_of
from hal_fakes.plants import robot
from hal_fakes.plants.plant import Plant
from hal_fakes.plants.robot import RobotOrder, RobotSeen

PARTS: Final = ("server", "headers", "body")


class FakeFleetRobot:
    """One robot of the manager (`hal_fakes.http.FreeStation`)."""

    def __init__(self, name: str, plant: Plant, settings: HttpRobotSettings) -> None:
        self.plant = plant
        self.robot = settings.known_as or name
        self._api: FleetApi = settings.interface()
        self._maps, self._level_of = settings.maps, settings.level_of
        self._last: bytes | None = None

    def reply(
        self, method: str, path: str, body: bytes, all_stations: Sequence["FakeFleetRobot"]
    ) -> bytes | None:
        """Answer a request about this robot. Return None if the request is not about this robot."""
        now = time.monotonic()
        self.plant.advance(now)
        if method == "GET":
            for state_path in dict.fromkeys((self._api.state_path, *self._api.paths.values())):
                given = _matched(state_path, path)
                if given is not None and given.get("robot", self.robot) == self.robot:
                    return self._state(state_path, all_stations)
        for where, call in self._api.calls():
            given = _matched(call.path, path) if call.method == method else None
            if given is not None:
                given |= _from_body(call, body)
                if given.get("robot", self.robot) == self.robot:
                    return self._obey(where, given, now)
        return None

    def _state(self, path: str, all_stations: Sequence["FakeFleetRobot"]) -> bytes:
        server = self.plant.failures.get("server")
        if server == "stuck" and self._last is not None:
            return self._last
        said: dict[str, object] = {}
        if self._api.robots and path == self._api.state_path:
            put(said, self._api.robots.list, [each.item() for each in all_stations])
        else:
            said = self.item()
        text = json.dumps(said).encode()
        self._last = text
        return {"off": b"", "garbage": text[:-9]}.get(self.plant.failures.get("body") or "", text)

    def item(self) -> dict[str, object]:
        """Return this robot's part of an answer."""
        self.plant.advance(time.monotonic())
        seen = cast(RobotSeen, self.plant.reading())
        fields, at = self._api.fields, self._api.units.written(seen.at)
        level = self._maps.get(at.map, at.map)
        scale = 100.0 if self._api.units.battery == "percent" else 1.0
        said: dict[str, object] = {}
        numbers = {"map": level, "x": at.x, "y": at.y, "yaw": at.yaw}
        wrong = "wrong" in (self.plant.failures.get("server"), self.plant.failures.get("body"))
        completed = int(seen.completed) if seen.completed.isdecimal() else seen.completed or None
        others = {
            "battery": "?" if wrong else seen.battery * scale,
            "name": self.robot,
            "completed": completed,
            "fault": seen.fault or None,
            "time": seen.said_at,
        }
        for name, value in {**numbers, **others}.items():
            if place := getattr(fields, name):
                put(said, place, value)
        for name, is_so in (
            ("moving", seen.moving),
            ("charging", seen.charging),
            ("ready", not seen.manual),
            ("paused", seen.paused),
        ):
            if flag := getattr(fields, name):
                put(said, flag.field, value_of(flag, is_so))
        if path := fields.path:
            put(said, path.list, [self._place(at, path) for at in seen.path])
        if self._api.robots:
            put(said, self._api.robots.name, self.robot)
        return said

    def _place(self, place: Pose, fields: PathFields) -> dict[str, object]:
        at, item = self._api.units.written(place), dict[str, object]()
        put(item, fields.x, at.x)
        put(item, fields.y, at.y)
        if fields.map:
            put(item, fields.map, self._maps.get(at.map, at.map))
        return item

    def _obey(self, where: tuple[str, ...], given: dict[str, object], now: float) -> bytes:
        doing = {"navigate": "go", "dock": "go", "actions": "act"}.get(where[0], where[0])
        order = RobotOrder(str(given.get("id", "0")), doing, self._goal(given), _limit(given))
        manual = cast(RobotSeen, self.plant.reading()).manual
        self.plant.drive(msgspec.json.encode(order).decode(), True, now)
        said: dict[str, object] = {"msg": "the robot is in manual mode" if manual else ""}
        if self._api.accepted:
            put(said, self._api.accepted.field, value_of(self._api.accepted, not manual))
        return json.dumps(said).encode()

    def _goal(self, given: dict[str, object]) -> Pose | None:
        if "x" not in given:
            return None
        x, y, yaw = (float(str(given[key])) for key in ("x", "y", "yaw"))
        at = self._api.units.read(Pose(str(given.get("map", "")), x, y, yaw))
        return self._level_of(at)


def _limit(given: dict[str, object]) -> float | None:
    limit = given.get("speed_limit")
    return float(str(limit)) if limit not in (None, "", 0) else None


def _matched(template: str, path: str) -> dict[str, object] | None:
    """Return the values of a path's placeholders. Return None if the path does not match the
    template."""
    pattern, names, end = "", [], 0
    for place in PLACE.finditer(template):
        pattern += re.escape(template[end : place.start()]) + "([^&/?]*)"
        names.append(place[1] + place[2])
        end = place.end()
    hit = re.fullmatch(pattern + re.escape(template[end:]), path)
    return dict(zip(names, hit.groups(), strict=True)) if hit else None


def _from_body(call: Call, body: bytes) -> dict[str, object]:
    """Return the values of a body's placeholders."""
    if call.body is None or not body:
        return {}
    sent, given = json.loads(body), dict[str, object]()
    for field, text in _leaves(json.loads(call.body)):
        if isinstance(text, str) and (place := PLACE.fullmatch(text)):
            given[place[1] + place[2]] = found(sent, field)
    return given


def _leaves(part: object, path: str = "") -> list[tuple[str, object]]:
    if isinstance(part, dict):
        below = [_leaves(value, f"{path}.{key}" if path else key) for key, value in part.items()]
        return [leaf for leaves in below for leaf in leaves]
    return [(path, part)]


def _sited(config: Config, name: str) -> Plant:
    return robot.build(config, name, PARTS)


FAKE = Fake[HttpRobotSettings](
    plant=lambda name, settings, wires: robot.RobotPlant(name, Pose("L1", 0.0, 0.0), parts=PARTS),
    station=lambda plant, settings: FakeFleetRobot(plant.name, plant, settings),
    sited=_sited,
)
