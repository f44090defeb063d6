"""Reads the fields of a VDA 5050 state. If a field is missing or has a wrong type, the error names the
field."""

from collections.abc import Iterator
from typing import Final

from drivers import DriverError
from drivers.fleet.vda_messages import Json
from drivers.json_fields import clean

INSTANT: Final = ("cancel-", "stop-", "place-", "state-", "on-death", "pause-", "resume-")
"""The beginnings of the ids that this daemon gives to its instant actions."""
ENDED: Final = ("FINISHED", "FAILED")
AUTOMATIC: Final = ("AUTOMATIC", "SEMIAUTOMATIC")


def taken_out(state: Json) -> str:
    """Return the reason why the robot accepts no orders. Return "" if it accepts orders."""
    mode = text(state, "operatingMode")
    return "" if mode in AUTOMATIC else f"operating mode {mode}"


def order_actions(state: Json) -> Iterator[Json]:
    """Yield the states of the actions that belong to the robot's order.

    Leave out instant actions, which their ids reveal. In version 2.1 the states of instant actions stay
    in the list for ever.
    """
    for one in listed(state, "actionStates"):
        ours = str(one.get("actionId", ""))
        if ours and not ours.startswith(INSTANT):
            yield one


def ended(state: Json, action_id: str) -> str:
    """Return how an instant action has ended, FINISHED or FAILED. Return "" if it has not ended, or if
    the robot does not know it."""
    states = [*listed(state, "actionStates"), *listed(state, "instantActionStates")]
    found = (str(one.get("actionStatus")) for one in states if one.get("actionId") == action_id)
    return next((status for status in found if status in ENDED), "")


def has_order(state: Json) -> bool:
    """Has the robot an order? It has one while nodes, edges or unfinished actions remain."""
    left = state.get("nodeStates") or state.get("edgeStates")
    return bool(left) or any(a.get("actionStatus") not in ENDED for a in order_actions(state))


def errors(state: Json) -> Iterator[Json]:
    """Yield the robot's errors."""
    return iter(listed(state, "errors"))


def told(error: Json) -> str:
    """Return an error as text for people."""
    more = clean(str(error.get("errorDescription") or ""))
    return clean(str(error.get("errorType"))) + (f": {more}" if more else "")


def references(error: Json) -> list[str]:
    """Return the orders, actions and nodes that an error is about."""
    return [str(one.get("referenceValue")) for one in listed(error, "errorReferences")]


def listed(state: Json, field: str) -> list[Json]:
    """Return the objects of a list. Return [] if there is no list."""
    found = state.get(field)
    return [one for one in found if isinstance(one, dict)] if isinstance(found, list) else []


def places_left(state: Json, order: Json) -> list[Json] | None:
    """Return the places of the nodes that the robot has not reached yet. Nodes that the manager has
    planned but not yet released are included. Return None if the place of a node is unknown."""
    same = order.get("orderId") == state.get("orderId")
    known = {n.get("sequenceId"): n.get("nodePosition") for n in listed(order, "nodes") if same}
    nodes = listed(state, "nodeStates")
    found = (node.get("nodePosition") or known.get(node.get("sequenceId")) for node in nodes)
    places = [place for place in found if isinstance(place, dict)]
    return places if len(places) == len(nodes) else None


def part(state: Json, field: str) -> Json:
    """Return an object of the state. Raises DriverError."""
    found = state.get(field)
    if not isinstance(found, dict):
        raise DriverError(f"the robot's state has no {field}: is `version` in the YAML right?")
    return found


def number(state: Json, field: str) -> float:
    """Return a number of the state. Raises DriverError."""
    found = state.get(field)
    if isinstance(found, bool) or not isinstance(found, int | float):
        raise DriverError(f"the robot's {field} is {clean(str(found))}, but must be a number")
    return float(found)


def flag(state: Json, field: str) -> bool:
    """Return a flag of the state. Raises DriverError."""
    found = state.get(field)
    if not isinstance(found, bool):
        raise DriverError(f"the robot's {field} is {clean(str(found))}, but must be true or false")
    return found


def text(state: Json, field: str) -> str:
    """Return a text of the state. Raises DriverError."""
    found = state.get(field)
    if not isinstance(found, str):
        raise DriverError(f"the robot's {field} is {clean(str(found))}, but must be a text")
    return found
