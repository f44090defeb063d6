"""Converts one YAML scalar to a text, number, boolean or choice. If the scalar does not fit,
WrongScalar is raised with the reason.

msgspec decides whether the type allows the value. A text without quotes must not be a number, boolean
or date in any version of YAML. A number must be written unambiguously (`scalars.py`).
"""

from collections.abc import Callable, Mapping
from typing import Annotated, Literal

import msgspec
from msgspec.inspect import (
    BoolType,
    DictType,
    EnumType,
    FloatType,
    IntType,
    ListType,
    LiteralType,
    Metadata,
    NoneType,
    StrType,
    StructType,
    Type,
    UnionType,
    VarTupleType,
)
from yaml import Node, ScalarNode, SequenceNode

from bridges.yaml.parsing import is_plain
from bridges.yaml.scalars import TRUTHS, number, reads_as, whole_number
from bridges.yaml.spelling import either, nearest, short
from bridges.yaml.typo_hints import has_unit, number_meant

Extra = Mapping[str, str]
"""The `Meta(extra=…)` of a field: its `unit`, its `pattern` in words, the reason for its `least` value,
and the name of its `check`."""


class WrongScalar(Exception):
    """The error of a scalar that does not fit its type. The error's text begins with a verb ("is …"),
    because the caller puts the value's name before it. The text has no full stop at its end."""


def looks(node: Node) -> str:
    """Describe the node in words, such as `the number 5`."""
    if isinstance(node, SequenceNode):
        return "a list"
    if not isinstance(node, ScalarNode):
        return "a mapping"
    written = short(node.value)
    reading = reads_as(node.value) if is_plain(node) else None
    if reading is None:
        return f"the text '{written}'"
    if number(node.value) is not None:
        return f"the number {written}"
    return reading if written == reading else f"{reading} ({written})"


def wanted_text(wanted: Type, extra: Extra | None = None) -> str:
    """Describe the values that a type allows, with bounds and unit."""
    if isinstance(wanted, Metadata):
        return wanted_text(wanted.type, wanted.extra)
    if isinstance(wanted, UnionType):
        members = [t for t in wanted.types if not isinstance(t, NoneType)]
        return either(wanted_text(t, extra) for t in members)
    if isinstance(wanted, IntType | FloatType):
        noun = "a whole number" if isinstance(wanted, IntType) else "a number"
        return f"{noun}{_span(wanted, extra or {})}"
    if isinstance(wanted, LiteralType | EnumType):
        return either(choices(wanted))
    return _NOUNS[type(wanted)]


_NOUNS: dict[type[Type], str] = {
    StrType: "text",
    BoolType: "true or false",
    ListType: "a list ([...])",
    VarTupleType: "a list ([...])",
    DictType: "a mapping (key: value)",
    StructType: "a mapping (key: value)",
}


def leaf(types: list[Type], node: ScalarNode, extra: Extra) -> object:
    """Convert the scalar to the first of these types that accepts it. Raises WrongScalar."""
    *others, last = sorted(types, key=_rank)
    for wanted in others:
        try:
            return leaf([wanted], node, extra)
        except WrongScalar:
            continue
    if isinstance(last, Metadata):
        return leaf([last.type], node, last.extra or {})
    if is_plain(node) and not node.value:
        raise WrongScalar(f"has no value: write {wanted_text(last, extra)}")
    value = _read(last, node, extra)
    try:
        return msgspec.convert(value, _annotation(last))
    except msgspec.ValidationError as error:
        raise WrongScalar(_reason(last, node, extra, "length" in str(error))) from None


def _rank(wanted: Type) -> int:
    """Return a sort key that puts text last, because nearly every scalar fits text."""
    return isinstance(wanted.type if isinstance(wanted, Metadata) else wanted, StrType)


def _annotation(wanted: Type) -> object:
    """Return a type that `convert` accepts. It has the same bounds as `wanted`, which is msgspec's
    description of the type."""
    if isinstance(wanted, EnumType):
        return wanted.cls
    if isinstance(wanted, LiteralType):
        return Literal[wanted.values]
    return Annotated[_PLAIN[type(wanted)], msgspec.Meta(**msgspec.structs.asdict(wanted))]


_PLAIN: dict[type[Type], type] = {StrType: str, IntType: int, FloatType: float, BoolType: bool}


def _read(wanted: Type, node: ScalarNode, extra: Extra) -> object:
    """Return the value if its spelling is unambiguous. Raises WrongScalar."""
    if isinstance(wanted, LiteralType | EnumType):  # here the text itself is the value
        return choices(wanted).get(node.value, node.value)
    if isinstance(wanted, StrType):
        _check_text(node, extra)
        return node.value
    value = _READINGS[type(wanted)](node.value) if is_plain(node) else None
    if value is None:
        raise _misread(wanted, node, extra)
    return value


_READINGS: dict[type[Type], Callable[[str], object]] = {
    IntType: whole_number,
    FloatType: number,
    BoolType: TRUTHS.get,
}


