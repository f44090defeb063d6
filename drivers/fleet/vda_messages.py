"""Messages of VDA 5050, versions 2.1 and 3.0: orders, instant actions, and the fields of a state.

Source: VDA5050/VDA5050, tags 2.1.0 and 3.0.0: VDA5050_EN.md and json_schemas/.

The driver sends a separate order for each goal of RMF. The order's first node is the robot's present
place, and its second node is the goal. Both nodes are released, so a robot that loses the broker still
drives to its goal, and waits there.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Final, Literal

import msgspec

from bridges.kinds.fleet.signals import Goal, Pose, RobotCommand

Version = Literal["2.1", "3.0"]
Json = dict[str, object]
START_WITHIN_M: Final = 1.0
"""The deviation (m) that the order's first node allows. The robot may have moved since it sent its last
state."""


class VdaDialect(msgspec.Struct, frozen=True):
    """The names that differ between the versions of VDA 5050. `number` is the version in a message's
    header."""

    number: str
    topics: str
    place: str
    known: str
    power: str
    charge: str
    stop: str
    initialize: str
    speed: str
    faults: tuple[str, ...]


DIALECTS: Final[Mapping[Version, VdaDialect]] = {
    "2.1": VdaDialect(
        number="2.1.0",
        topics="v2",
        place="agvPosition",
        known="positionInitialized",
        power="batteryState",
        charge="batteryCharge",
        stop="eStop",
        initialize="initPosition",
        speed="maxSpeed",
        faults=("FATAL",),
    ),
    "3.0": VdaDialect(
        number="3.0.0",
        topics="v3",
        place="mobileRobotPosition",
        known="localized",
        power="powerSupply",
        charge="stateOfCharge",
        stop="activeEmergencyStop",
        initialize="initializePosition",
        speed="maximumSpeed",
        faults=("CRITICAL", "FATAL"),
    ),
}


def action(kind: str, action_id: str, parameters: Mapping[str, object], blocking: str) -> Json:
    """Return an action. `blocking` is NONE, SOFT or HARD."""
    given = [{"key": key, "value": value} for key, value in parameters.items()]
    found: Json = {"actionType": kind, "actionId": action_id, "blockingType": blocking}
    return {**found, "actionParameters": given} if given else found


def order_id(command: RobotCommand) -> str:
    """Return the id of a command's order. It is the command's number, and from the second attempt on
    also the number of the attempt. A robot ignores an order whose id it has already received."""
    return str(command.id) if command.attempt == 1 else f"{command.id}-{command.attempt}"


def action_id(what: str, order: str) -> str:
    """Return the id of an action of the order with this id. Each attempt has its own id, as VDA 5050
    demands."""
    return f"{what}-{order}"


def order(
    version: Version,
    command: RobotCommand,
    here: Pose,
    last_node: str,
    deviation_m: float,
    actions: tuple[Sequence[Json], Sequence[Json]],
) -> Json:
    """Return the order for a command. `last_node` is the last node that the robot has reached.
    `deviation_m` is how close (m) the robot must come to the goal. `actions` are the actions at the
    first node, and the actions at the last node."""
    first = _node(version, last_node or "start", 0, here, START_WITHIN_M, actions[0])
    if command.goal is None:
        first["actions"] = [*actions[0], *actions[1]]
        return {"orderId": order_id(command), "orderUpdateId": 0, "nodes": [first], "edges": []}
    goal = command.goal
    last = _node(version, _name(goal, command), 2, goal.at, deviation_m, actions[1])
    edge: Json = {
        "edgeId": f"{first['nodeId']}-{last['nodeId']}",
        "sequenceId": 1,
        "released": True,
        "actions": [],
    }
    if version == "2.1":
        edge |= {"startNodeId": first["nodeId"], "endNodeId": last["nodeId"]}
    if goal.speed_limit:
        edge[DIALECTS[version].speed] = goal.speed_limit
    return {
        "orderId": order_id(command),
        "orderUpdateId": 0,
        "nodes": [first, last],
        "edges": [edge],
    }


def _name(goal: Goal, command: RobotCommand) -> str:
    return goal.name or f"goal-{command.id}"


def _node(
    version: Version, name: str, number: int, at: Pose, within_m: float, actions: Sequence[Json]
) -> Json:
    theta = math.remainder(at.yaw, math.tau)
    place: Json = {"x": at.x, "y": at.y, "theta": theta, "mapId": at.map}
    circle = {"a": within_m, "b": within_m, "theta": 0.0}
    place["allowedDeviationXY"] = within_m if version == "2.1" else circle
    if number == 0:
        place["allowedDeviationTheta"] = 3.141592
    return {
        "nodeId": name,
        "sequenceId": number,
        "released": True,
        "nodePosition": place,
        "actions": list(actions),
    }
