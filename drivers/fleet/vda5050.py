"""A robot that speaks VDA 5050 (2.1 or 3.0) over MQTT. The topics are:

    uagv/v2/MANUFACTURER/SERIAL/state   the robot's state: at each event, and at least every 30 s
    …/visualization                     the robot's position, more often; some robots do not send it
    …/connection                        ONLINE, OFFLINE or CONNECTIONBROKEN; retained, and a last will
    …/order                             this daemon's orders; with `control: traffic_light` those of the
                                        robot's own manager
    …/instantActions                    this daemon's instant actions

A robot accepts a new order only when it has no order. So the driver cancels an order before it sends
another one. The robot reports `cancelOrder` as finished when all movement has stopped. `driving` is
false then too. If the robot has no order, it reports `cancelOrder` as failed.

Messages have QoS 0, so a message can get lost, and a robot may act on it late. Therefore a stop or
pause counts as taken only when the robot reports it as finished.
"""

from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from typing import Annotated, Final

import msgspec
from msgspec import Meta

from bridges.kinds.fleet.settings import FleetRobotSettings
from bridges.kinds.fleet.signals import Pose, RobotCommand, RobotOutputs, RobotSample
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from drivers import DriverError
from drivers.driver_type import DriverType
from drivers.fleet.vda_messages import DIALECTS, Json, Version, action, action_id, order, order_id
from drivers.fleet.vda_state import (
    ended,
    errors,
    flag,
    has_order,
    number,
    order_actions,
    part,
    places_left,
    references,
    taken_out,
    text,
    told,
)
from drivers.hal import HalError
from drivers.hal.mqtt import Heard, MqttBus, MqttSettings
from drivers.hal.timestamps import utc
from drivers.json_fields import clean

INSTANT_COMMANDS: Final[Mapping[str, str]] = {
    "stop": "cancelOrder",
    "pause": "startPause",
    "resume": "stopPause",
}
"""The instant actions for commands of the core."""
LATE_S: Final = 5.0
"""Time (s) after which a state must show an action's order. A robot sends a state when it takes an
order."""
Age = Annotated[float, Meta(ge=1, le=120, extra={"unit": "s"})]
TopicPart = Annotated[
    str,
    Meta(
        pattern=r"^[^\x00-\x20\x7f-\x9f#+/$][^\x00-\x1f\x7f-\x9f#+/]*$(?!\n)",
        max_length=64,
        extra={"pattern": "one part of a topic, without / # +"},
    ),
]


class VdaActionSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The robot's action for one of RMF's actions. The values of RMF's description become the
    parameters of the robot's action."""

    type: Annotated[Name, tells("the `actionType`, as the robot's factsheet lists it.")]


