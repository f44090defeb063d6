"""A lift's state in a JSON answer. Floor, doors, motion, service state and hazards each have a field.

A value that the YAML does not list is a fault. Such a value never means a floor, an open door or a
standing car. A field that is null is unknown. If a hazard is null, the whole reading fails.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, TypeAlias

import msgspec

from bridges.kinds.lift.signals import DoorReading, Hazard, LiftSample, Motion
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from drivers import DriverError, json_fields
from drivers.json_fields import Field, JsonFlag, JsonNumber, Value

Answer: TypeAlias = Mapping[str, object]
"""One JSON object."""
Values = Annotated[list[Value], msgspec.Meta(min_length=1)]

DOOR: Mapping[str | None, DoorReading] = {
    "open": DoorReading.OPEN,
    "closed": DoorReading.CLOSED,
    "moving": DoorReading.BETWEEN,
}


class JsonFloor(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The field of the car's position."""

    field: Annotated[Field, tells("the field of the car's position. Null means between floors.")]
    values: Annotated[
        dict[Name, Value],
        tells("""landing -> the field's value while the car is there. Without `values` the value is the
        landing's name."""),
    ] = {}
    between_floors: Annotated[list[Value], tells("the values for a car between floors.")] = []

    def value(self, level: str) -> Value:
        """Return the value that stands for this landing."""
        return self.values.get(level, level)

    def problems(self) -> Remarks:
        """Yield a problem for each value that has two meanings."""
        given = [(("values", level), value, level) for level, value in self.values.items()]
        between = enumerate(self.between_floors)
        given += [(("between_floors", str(n)), value, "between floors") for n, value in between]
        yield from _doubles(given)


