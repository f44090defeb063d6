"""Simulated robots that speak VDA 5050, behind a real broker. Each robot is an MQTT client with a last
will.

A robot publishes its state at each event, and each QUIET_S. While it drives, it also publishes its
place (`visualization`). It refuses a second order while it still has an order. It also refuses an order
that does not begin where the robot stands. Failures:

|        | off               | stuck           | slow       | garbage           | wrong           |
| unit   | drops off the net | repeats a state | obeys late | publishes noise   | another serial  |
| server | killed            | frozen          | frozen     | killed            | killed          |
"""

import json
import random
import threading
import time
from typing import Final, cast

import msgspec
import paho.mqtt.client as paho
from paho.mqtt.enums import CallbackAPIVersion

from bridges.kinds.fleet.signals import Pose
from bridges.settings.config import Config
from drivers.fleet.vda5050 import VdaRobotSettings
from drivers.fleet.vda_messages import DIALECTS, Json
from drivers.hal.timestamps import utc
from hal_fakes.fake import Fake
from hal_fakes.mosquitto import end
from hal_fakes.plants import robot
from hal_fakes.plants.plant import Plant
from hal_fakes.plants.robot import RobotOrder, RobotSeen

SHOWS_S: Final = 0.2
QUIET_S: Final = 10.0
LATE_S: Final = 5.0


