"""One YAML scalar to one text, number, truth or choice, within its bounds; and how to say what not.

A text is a text only if YAML could not take it for something else, a number only if it is written
so that nobody can misread it (`yaml_scalars`).
"""

import re
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

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

from bridges.settings.nodes import either, is_plain, nearest, shown
from bridges.settings.scalars import TRUTHS, number, reads_as, whole_number

Extra = Mapping[str, Any]
N = TypeVar("N", int, float)


class Wrong(Exception):
    """A scalar that is not what is wanted. The text follows the value's name: "is ...": no dot."""


def looks(node: Node) -> str:
    """What stands there, as a person would say it."""
    if isinstance(node, SequenceNode):
        return "a list"
    if not isinstance(node, ScalarNode):
        return "a mapping"
    written = shown(node.value)
    reading = reads_as(node.value) if is_plain(node) else None
    if reading is None:
        return f"the text '{written}'"
    if number(node.value) is not None:
        return f"the number {written}"
    return reading if written == reading else f"{reading} ({written})"


def wanted_text(wanted: Type, extra: Extra | None = None) -> str:
    """What a type asks for, with bounds and unit."""
    if isinstance(wanted, Metadata):
        return wanted_text(wanted.type, wanted.extra)
    if isinstance(wanted, UnionType):
        members = [t for t in wanted.types if not isinstance(t, NoneType)]
        return either(wanted_text(t, extra) for t in members)
    if isinstance(wanted, IntType | FloatType):
        noun = "a whole number" if isinstance(wanted, IntType) else "a number"
        return f"{noun}{_span(wanted, extra or {})}"
    if isinstance(wanted, LiteralType | EnumType):
        return either(_choices(wanted))
    return _NOUNS[type(wanted)]


_NOUNS: dict[type[Type], str] = {
    StrType: "text",
    BoolType: "true or false",
    ListType: "a list ([...])",
    VarTupleType: "a list ([...])",
    DictType: "a mapping (key: value)",
    StructType: "a mapping (key: value)",
}


def leaf(types: list[Type], node: ScalarNode, extra: Extra) -> Any:
    """The scalar as the first of these types that it can be. Raises Wrong."""
    *others, last = sorted(types, key=_rank)
    for wanted in others:
        try:
            return leaf([wanted], node, extra)
        except Wrong:
            continue
    if isinstance(last, Metadata):
        return leaf([last.type], node, last.extra or {})
    if is_plain(node) and not node.value:
        raise Wrong(f"has no value: {wanted_text(last, extra)} is wanted")
    return _READERS[type(last)](last, node, extra)


def _rank(wanted: Type) -> int:
    """Text last: it fits nearly everything."""
    return isinstance(wanted.type if isinstance(wanted, Metadata) else wanted, StrType)


def _text(wanted: StrType, node: ScalarNode, extra: Extra) -> str:
    text: str = node.value
    reading = reads_as(text) if is_plain(node) and "check" not in extra else None
    if reading is not None:
        taken = f"is written {shown(text)}, which YAML may read as {reading}"
        if looks(node) == f"the number {text}":
            taken = f"is the number {text}"
        raise Wrong(f'{taken}: if the text is meant, write "{shown(text)}" in quotes')
    least, most = wanted.min_length or 0, wanted.max_length
    if len(text) < least or (most is not None and len(text) > most):
        raise Wrong(f"has {len(text)} characters: {_between(least, most)} are allowed")
    if any("\ud800" <= c <= "\udfff" for c in text):
        raise Wrong("holds half a character (\\ud800 to \\udfff): write the whole character")
    if wanted.pattern is not None and not re.search(wanted.pattern, text):
        form = extra.get("pattern", f"text like {wanted.pattern}")
        raise Wrong(f"is '{shown(text)}': {form} is wanted")
    return text


def _between(least: int, most: int | None) -> str:
    return f"at least {least}" if most is None else f"{least} to {most}"