class ListedStates(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A field whose value shows a state, such as `open`. Each state is a key of the YAML, with a list
    of the values that show the state."""

    field: Annotated[Field, tells("the field of the value.")]

    def states(self) -> dict[str, list[Value]]:
        """Return the values of each state that has a value."""
        given = {name: getattr(self, name) for name in self.__struct_fields__ if name != "field"}
        return {name: values for name, values in given.items() if values}

    def problems(self) -> Remarks:
        """Yield a problem for each value that has two meanings."""
        yield from _doubles(
            ((state, str(n)), value, state)
            for state, values in self.states().items()
            for n, value in enumerate(values)
        )


class JsonDoor(ListedStates, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The field of a door. A value that is not listed is a fault."""

    open: Annotated[Values, tells("the values for a fully open door.")]
    closed: Annotated[Values, tells("the values for a closed door.")]
    moving: Annotated[list[Value], tells("the values for a door between its ends.")] = []


class JsonMotion(ListedStates, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The field of the car's motion. A value that is not listed is a fault."""

    stopped: Annotated[Values, tells("the values for a standing car.")]
    up: Annotated[list[Value], tells("the values for a car that goes up.")] = []
    down: Annotated[list[Value], tells("the values for a car that goes down.")] = []
    moving: Annotated[list[Value], tells("the values for a car that moves, up or down.")] = []

    def problems(self) -> Remarks:
        """Yield a problem if no value shows a moving car. Yield a problem for each value with two
        meanings."""
        yield from super().problems()
        if not self.moving and not (self.up and self.down):
            yield (), "needs values for moving, or else values for both up and down"


class JsonService(ListedStates, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The field of the lift's service state. A value that is not listed means that the lift is out of
    service."""

    normal: Annotated[Values, tells("the values for a lift that serves people.")]
    agv_mode: Annotated[list[Value], tells("the values for AGV mode.")] = []
    fire_alarm: Annotated[list[Value], tells("the values for a fire.")] = []
    code_blue: Annotated[list[Value], tells("the values for a code blue.")] = []
    earthquake: Annotated[list[Value], tells("the values for an earthquake.")] = []
    emergency: Annotated[list[Value], tells("the values for the emergency stop.")] = []
    out_of_service: Annotated[list[Value], tells("the values for a lift that is off.")] = []
    manual_mode: Annotated[list[Value], tells("the values for inspection or manual drive.")] = []
    overload: Annotated[list[Value], tells("the values for a car that is too heavy.")] = []


class JsonLiftState(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The fields of a lift's answer. A field is a path of names with dots between them."""

    online: Annotated[
        JsonFlag | None,
        tells("the gateway reaches the lift. While this flag is false, there is no reading."),
    ] = None
    age: Annotated[
        JsonNumber | None,
        tells("""the age (s) of the gateway's own reading. A reading older than `stale_after_s` is
        refused."""),
    ] = None
    floor: Annotated[JsonFloor, tells("the car's position.")]
    door: Annotated[JsonDoor, tells("the car's door.")]
    rear_door: Annotated[JsonDoor | None, tells("the car's rear door.")] = None
    motion: Annotated[JsonMotion | None, tells("the car's motion.")] = None
    service: Annotated[
        JsonService | None, tells("the lift's service state; it may include hazards and AGV mode.")
    ] = None
    agv_mode: Annotated[
        JsonFlag | None,
        tells("the lift confirms AGV mode; not needed if `service` shows AGV mode."),
    ] = None
    fire_alarm: Annotated[
        JsonFlag | None,
        tells("the fire alarm; sets MODE_FIRE, which is latched with `fire_reset: manual`."),
    ] = None
    code_blue: Annotated[
        JsonFlag | None, tells("the hospital's code blue; sets MODE_EMERGENCY.")
    ] = None
    earthquake: Annotated[JsonFlag | None, tells("an earthquake sensor; sets MODE_EMERGENCY.")] = (
        None
    )
    emergency: Annotated[
        JsonFlag | None, tells("the car's emergency stop; sets MODE_EMERGENCY.")
    ] = None
    out_of_service: Annotated[
        JsonFlag | None, tells("the lift is off or out of order; sets MODE_OFFLINE.")
    ] = None
    manual_mode: Annotated[
        JsonFlag | None, tells("inspection or manual drive (key switch); sets MODE_OFFLINE.")
    ] = None
    overload: Annotated[JsonFlag | None, tells("the car is too heavy; delays the ride.")] = None

    def places(self) -> dict[str, str]:
        """Return the field of each part that the YAML gives."""
        parts = {name: getattr(self, name) for name in self.__struct_fields__}
        return {name: part.field for name, part in parts.items() if part is not None}

    def shows(self, state: str) -> bool:
        """Return whether the answer shows this hazard or AGV mode, as a flag or as a state of
        `service`."""
        in_service = self.service is not None and state in self.service.states()
        return in_service or getattr(self, state) is not None

    def problems(self) -> Remarks:
        """Yield a problem if two fields show AGV mode."""
        if self.agv_mode and self.service and self.service.agv_mode:
            yield ("agv_mode",), "service shows agv_mode too: delete one of the two"


def _doubles(given: Iterable[tuple[tuple[str, str], Value, str]]) -> Remarks:
    """Yield a problem for each value that has two meanings. `given` yields path, value and meaning."""
    seen: list[tuple[Value, str]] = []
    for path, value, meaning in given:
        for before, other in seen:
            if json_fields.same(value, before):
                yield path, f"{json_fields.value_text(value)} means {other} and {meaning}"
        seen.append((value, meaning))


def decode(
    place: JsonLiftState, answer: Answer, levels: Sequence[str], stale_s: float
) -> LiftSample:
    """Decode the answer of a lift with these landings.

    Raises DriverError if a field is missing or invalid, and names the field. Also raises DriverError if
    the gateway does not reach the lift, or if the gateway's reading is older than `stale_s`.
    """
    _current(place, answer, stale_s)
    level, code_fault = _floor(place.floor, answer, levels)
    service = _service(place, answer)
    return LiftSample(
        level=level,
        door=_door(place.door, answer),
        code_fault=code_fault,
        rear_door=_door(place.rear_door, answer) if place.rear_door else None,
        motion=_motion(place.motion, answer) if place.motion else None,
        agv=_agv(place, answer, service),
        hazards=frozenset(
            h for h in Hazard if h == service or json_fields.certain(answer, getattr(place, h))
        ),
    )


def _current(place: JsonLiftState, answer: Answer, stale_s: float) -> None:
    if place.online and not json_fields.flag(answer, place.online):
        raise DriverError(f"the gateway does not reach the lift ('{place.online.field}')")
    if place.age is None:
        return
    age_s = json_fields.number(answer, place.age.field, place.age.scale)
    if age_s is None:
        raise DriverError(f"the answer does not give its age ('{place.age.field}')")
    if not 0 <= age_s <= stale_s:
        raise DriverError(
            f"the gateway's reading is {age_s:g} s old ('{place.age.field}'): at most {stale_s:g} s"
            " (stale_after_s) are accepted"
        )


def _value(answer: Answer, field: str) -> Value | None:
    value = json_fields.needed(answer, field)
    if value is not None and not isinstance(value, Value):
        raise json_fields.wrong(field, value, "a text, a number, true or false")
    return value


def _state(place: ListedStates, answer: Answer) -> str | None:
    """Return the state that the field's value shows. Return None if the value is null or is not
    listed."""
    value = _value(answer, place.field)
    return next((state for state, given in place.states().items() if _is_one(value, given)), None)


def _is_one(value: Value | None, given: Sequence[Value]) -> bool:
    return value is not None and any(json_fields.same(value, one) for one in given)


def _floor(place: JsonFloor, answer: Answer, levels: Sequence[str]) -> tuple[str | None, str]:
    value = _value(answer, place.field)
    if value is None or _is_one(value, place.between_floors):
        return None, ""
    level = next((level for level in levels if _is_one(value, [place.value(level)])), None)
    return level, "" if level else f"{json_fields.value_text(value)} is no floor's value"


def _door(place: JsonDoor, answer: Answer) -> DoorReading:
    return DOOR.get(_state(place, answer), DoorReading.UNKNOWN)


def _motion(place: JsonMotion, answer: Answer) -> Motion:
    state = _state(place, answer)
    return Motion(state) if state else Motion.CONTRADICTORY


def _service(place: JsonLiftState, answer: Answer) -> str | None:
    if place.service is None:
        return None
    state = _state(place.service, answer)
    return state or Hazard.OUT_OF_SERVICE


def _agv(place: JsonLiftState, answer: Answer, service: str | None) -> bool | None:
    if place.agv_mode:
        return json_fields.flag(answer, place.agv_mode)
    return service == "agv_mode" if place.shows("agv_mode") else None