def _reason(wanted: Type, node: ScalarNode, extra: Extra, length: bool) -> str:
    """Return the reason why `convert` refused the value. `length`: the text is too short or too
    long."""
    written = short(node.value)
    if isinstance(wanted, LiteralType | EnumType):
        near = nearest(node.value, choices(wanted))
        meant = f" (did you mean '{near}'?)" if near else ""
        return f"is '{written}': write {wanted_text(wanted)}{meant}"
    if not isinstance(wanted, StrType):
        why = _milliseconds(wanted, node, extra) or _too_little(wanted, node, extra)
        return f"is {written}: write {wanted_text(wanted, extra)}{why}"
    if length:
        least, most = wanted.min_length or 0, wanted.max_length
        span = f"at least {least}" if most is None else f"{least} to {most}"
        return f"has {len(node.value)} characters: {span} are allowed"
    form = extra.get("pattern", "text of another form")
    return f"is '{written}': write {form}"


def _too_little(wanted: Type, node: ScalarNode, extra: Extra) -> str:
    """Return the reason why the type has a least value, if this value is less. Otherwise return ""."""
    value, least = number(node.value), getattr(wanted, "ge", None)
    small = value is not None and least is not None and value < least
    return f"; {extra['least']}" if small and "least" in extra else ""


def _milliseconds(wanted: Type, node: ScalarNode, extra: Extra) -> str:
    """Return a hint with the duration in seconds, if the duration was probably given in milliseconds;
    otherwise ""."""
    if extra.get("unit") != "s" or not isinstance(wanted, FloatType):
        return ""
    value, least, most = number(node.value), wanted.ge, wanted.le
    if value is None or least is None or most is None or not least <= value / 1000 <= most < value:
        return ""
    return f"; for {value:g} milliseconds write {value / 1000:g}"


def _check_text(node: ScalarNode, extra: Extra) -> None:
    text: str = node.value
    reading = reads_as(text) if is_plain(node) and "check" not in extra else None
    if reading is not None and "number" in extra:
        raise WrongScalar(f"is the number {text}: write {extra['number']}")
    if reading is not None:
        taken = f"is written {short(text)}, which YAML may read as {reading}"
        if looks(node) == f"the number {text}":
            taken = f"is the number {text}"
        raise WrongScalar(f'{taken}: if the text is meant, write "{short(text)}" in quotes')


def _misread(wanted: Type, node: ScalarNode, extra: Extra) -> WrongScalar:
    """Return the error for a text that is not a plain number or boolean. The error's text shows the
    right spelling."""
    text, asked = short(node.value), wanted_text(wanted, extra)
    whole = isinstance(wanted, IntType)
    if not is_plain(node):
        read = _READINGS[type(wanted)](node.value) is not None
        return WrongScalar(
            f'is the text "{text}": write {asked}{", without quotes" if read else ""}'
        )
    meant = "" if isinstance(wanted, BoolType) else number_meant(node.value, whole)
    if meant:
        return WrongScalar(f"is written {text}: write {meant}, {asked}")
    if extra.get("unit") and has_unit(node.value):
        return WrongScalar(f"is written {text}: write the number alone, {asked}")
    reading = reads_as(node.value) or ""
    if isinstance(wanted, BoolType) and reading in ("true", "false"):
        return WrongScalar(
            f"is written {text}, which YAML versions read differently: write {reading}"
        )
    if reading.startswith("the number") and number(node.value) is None:
        return WrongScalar(
            f"is written {text}, which YAML may read as {reading}: write {asked} plainly"
        )
    return WrongScalar(f"is {looks(node)}: write {asked}")


def _span(wanted: IntType | FloatType, extra: Extra) -> str:
    """Return the bounds with their unit, such as ` from 0 to 10 s`."""
    words = []
    if wanted.ge is not None and wanted.le is not None:
        words += [f"from {_digits(wanted.ge)} to {_digits(wanted.le)}"]
    else:
        words += [f"of at least {_digits(wanted.ge)}"] if wanted.ge is not None else []
        words += [f"of at most {_digits(wanted.le)}"] if wanted.le is not None else []
    words += [f"above {_digits(wanted.gt)}"] if wanted.gt is not None else []
    words += [f"below {_digits(wanted.lt)}"] if wanted.lt is not None else []
    words += (
        [f"in steps of {_digits(wanted.multiple_of)}"] if wanted.multiple_of is not None else []
    )
    unit = extra.get("unit", "")
    if not words:
        return f" ({unit})" if unit else ""
    return f" {' and '.join(words)}{f' {unit}' if unit else ''}"


def _digits(bound: float) -> str:
    """Return the bound as a person writes it, such as 1000000 or 0.05."""
    return str(int(bound)) if bound == int(bound) else f"{bound:g}"


def choices(wanted: LiteralType | EnumType) -> dict[str, object]:
    """Map each allowed text to its value."""
    values = wanted.values if isinstance(wanted, LiteralType) else [m.value for m in wanted.cls]
    return {str(value): value for value in values}