class VdaRobotSettings(FleetRobotSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The settings of one robot. They give its names in MQTT topics. Its serial number is `known_as`,
    or else the robot's name."""

    manufacturer: Annotated[TopicPart, tells("the manufacturer's name in the robot's topics.")]
    version: Annotated[Version, tells("the version of VDA 5050 that the robot speaks.")] = "2.1"
    interface: Annotated[TopicPart, tells("the interface's name in the robot's topics.")] = "uagv"
    state_s: Annotated[
        Age,
        tells("""a state that is older counts as unknown. A standing robot may send a state only
        every 30 s (VDA 5050)."""),
    ] = 35.0
    place_s: Annotated[
        Age,
        tells(
            "how old the last reported position (state or visualization) of a driving robot may be."
        ),
    ] = 3.0
    dock_action: Annotated[
        Name | None,
        tells("the robot's action at the end of a lane with a dock. null means no action."),
    ] = "startCharging"
    dock_actions: Annotated[
        dict[Name, Name | None],
        tells("""the actions of single docks, by the docks' names in the graph, in place of
        `dock_action`. null means no action. A dock that is no charger needs one."""),
    ] = msgspec.field(default_factory=dict)
    actions: Annotated[
        dict[Name, VdaActionSettings],
        tells("the name of an action in `config.yaml` -> the robot's action."),
    ] = msgspec.field(default_factory=dict)

    def topic(self, name: str, robot: str) -> str:
        """Return a topic of this robot."""
        version = DIALECTS[self.version].topics
        serial = self.known_as or robot
        return f"{self.interface}/{version}/{self.manufacturer}/{serial}/{name}"

    def known_actions(self) -> Collection[str]:
        """Return the actions in the YAML."""
        return self.actions

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from super().problems()
        if self.known_as and any(sign in self.known_as for sign in "/#+"):
            yield ("known_as",), "becomes a part of the robot's topics: write it without / # +"


class VdaRobot:
    """The driver of one robot (`drivers.Driver`)."""

    def __init__(self, name: str, settings: VdaRobotSettings, bus: MqttBus) -> None:
        self._settings, self._bus = settings, bus
        self._says = DIALECTS[settings.version]
        topics = ("state", "visualization", "connection", "order", "instantActions")
        self._topics = {topic: settings.topic(topic, name) for topic in topics}
        self._serial = settings.known_as or name
        self._sent, self._acts = (0, 0), False
        self._order_id = self._instant_id = ""
        self._ordered_at = 0.0
        self._headers = dict.fromkeys(topics, 0)
        self._state: Json = {}
        self._at: Pose | None = None
        self._cancelled, self._waits = (0, 0), False
        self._decoded: dict[str, tuple[object, Json]] = {}
        self._asked = False
        for topic in ("state", "visualization", "connection", "order"):
            bus.listen(self._topics[topic])

    def open(self) -> None:
        """Do nothing, because a restart must not stop a robot.

        Do not wait for the broker either. At the daemon's end the driver needs the broker only to stop
        the robot.
        """

    def read(self) -> RobotSample:
        """Decode the robot's last state. Raises DriverError if the robot is not connected, or has sent
        no state."""
        self._connected()
        heard = self._live_state()
        state = self._object("state", heard.payload)
        driving, said_at = flag(state, "driving"), heard.at or 0.0
        at = self._place(state, said_at, driving)
        power = part(state, self._says.power)
        self._state, self._at = state, at
        refused, failed = self._in_vain(state)
        return RobotSample(
            at=self._settings.level_of(at),
            battery=number(power, self._says.charge) / 100.0,
            moving=driving,
            charging=flag(power, "charging"),
            completed=self._completed(state),
            fault=self._fault(state),
            taken_out=taken_out(state),
            refused=refused,
            unanswered=not refused and self._is_lost(state, said_at),
            failed=failed,
            path=self._path(state),
            paused=flag(state, "paused") if "paused" in state else None,
            busy=self._waits and has_order(state),
            taken=self._sent if self._taken(state) else (0, 0),
        )

    def write(self, outputs: RobotOutputs) -> None:
        """Send the command once for each attempt. If the robot still has another command's order,
        cancel that order first, also once for each attempt. Raises DriverError if the robot is not
        connected."""
        command = outputs.command and self._settings.theirs(outputs.command)
        self._waits = command is not None and self._has_other(command)
        done = self._cancelled if self._waits else self._sent
        if command is None or done == (command.id, command.attempt):
            return
        self._connected()
        if self._waits:
            self._instant("cancelOrder", f"cancel-{command.id}-{command.attempt}", {})
            self._cancelled = (command.id, command.attempt)
            return
        if command.doing in INSTANT_COMMANDS:
            self._instant_id = f"{command.doing}-{command.id}-{command.attempt}-{utc()}"
            self._instant(INSTANT_COMMANDS[command.doing], self._instant_id, {})
        elif command.doing == "localize":
            self._localize(command)
        elif not has_order(self._state):
            self._order(command)
        self._sent, self._acts = (command.id, command.attempt), command.doing == "act"

    def _has_other(self, command: RobotCommand) -> bool:
        """Does the robot have another order than the order that this command needs?"""
        instant = command.doing in INSTANT_COMMANDS or command.doing == "localize"
        return not instant and has_order(self._state) and self._ours() != str(command.id)

    def _ours(self, state: Json | None = None) -> str:
        """Return the number of the command whose order the robot has. This is the first part of the
        order's id."""
        return text(self._state if state is None else state, "orderId").partition("-")[0]

    def _is_last(self, order: str) -> bool:
        """Is this the id of the last command's order?"""
        return order.partition("-")[0] == str(self._sent[0])

    def make_safe(self) -> None:
        """Stop or pause the robot, as `on_death` says. With `on_death: finish` do nothing, so that the
        robot finishes its order. Raises DriverError if the robot is not connected."""
        if kind := INSTANT_COMMANDS.get(self._settings.on_death):
            self._instant(kind, f"on-death-{utc()}", {})
            self._connected()

    def close(self) -> None:
        """Do nothing, because the bus ends the connection."""

    def _connected(self) -> None:
        heard = self._bus.heard(self._topics["connection"])
        if heard is None:
            return  # no notice: a recent state is proof enough of a connection
        said = self._object("connection", heard.payload).get("connectionState")
        if said != "ONLINE":
            raise DriverError(f"the robot is not connected to the broker: {clean(str(said))}")

    def _live_state(self) -> Heard:
        """Return the robot's last state. If there is no live state yet, request one once, because a
        standing robot may send no state for a long time."""
        heard = self._bus.heard(self._topics["state"])
        live = heard is not None and heard.at is not None
        if not live and not self._asked:
            self._instant("stateRequest", f"state-{self._headers['instantActions']}", {})
        self._asked = not live
        return self._bus.fresh(self._topics["state"], self._settings.state_s)

    def _object(self, what: str, payload: bytes) -> Json:
        """Return the JSON object of a message. Decode each message only once. Raises DriverError."""
        before, found = self._decoded.get(what, (None, {}))
        if payload is not before:
            found = self._decode(what, payload)
            self._decoded[what] = payload, found
        return found

    def _decode(self, what: str, payload: bytes) -> Json:
        try:
            found = msgspec.json.decode(payload)
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise DriverError(f"the robot's {what} is no JSON: {clean(str(error))}") from None
        if not isinstance(found, dict):
            raise DriverError(f"the robot's {what} is no JSON object")
        serial = found.get("serialNumber", self._serial)
        if serial != self._serial:
            raise DriverError(
                f"the {what} message is from robot {clean(str(serial))}, not {self._serial}"
            )
        return found

    def _place(self, state: Json, said_at: float, driving: bool) -> Pose:
        """Return the newest position that the robot has reported, in its state or in its visualization
        message."""
        place = state.get(self._says.place)
        newer = self._bus.heard(self._topics["visualization"])
        if newer is not None and newer.at is not None and newer.at > said_at:
            shown = self._object("visualization", newer.payload).get(self._says.place)
            if isinstance(shown, dict):
                place, said_at = {**(place if isinstance(place, dict) else {}), **shown}, newer.at
        if not isinstance(place, dict) or not place.get(self._says.known, True):
            raise DriverError("the robot does not know its position: localize the robot")
        age_s = self._bus.now() - said_at
        if driving and age_s > self._settings.place_s:
            raise DriverError(f"the robot drives, but its reported position is {age_s:.0f} s old")
        numbers = (number(place, key) for key in ("x", "y", "theta"))
        return Pose(text(place, "mapId"), *numbers)

    def _path(self, state: Json) -> tuple[Pose, ...] | None:
        """Return the places of the robot's path, if another sender (the robot's own manager) has sent
        the order. Return None if the path is unknown."""
        if self._ours(state) == str(self._sent[0]):
            return None
        heard = None
        with suppress(HalError):  # the broker may forbid this daemon to read orders
            heard = self._bus.heard(self._topics["order"])
        places = places_left(state, self._object("order", heard.payload) if heard else {})
        if places is None:
            return None
        found = (Pose(text(at, "mapId"), number(at, "x"), number(at, "y")) for at in places)
        return tuple(map(self._settings.level_of, found))

    def _completed(self, state: Json) -> str:
        """Return the number of the command whose order the robot has carried out. Return "" while the
        robot still has an order."""
        found = [one.get("actionStatus") == "FINISHED" for one in order_actions(state)]
        done = all(found) and (bool(found) or not self._acts)
        ours = self._ours(state)
        return ours if done and not has_order(state) else ""

    def _fault(self, state: Json) -> str:
        stop = part(state, "safetyState").get(self._says.stop, "NONE")
        found = [] if stop == "NONE" else [f"emergency stop: {clean(str(stop))}"]
        for error in errors(state):
            if error.get("errorLevel") in self._says.faults:
                found.append(told(error))
        return "; ".join(found)

    def _in_vain(self, state: Json) -> tuple[str, str]:
        """Return why the robot has refused the driver's last order, and why an action that it took has
        failed. Each is "" if this is not so.

        A state may come too late to show that an action was running. So an action of an order that the
        robot has taken is never called refused.
        """
        if self._waits or not self._is_last(self._order_id):
            return "", ""
        acts = (action_id(what, self._order_id) for what in ("act", "dock", "leave"))
        ours = {self._order_id, *acts}
        found = [told(error) for error in errors(state) if ours & set(references(error))]
        if text(state, "orderId") != self._order_id:
            return "; ".join(found), ""
        failed = [a for a in order_actions(state) if a.get("actionStatus") == "FAILED"]
        found += [f"the action {clean(str(a.get('actionType')))} has failed" for a in failed]
        if not self._acts:
            return "; ".join(found), ""
        return "", "; ".join(found) if failed else ""

    def _is_lost(self, state: Json, said_at: float) -> bool:
        """Does a state that came long after an action's order not show this order? The order may have
        been lost, or the robot has forgotten it."""
        late = said_at >= self._ordered_at + LATE_S
        return self._acts and not self._waits and late and text(state, "orderId") != self._order_id

    def _taken(self, state: Json) -> bool:
        """Does the state show that the robot has taken the last order, stop or pause?

        A robot that reports a stop as failed has no order. If the state does not show the last order
        yet, the order may still be on its way, so only a second such report counts.
        """
        if self._is_last(self._order_id):
            return text(state, "orderId") == self._order_id
        how = ended(state, self._instant_id)
        if self._instant_id.startswith("pause-"):
            return how == "FINISHED" or (how == "FAILED" and state.get("paused") is True)
        knows_order = self._sent[1] > 1 or text(state, "orderId") == self._order_id
        return not has_order(state) and (how == "FINISHED" or (how == "FAILED" and knows_order))

    def _localize(self, command: RobotCommand) -> None:
        assert command.goal is not None
        at = command.goal.at
        node = command.goal.name or "start"
        where = {"x": at.x, "y": at.y, "theta": at.yaw, "mapId": at.map, "lastNodeId": node}
        self._instant(self._says.initialize, f"place-{command.id}-{command.attempt}", where)

    def _order(self, command: RobotCommand) -> None:
        assert self._at is not None
        number, last = order_id(command), list[Json]()
        docks = self._docks(command)
        if docks:
            last.append(action(docks, action_id("dock", number), {}, "HARD"))
        if command.doing == "act":
            known = self._settings.actions.get(command.activity)
            if known is None:
                raise DriverError(f"the YAML has no action '{command.activity}' for this robot")
            given = msgspec.json.decode(command.description)
            parameters = given if isinstance(given, dict) else {"description": given}
            last.append(action(known.type, action_id("act", number), parameters, "HARD"))
        charging = part(self._state, self._says.power).get("charging")
        first = []
        if charging and command.goal is not None:
            first.append(action("stopCharging", action_id("leave", number), {}, "HARD"))
        node = text(self._state, "lastNodeId")
        within_m = self._settings.limits.arrived_m
        made = order(self._settings.version, command, self._at, node, within_m, (first, last))
        self._publish("order", made)
        self._order_id, self._ordered_at = number, self._bus.now()

    def _docks(self, command: RobotCommand) -> str | None:
        """Return the robot's action at the end of this command; None for no action."""
        if command.doing != "dock" or command.goal is None:
            return None
        return self._settings.dock_actions.get(command.goal.dock, self._settings.dock_action)

    def _instant(self, kind: str, action_id: str, parameters: Mapping[str, object]) -> None:
        blocking = "NONE" if self._settings.version == "3.0" else "HARD"
        made = action(kind, action_id, parameters, blocking)
        stops = kind in ("cancelOrder", "startPause")
        self._publish("instantActions", {"actions": [made]}, safe=stops)

    def _publish(self, topic: str, message: Json, safe: bool = False) -> None:
        self._headers[topic] += 1
        header: Json = {
            "headerId": self._headers[topic],
            "timestamp": utc(),
            "version": self._says.number,
            "manufacturer": self._settings.manufacturer,
            "serialNumber": self._serial,
        }
        payload = msgspec.json.encode({**header, **message})
        self._bus.publish(self._topics[topic], payload, qos=0, safe=safe)


def claims(settings: VdaRobotSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the topic of the robot's orders, with its path in the YAML. No other device, of this or
    another YAML, may send orders to this robot."""
    if settings.known_as:
        yield settings.topic("order", settings.known_as), ("known_as",)


def describe(settings: VdaRobotSettings, bus: MqttSettings) -> list[tuple[str, str]]:
    """Return the rows that `check` prints instead of a wiring table. Each row is a subject and its
    meaning."""
    serial = settings.known_as or "ROBOT"
    rows = [
        (what, settings.topic(what, serial))
        for what in ("state", "visualization", "connection", "order", "instantActions")
    ]
    rows += [(f"action {name}", each.type) for name, each in settings.actions.items()]
    rows += [(f"dock {name}", kind or "-") for name, kind in settings.dock_actions.items()]
    return [*rows, ("dock", settings.dock_action or "-"), ("on death", settings.on_death)]


DRIVER = DriverType(
    settings=VdaRobotSettings,
    buses=("mqtt",),
    create=VdaRobot,
    describe=describe,
    claims=claims,
    fake="hal_fakes.vda5050",
)
