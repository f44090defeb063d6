"""Reads typed values from one JSON object. The path to a field has dots between its names
(`pad.receiver.id`).

Each function returns a value of the type that its caller wants. For any other JSON the function raises
a DriverError that names the field.
"""

import math
import reprlib
from collections.abc import Mapping
from typing import Annotated, Final

import msgspec

from bridges.kinds.shared.fields import tells
from drivers import DriverError

TEXT_MAX: Final = 200
ABSENT: Final = object()

Field = Annotated[
    str,
    msgspec.Meta(
        pattern=r"^[A-Za-z_$@][A-Za-z0-9_$@:-]*(\.[A-Za-z0-9_$@:-]+)*$(?!\n)",
        max_length=128,
        extra={"pattern": "names with dots between them (status.code)"},
    ),
]
"""The path to a value: object keys and list indexes (from 0), with dots between them."""


Value = bool | int | float | str
"""A value that a field may hold, such as true, 3, 0.5 or a word."""


class JsonFlag(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The place of a flag (yes or no) in the answer."""

    field: Annotated[
        Field, tells("the field that holds the value, as names with dots between them.")
    ]
    when: Annotated[
        list[Value],
        tells("""the values that mean yes. Every other value means no. Without `when` the field must
        be true or false."""),
    ] = []


class JsonNumber(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The place of a measurement in the answer."""

    field: Annotated[Field, tells("the field of the answer that holds the number.")]
    scale: Annotated[
        float,
        tells("the factor that turns the maker's unit into this value's unit (0.001 for mV)."),
    ] = 1.0


def flag(answer: Mapping[str, object], place: JsonFlag) -> bool:
    """Return yes or no. Null means no. Raises DriverError for an absent field or a wrong type."""
    value = needed(answer, place.field)
    if value is None:
        return False
    if place.when and isinstance(value, Value):
        return any(same(value, yes) for yes in place.when)
    if not isinstance(value, bool):
        raise wrong(place.field, value, "a number or text" if place.when else "true or false")
    return value


def flag_if(answer: Mapping[str, object], place: JsonFlag | None) -> bool | None:
    """Return the flag as `flag` does. Return None if `place` is None. Raises DriverError."""
    return None if place is None else flag(answer, place)


def certain(answer: Mapping[str, object], place: JsonFlag | None) -> bool:
    """Return the flag. Return False if `place` is None. Raises DriverError as `flag` does.

    Raises DriverError for null too. Null would leave open whether there is a danger, or whether a
    contact or relay is on.
    """
    if place and needed(answer, place.field) is None:
        raise wrong(place.field, None, "yes or no")
    return place is not None and flag(answer, place)


def certain_if(answer: Mapping[str, object], place: JsonFlag | None) -> bool | None:
    """Return the flag as `certain` does. Return None if `place` is None. Raises DriverError."""
    return None if place is None else certain(answer, place)


def place_text(place: JsonFlag | JsonNumber) -> str:
    """Describe the place for `check`. A flag's description has the field and the values that mean yes.
    A number's description has the field and the scale."""
    if isinstance(place, JsonNumber):
        return place.field if place.scale == 1.0 else f"{place.field} x {place.scale:g}"
    return f"{place.field} is {', '.join(map(value_text, place.when)) or 'true'}"


def value_text(value: Value) -> str:
    """Return a value as JSON writes it. A text has no quotes."""
    return clean(str(value).lower() if isinstance(value, bool) else str(value), 40)


def same(value: object, given: Value) -> bool:
    """Are the two JSON values equal? The value true differs from 1, and 1.0 equals 1."""
    return isinstance(value, bool) == isinstance(given, bool) and value == given


def is_field(text: str) -> bool:
    """Is this a valid path to a field of an answer?"""
    try:
        msgspec.convert(text, Field)
    except msgspec.ValidationError:
        return False
    return True


def found(answer: object, field: str) -> object:
    """Return the field's value. Return ABSENT if the answer has no such field."""
    for part in field.split("."):
        if isinstance(answer, dict):
            answer = answer.get(part, ABSENT)
        elif isinstance(answer, list) and part.isdecimal() and int(part) < len(answer):
            answer = answer[int(part)]
        else:
            return ABSENT
    return answer


def needed(answer: Mapping[str, object], field: str) -> object:
    """Return the field's value. If the field is absent, raise a DriverError that lists the present
    fields."""
    value = found(answer, field)
    if value is ABSENT:
        names = ", ".join(clean(name) for name in list(answer)[:5]) or "nothing"
        raise DriverError(f"the answer has no '{field}'; it has {names}: is state_path right?")
    return value


def text(answer: Mapping[str, object], field: str) -> str:
    """Return a text, made printable and put on one line. Return "" if the field is absent or null."""
    value = found(answer, field)
    if value is ABSENT or value is None:
        return ""
    if not isinstance(value, str):
        raise wrong(field, value, "a text")
    return clean(value)


def number(answer: Mapping[str, object], field: str, scale: float) -> float | None:
    """Return a number times `scale`. Return None if the field is absent or null. Raises DriverError for
    any other value."""
    value = found(answer, field)
    if value is ABSENT or value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise wrong(field, value, "a number")
    try:
        scaled = value * scale
    except OverflowError:
        scaled = math.inf
    if not math.isfinite(scaled):
        raise wrong(field, value, "a number of sensible size")
    return scaled


def name(answer: Mapping[str, object], field: str) -> str:
    """Return an id (a whole number or a text) as text. Return "" for null. Raises DriverError if the
    field is absent or has another type."""
    value = needed(answer, field)
    if value is None:
        return ""
    if isinstance(value, bool) or not isinstance(value, int | str):
        raise wrong(field, value, "a text or a whole number")
    return clean(str(value), 64)


def wrong(field: str, value: object, wanted: str) -> DriverError:
    """Return an error with the field, its value as JSON writes it, and the expected value."""
    words = {"True": "true", "False": "false", "None": "null"}
    shown = reprlib.repr(value)
    return DriverError(
        f"'{field}' is {clean(words.get(shown, shown), 40)}, and {wanted} is expected"
    )


def clean(said: str, longest: int = TEXT_MAX) -> str:
    """Make a text from a device printable, on one line and at most `longest` characters long."""
    said = "".join(c if c.isprintable() else " " for c in said[: 4 * longest])
    said = " ".join(said.split())
    return said if len(said) <= longest else f"{said[: longest - 1]}…"
