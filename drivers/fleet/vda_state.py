"""Reads the fields of a state of VDA 5050. A field that is missing or of a wrong type is named."""

from collections.abc import Iterator
from typing import Final

from drivers import DriverError
from drivers.fleet.vda_messages import Json
from drivers.json_fields import clean

AUTOMATIC: Final = ("AUTOMATIC", "SEMIAUTOMATIC")


def taken_out(state: Json) -> str:
    """Return why the robot takes no orders; "" if it does."""
    mode = text(state, "operatingMode")
    return "" if mode in AUTOMATIC else f"operating mode {mode}"


def order_actions(state: Json) -> Iterator[Json]:
    """Yield the states of the order's actions. Those of instant actions stay for ever in 2.1, so an
    action that is not an order's is left out by its id."""
    found = state.get("actionStates")
    for one in found if isinstance(found, list) else ():
        ours = str(one.get("actionId", "")) if isinstance(one, dict) else ""
        if ours and not ours.startswith(("cancel-", "place-", "state-", "on-death")):
            yield one


def errors(state: Json) -> Iterator[Json]:
    """Yield the robot's errors."""
    found = state.get("errors")
    yield from (one for one in found if isinstance(one, dict)) if isinstance(found, list) else ()


def told(error: Json) -> str:
    """Return an error in words."""
    more = clean(str(error.get("errorDescription") or ""))
    return clean(str(error.get("errorType"))) + (f": {more}" if more else "")


def references(error: Json) -> list[str]:
    """Return the orders, actions and nodes that an error is about."""
    found = error.get("errorReferences")
    listed = found if isinstance(found, list) else []
    return [str(one.get("referenceValue")) for one in listed if isinstance(one, dict)]


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
