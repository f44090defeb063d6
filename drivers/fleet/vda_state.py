"""Reads the fields of a state of VDA 5050. A field that is missing or of a wrong type is named."""

from collections.abc import Iterator
from typing import Final

from drivers import DriverError
from drivers.fleet.vda_messages import Json
from drivers.json_fields import clean

INSTANT: Final = ("cancel-", "place-", "state-", "on-death", "pause-", "resume-")
"""The beginnings of the ids of our instant actions."""
ENDED: Final = ("FINISHED", "FAILED")
AUTOMATIC: Final = ("AUTOMATIC", "SEMIAUTOMATIC")


def taken_out(state: Json) -> str:
    """Return why the robot takes no orders; "" if it does."""
    mode = text(state, "operatingMode")
    return "" if mode in AUTOMATIC else f"operating mode {mode}"


def order_actions(state: Json) -> Iterator[Json]:
    """Yield the states of the order's actions. Those of instant actions stay for ever in 2.1, so an
    action that is not an order's is left out by its id."""
    for one in listed(state, "actionStates"):
        ours = str(one.get("actionId", ""))
        if ours and not ours.startswith(INSTANT):
            yield one


def has_order(state: Json) -> bool:
    """Has the robot an order? Nodes, edges and unfinished actions are left of it."""
    left = state.get("nodeStates") or state.get("edgeStates")
    return bool(left) or any(a.get("actionStatus") not in ENDED for a in order_actions(state))


def errors(state: Json) -> Iterator[Json]:
    """Yield the robot's errors."""
    return iter(listed(state, "errors"))


def told(error: Json) -> str:
    """Return an error in words."""
    more = clean(str(error.get("errorDescription") or ""))
    return clean(str(error.get("errorType"))) + (f": {more}" if more else "")


def references(error: Json) -> list[str]:
    """Return the orders, actions and nodes that an error is about."""
    return [str(one.get("referenceValue")) for one in listed(error, "errorReferences")]


def listed(state: Json, field: str) -> list[Json]:
    """Return the objects of a list; [] if there is no list."""
    found = state.get(field)
    return [one for one in found if isinstance(one, dict)] if isinstance(found, list) else []


def places_left(state: Json, order: Json) -> list[Json] | None:
    """Return the places of the remaining nodes of the robot's order. Nodes that the manager only plans
    belong to the order. Return None if neither the state nor the order has the places."""
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
        raise DriverError(f"the robot's state has no {field}: is `version` right?")
    return found


def number(state: Json, field: str) -> float:
    """Return a number of the state. Raises DriverError."""
    found = state.get(field)
    if isinstance(found, bool) or not isinstance(found, int | float):
        raise DriverError(f"the robot's {field} is {clean(str(found))}, and a number is expected")
    return float(found)


def flag(state: Json, field: str) -> bool:
    """Return a flag of the state. Raises DriverError."""
    found = state.get(field)
    if not isinstance(found, bool):
        raise DriverError(f"the robot's {field} is {clean(str(found))}, not true or false")
    return found


def text(state: Json, field: str) -> str:
    """Return a text of the state. Raises DriverError."""
    found = state.get(field)
    if not isinstance(found, str):
        raise DriverError(f"the robot's {field} is {clean(str(found))}, and a text is expected")
    return found