class FakeVdaRobot:
    """One robot. `order`: its last order; `done`: has it been carried out, cancelled or failed?"""

    def __init__(self, name: str, plant: Plant, settings: VdaRobotSettings) -> None:
        self.plant, self.settings = plant, settings
        self.name = settings.known_as or name
        self._says = DIALECTS[settings.version]
        self._names = {
            what: settings.topic(what, name)
            for what in ("state", "visualization", "connection", "order", "instantActions")
        }
        self._order: Json = {}
        self._done = True
        self._node, self._number = "", 0
        self._actions: dict[str, Json] = {}
        self._instant: dict[str, Json] = {}
        self._errors: list[Json] = []
        self._headers = 0
        self._last: Json = {}
        self._told_at = self._shown_at = 0.0
        self._client: paho.Client | None = None
        self._hears = False
        self._lock = threading.Lock()
        self._sent, self._nodes = 0, list[Json]()
        self._noise = random.Random(name)

    def join(self, port: int) -> None:
        """Connect to the broker, and leave a last will there. The broker publishes the last will if the
        connection breaks."""
        client = paho.Client(CallbackAPIVersion.VERSION2)
        topic = self._names["connection"]
        client.will_set(topic, self._connection("CONNECTIONBROKEN"), qos=1, retain=True)
        client.on_message = self._take
        client.on_connect = self._joined
        client.on_subscribe = self._ready
        client.connect("127.0.0.1", port, keepalive=5)
        client.loop_start()
        self._client = client

    def leave(self) -> None:
        """Close the socket without MQTT's DISCONNECT, as if the robot drove out of the network."""
        client, self._client, self._hears = self._client, None, False
        if client is not None:
            sock = client.socket()
            if sock is not None:
                sock.close()
            end(client)

    def tick(self, now: float) -> None:
        """Let the robot move, and publish what is due."""
        with self._lock:
            self.plant.advance(now)
            seen = cast(RobotSeen, self.plant.reading())
            self._progress(seen)
            state = self._state(seen)
            event = {k: v for k, v in state.items() if k != self._says.place}
            if event != self._last or now >= self._told_at + QUIET_S:
                self._last, self._told_at = event, now
                self._publish("state", state)
            if seen.moving and now >= self._shown_at + SHOWS_S:
                self._shown_at = now
                self._publish("visualization", {self._says.place: self._place(seen)})

    def _joined(self, client: paho.Client, *_: object) -> None:
        client.subscribe([(self._names["order"], 0), (self._names["instantActions"], 0)])

    def _ready(self, client: paho.Client, *_: object) -> None:
        client.publish(self._names["connection"], self._connection("ONLINE"), qos=1, retain=True)
        self._last, self._hears = {}, True

    def _take(self, client: object, _: object, message: paho.MQTTMessage) -> None:
        mode = self.plant.failures.get("unit")
        if mode == "off":
            return
        if mode == "slow":
            time.sleep(LATE_S)
        said = json.loads(message.payload)
        with self._lock:
            if message.topic == self._names["order"]:
                self._obey(said)
            else:
                for one in said["actions"]:
                    self._act_at_once(one)

    def _obey(self, order: Json) -> None:
        """Take an order, or refuse it."""
        if order["orderId"] == self._order.get("orderId") or order["nodes"] == self._nodes:
            return
        self._errors = []
        seen = cast(RobotSeen, self.plant.reading())
        reason = self._why_not(order, seen)
        if reason:
            reference = {"referenceKey": "orderId", "referenceValue": order["orderId"]}
            error = {"errorType": "orderError", "errorLevel": "WARNING"}
            self._errors = [{**error, "errorDescription": reason, "errorReferences": [reference]}]
            return
        self._order, self._done = order, False
        nodes = cast(list[Json], order["nodes"])
        self._node, self._number = str(nodes[0]["nodeId"]), 0
        waiting = [a for node in nodes for a in cast(list[Json], node["actions"])]
        self._actions = {str(a["actionId"]): {**a, "actionStatus": "WAITING"} for a in waiting}
        if len(nodes) == 1:
            self._drive("act", None)
        else:
            at = cast(dict[str, float], nodes[1]["nodePosition"])
            edge = cast(list[Json], order["edges"])[0]
            limit = cast(float | None, edge.get(self._says.speed))
            theta = float(at.get("theta", 0.0))
            goal = Pose(str(at["mapId"]), at["x"], at["y"], theta)
            self._drive("go", self.settings.level_of(goal), limit)

    def _why_not(self, order: Json, seen: RobotSeen) -> str:
        if not self._done:
            return "the robot has an order"
        if seen.manual:
            return "the robot is in manual mode"
        first = cast(dict[str, float], cast(list[Json], order["nodes"])[0]["nodePosition"])
        apart = abs(complex(first["x"] - seen.at.x, first["y"] - seen.at.y))
        if str(first["mapId"]) != self._map(seen.at) or apart > 1.0:
            return "the first node is too far away"
        return ""

    def _drive(self, doing: str, at: Pose | None, limit: float | None = None) -> None:
        order = RobotOrder(str(self._order.get("orderId", "")), doing, at, limit)
        self.plant.drive(msgspec.json.encode(order).decode(), True, time.monotonic())

    def _act_at_once(self, one: Json) -> None:
        status = "FINISHED"
        match one["actionType"]:
            case "cancelOrder":
                status = "FAILED" if self._done else "FINISHED"
                for each in self._actions.values():
                    each["actionStatus"] = "FAILED"
                self._done = True
                self._drive("stop", None)
            case "initPosition" | "initializePosition":
                given = {p["key"]: p["value"] for p in cast(list[Json], one["actionParameters"])}
                x, y, theta = (float(cast(float, given[key])) for key in ("x", "y", "theta"))
                self._node = str(given["lastNodeId"])
                at = Pose(str(given["mapId"]), x, y, theta)
                self._drive("localize", self.settings.level_of(at))
            case "startPause" | "stopPause" as kind:
                self._drive("pause" if kind == "startPause" else "resume", None)
            case "stateRequest":
                self._last = {}
            case _:
                status = "FAILED"
        self._instant[str(one["actionId"])] = {**one, "actionStatus": status}

    def _progress(self, seen: RobotSeen) -> None:
        """Finish the order's actions when the plant has arrived. Then end the order."""
        if self._done:
            return
        nodes = cast(list[Json], self._order["nodes"])
        arrived = seen.completed == self._order["orderId"] and not seen.moving
        for one in self._actions.values():
            if one["actionType"] == "stopCharging" or arrived:
                waits = one["actionType"] == "startCharging" and not seen.charging
                one["actionStatus"] = "RUNNING" if waits else "FINISHED"
        if arrived:
            self._node, self._number = str(nodes[-1]["nodeId"]), 2 * (len(nodes) - 1)
            ended = ("FINISHED", "FAILED")
            self._done = all(a["actionStatus"] in ended for a in self._actions.values())

    def _state(self, seen: RobotSeen) -> Json:
        nodes = cast(list[Json], self._order.get("nodes", []))
        left = [n for n in nodes if cast(int, n["sequenceId"]) > self._number]
        if seen.mission and self._done:
            left = self._mission(seen)
        keys = ("nodeId", "sequenceId", "released")
        actions = [_shown(a) for a in self._actions.values()]
        instant = [_shown(a) for a in self._instant.values()]
        modern = self.settings.version == "3.0"
        errors = [*self._errors]
        if seen.fault:
            errors.append(
                {"errorType": "driveError", "errorLevel": "FATAL", "errorDescription": seen.fault}
            )
        return {
            "orderId": f"mission-{seen.mission}"
            if seen.mission
            else self._order.get("orderId", ""),
            "orderUpdateId": 0,
            "lastNodeId": self._node,
            "lastNodeSequenceId": self._number,
            "nodeStates": [{k: n[k] for k in keys} for n in left if seen.mission or not self._done],
            "edgeStates": [],
            "driving": seen.moving,
            "paused": seen.paused,
            self._says.place: self._place(seen),
            "actionStates": actions if modern else [*actions, *instant],
            **({"instantActionStates": instant} if modern else {}),
            self._says.power: {
                self._says.charge: round(100.0 * seen.battery),
                "charging": seen.charging,
            },
            "operatingMode": "MANUAL" if seen.manual else "AUTOMATIC",
            "errors": errors,
            "safetyState": {self._says.stop: "NONE", "fieldViolation": False},
        }

    def _mission(self, seen: RobotSeen) -> list[Json]:
        """Return the nodes of the mission that the robot has still to reach. Publish a new mission as
        an order, as the robot's own manager would."""
        if seen.mission != self._sent:
            self._sent, self._nodes = seen.mission, []
            for number, at in enumerate(seen.path, 1):
                place = {"x": at.x, "y": at.y, "mapId": self._map(at)}
                node: Json = {
                    "nodeId": f"node-{number}",
                    "sequenceId": 2 * number,
                    "released": True,
                }
                self._nodes.append({**node, "nodePosition": place})
            order: Json = {"orderId": f"mission-{seen.mission}", "orderUpdateId": 0}
            self._publish("order", {**order, "nodes": self._nodes, "edges": []})
        return self._nodes[len(self._nodes) - len(seen.path) :] if seen.path else []

    def _map(self, at: Pose) -> str:
        """Return the robot's own name of the map."""
        return self.settings.maps.get(at.map, at.map)

    def _place(self, seen: RobotSeen) -> Json:
        at = seen.at
        return {
            "x": at.x,
            "y": at.y,
            "theta": at.yaw,
            "mapId": self._map(at),
            self._says.known: True,
        }

    def _publish(self, what: str, message: Json) -> None:
        client, mode = self._client, self.plant.failures.get("unit")
        if client is None or mode == "off" or not self._hears:
            return
        self._headers += 1
        payload = json.dumps({**self._header(mode), **message}).encode()
        if mode == "garbage":
            payload = self._noise.randbytes(40)
        client.publish(self._names[what], payload)

    def _header(self, mode: str | None = None) -> Json:
        return {
            "headerId": self._headers,
            "timestamp": utc(),
            "version": self._says.number,
            "manufacturer": self.settings.manufacturer,
            "serialNumber": "another" if mode == "wrong" else self.name,
        }

    def _connection(self, state: str) -> bytes:
        if self.settings.version == "3.0":
            state = state.replace("CONNECTIONBROKEN", "CONNECTION_BROKEN")
        return json.dumps({**self._header(), "connectionState": state}).encode()


def _shown(one: Json) -> Json:
    return {key: one[key] for key in ("actionId", "actionType", "actionStatus")}


def _sited(config: Config, name: str) -> Plant:
    return robot.build(config, name)


FAKE = Fake[VdaRobotSettings](
    plant=lambda name, settings, wires: robot.RobotPlant(name, Pose("L1", 0.0, 0.0)),
    station=lambda plant, settings: FakeVdaRobot(plant.name, plant, settings),
    sited=_sited,
)