def _whole(wanted: IntType, node: ScalarNode, extra: Extra) -> int:
    value = whole_number(node.value) if is_plain(node) else None
    if value is None:
        raise _no_number(node, wanted_text(wanted, extra))
    return _within(wanted, value, node, extra)


def _number(wanted: FloatType, node: ScalarNode, extra: Extra) -> float:
    value = number(node.value) if is_plain(node) else None
    if value is None:
        raise _no_number(node, wanted_text(wanted, extra))
    return _within(wanted, value, node, extra)


def _no_number(node: ScalarNode, wanted: str) -> Wrong:
    text = shown(node.value)
    if not is_plain(node):
        hint = ", without quotes" if number(node.value) is not None else ""
        return Wrong(f'is the text "{text}": {wanted} is wanted{hint}')
    reading = reads_as(node.value)
    if reading and reading.startswith("the number") and number(node.value) is None:
        return Wrong(f"is written {text}, which YAML may read as {reading}: write {wanted} plainly")
    return Wrong(f"is {looks(node)}: {wanted} is wanted")


def _within(wanted: IntType | FloatType, value: N, node: ScalarNode, extra: Extra) -> N:
    """The value if its type's bounds allow it."""
    fine = (
        (wanted.gt is None or value > wanted.gt)
        and (wanted.ge is None or value >= wanted.ge)
        and (wanted.lt is None or value < wanted.lt)
        and (wanted.le is None or value <= wanted.le)
        and (wanted.multiple_of is None or value % wanted.multiple_of == 0)
    )
    if not fine:
        raise Wrong(f"is {shown(node.value)}: {wanted_text(wanted, extra)} is wanted")
    return value


def _span(wanted: IntType | FloatType, extra: Extra) -> str:
    """The bounds with their unit: ` from 0 to 10 s`."""
    words = []
    if wanted.ge is not None and wanted.le is not None:
        words += [f"from {wanted.ge:g} to {wanted.le:g}"]
    else:
        words += [f"of at least {wanted.ge:g}"] if wanted.ge is not None else []
        words += [f"of at most {wanted.le:g}"] if wanted.le is not None else []
    words += [f"above {wanted.gt:g}"] if wanted.gt is not None else []
    words += [f"below {wanted.lt:g}"] if wanted.lt is not None else []
    words += [f"in steps of {wanted.multiple_of:g}"] if wanted.multiple_of is not None else []
    unit = extra.get("unit", "")
    if not words:
        return f" ({unit})" if unit else ""
    return f" {' and '.join(words)}{f' {unit}' if unit else ''}"


def _truth(wanted: BoolType, node: ScalarNode, extra: Extra) -> bool:
    if is_plain(node) and node.value in TRUTHS:
        return TRUTHS[node.value]
    reading = reads_as(node.value) if is_plain(node) else None
    if reading in ("true", "false"):
        raise Wrong(f"is written {node.value}, which not every YAML reads alike: write {reading}")
    hint = ", without quotes" if node.value in TRUTHS else ""
    raise Wrong(f"is {looks(node)}: true or false is wanted{hint}")


def _choices(wanted: LiteralType | EnumType) -> dict[str, Any]:
    if isinstance(wanted, LiteralType):
        return {str(v): v for v in wanted.values}
    return {str(member.value): member for member in wanted.cls}


def _choice(wanted: LiteralType | EnumType, node: ScalarNode, extra: Extra) -> Any:
    """One of a few words. They are compared as written, so that YAML's readings do not matter."""
    choices = _choices(wanted)
    if node.value in choices:
        return choices[node.value]
    near = nearest(node.value, choices)
    meant = f" (did you mean '{near}'?)" if near else ""
    raise Wrong(f"is '{shown(node.value)}': {either(choices)} is wanted{meant}")


_READERS: dict[type[Type], Callable[[Any, ScalarNode, Extra], Any]] = {
    StrType: _text,
    IntType: _whole,
    FloatType: _number,
    BoolType: _truth,
    LiteralType: _choice,
    EnumType: _choice,
}
