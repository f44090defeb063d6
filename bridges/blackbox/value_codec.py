"""Converts the values of decision cores (events, memories, outputs, reports) to trees of plain values,
and back.

A tree holds None, bool, int, float, str, lists, and mappings with text as keys. A tuple becomes a list.
Any other value becomes a mapping. Its key `""` has the name of the type, such as `lift.memory.Session`.
The other keys are the value's fields, or the key `=` has the value's content.

Only types in the list of names are written and created. `bridges/kinds/shared/recorded.py` and
`RECORDED` of each kind have this list. So a recording cannot make this program create an object of any
other type.
"""

import math
import sys
from collections.abc import Mapping
from enum import Enum
from functools import cache
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import msgspec

from bridges.kinds import kind_names, recorded
from bridges.kinds.shared.recorded import SHARED

if TYPE_CHECKING:
    Tree = None | bool | int | float | str | list["Tree"] | dict[str, "Tree"]
else:  # msgspec knows no recursive types; with Any it decodes only plain values
    Tree = Any

TYPE: Final = ""
HOLDS: Final = "="
MAP, SET, NUMBER = "map", "set", "number"
ENDLESS: Final = (math.inf, -math.inf)
"""The floats that JSON cannot hold."""
PLAIN: Final = frozenset({type(None), bool, int, float, str})


class UnknownValue(ValueError):
    """Error for a tree that names a type, field or member that this version does not have."""


class Struct(NamedTuple):
    """A type with fields. `name`: the type's name in a tree.

    `fields`: for each field, its name in the code and its name in trees. The names differ if the field
    was renamed (`msgspec.field(name=…)`).
    """

    name: str
    fields: tuple[tuple[str, str], ...]


def tree(value: object) -> Tree:
    """Return a value as a tree. Raises TypeError for a type that no decision core uses."""
    kind: type[Any] = type(value)
    if kind is float and value in ENDLESS:
        return {TYPE: NUMBER, HOLDS: str(value)}
    if kind in PLAIN:
        return value  # type: ignore[return-value]
    if kind is tuple or kind is list:
        return [tree(part) for part in value]  # type: ignore[attr-defined]
    if struct := _struct(kind):
        found: dict[str, Tree] = {TYPE: struct.name}
        for name, recorded in struct.fields:
            found[recorded] = tree(getattr(value, name))
        return found
    return _other(value)


def _other(value: object) -> Tree:
    if isinstance(value, Enum):
        return {TYPE: name_of(type(value)), HOLDS: value.name}
    if isinstance(value, frozenset | set):
        return {TYPE: SET, HOLDS: sorted(map(tree, value), key=repr)}
    if isinstance(value, Mapping):
        return {TYPE: MAP, HOLDS: [[tree(key), tree(part)] for key, part in value.items()]}
    if isinstance(value, tuple):  # a named tuple
        return {TYPE: name_of(type(value)), HOLDS: [tree(part) for part in value]}
    raise TypeError(f"{type(value).__name__} is not a value of a core")


def value(found: Tree) -> Any:
    """Return the value that a tree describes. Raises UnknownValue."""
    try:
        return _value(found)
    except (TypeError, KeyError, AttributeError, ValueError, RecursionError) as error:
        raise UnknownValue(f"not a value of a core: {error}") from error


def _value(found: Tree) -> Any:
    if isinstance(found, list):
        return tuple(map(_value, found))
    if not isinstance(found, dict):
        return found
    name, held = found.get(TYPE), found.get(HOLDS)
    if name == MAP and isinstance(held, list):
        return {_value(key): _value(part) for key, part in _twos(held)}
    if name == SET and isinstance(held, list):
        return frozenset(map(_value, held))
    if name == NUMBER:
        return float(str(held))
    return _made(_type(str(name)), found, held)


def _twos(held: list[Tree]) -> list[tuple[Tree, Tree]]:
    found = [(part[0], part[1]) for part in held if isinstance(part, list) and len(part) == 2]
    if len(found) != len(held):
        raise UnknownValue("a mapping with parts that are no pairs")
    return found


def _made(kind: type[Any], found: dict[str, Tree], held: Tree) -> object:
    if issubclass(kind, Enum):
        return kind[str(held)]
    if issubclass(kind, tuple):
        return kind(*map(_value, held if isinstance(held, list) else ()))
    struct = _struct(kind)
    assert struct
    return kind(**{name: _value(found[key]) for name, key in struct.fields if key in found})


_structs: dict[type[Any], Struct | None] = {}


def first_difference(one: Tree, other: Tree, path: str = "") -> tuple[str, Tree, Tree] | None:
    """Return the first difference of two trees as its path and both values. Return None for equal
    trees.

    If only one tree has a field, that is no difference. Another version of the program may have more or
    fewer fields.
    """
    if isinstance(one, dict) and isinstance(other, dict) and one.get(TYPE) == other.get(TYPE):
        names = [name for name in one if name in other]
        below = ((f"{path}.{name}".strip("."), one[name], other[name]) for name in names)
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        pairs = enumerate(zip(one, other, strict=True))
        below = ((f"{path} {place}".strip(), *both) for place, both in pairs)
    else:
        return None if one == other else (path, one, other)
    found = (first_difference(was, now, where) for where, was, now in below)
    return next(filter(None, found), None)


def _struct(kind: type[Any]) -> Struct | None:
    """Return a type's name and fields. Return None for a type without fields."""
    if kind not in _structs:
        _structs[kind] = _found(kind)
    return _structs[kind]


def _found(kind: type[Any]) -> Struct | None:
    if issubclass(kind, msgspec.Struct):
        fields = zip(kind.__struct_fields__, kind.__struct_encode_fields__, strict=True)
        return Struct(name_of(kind), tuple(fields))
    return None


@cache
def name_of(kind: type) -> str:
    """Return the name of a type in recordings. Raises TypeError for a type without a name."""
    package = sys.modules[kind.__module__.rpartition(".")[0] or kind.__module__]
    for name, named in (*SHARED.items(), *getattr(package, "RECORDED", {}).items()):
        if named is kind:
            return str(name)
    raise TypeError(f"{kind.__name__} is not a value of a core")


@cache
def _type(name: str) -> type[Any]:
    """Return the type with this recorded name. Import only the kind that the first word of the name
    gives. Raises UnknownValue."""
    kind = name.partition(".")[0]
    known = recorded(kind) if kind in kind_names() else SHARED
    if name not in known:
        raise UnknownValue(f"{name!r} is not the name of a core's value in this version")
    return known[name]
