"""All types that a daemon can record. This file finds them from the arguments and results of the cores,
which are the daemons' decision logic."""

import enum
import types
import typing
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

import msgspec

from bridges.kinds import kind_called, kind_names
from bridges.kinds.shared.decision import Decision
from bridges.messages import constants
from bridges.messages.definitions import Message

PLAIN: dict[Any, Any] = {bool: True, int: 1, float: 1.5, str: "a", None: None, type(None): None}
BOXES: dict[Any, Any] = {tuple: tuple, frozenset: frozenset, set: frozenset}
Bound = Mapping[Any, Any]
"""The concrete type for each type parameter of a generic type."""


@cache
def recordable() -> tuple[Any, ...]:
    """Return the types inside any memory, event, output, report or message of a kind.

    A generic type comes with concrete types for its parameters.
    """
    found: dict[Any, None] = {}
    for start in _starts():
        _walk(start, {}, found)
    return tuple(found)


def _starts() -> Iterator[Any]:
    yield Message
    yield from (one for one in vars(constants).values() if _is_enum(one))
    for kind in map(kind_called, kind_names()):
        hints = typing.get_type_hints(kind.decide)
        memory, event, _now, _limits, decision = hints.values()
        assert typing.get_origin(decision) is Decision, f"{kind.name}: decide returns {decision}"
        yield from (memory, event, *typing.get_args(decision))


def _walk(hint: Any, bound: Bound, found: dict[Any, None]) -> None:
    for one in _single(_filled(hint, bound)):
        plain = typing.get_origin(one) or one
        if one in found or one in PLAIN or plain is typing.Literal:
            continue
        if plain in BOXES or plain in (list, dict, Mapping):
            for part in typing.get_args(one):
                _walk(part, bound, found) if part is not ... else None
            continue
        found[one] = None
        assert _is_enum(plain) or issubclass(plain, msgspec.Struct | tuple), (
            f"{one} is no struct, tuple or enumeration"
        )
        for part in fields(one).values():
            _walk(part, {}, found)
        for below in plain.__subclasses__():  # a field may also hold a subclass of its type
            _walk(below, {}, found)


def fields(one: Any) -> dict[str, Any]:
    """Return the type of each field of a struct. Concrete types replace the parameters of a generic
    struct."""
    plain = typing.get_origin(one) or one
    if _is_enum(plain):
        return {}
    names = getattr(plain, "__parameters__", ())
    bound = dict(zip(names, typing.get_args(one), strict=False))
    return {name: _filled(hint, bound) for name, hint in typing.get_type_hints(plain).items()}


def _filled(hint: Any, bound: Bound) -> Any:
    """Return a type hint in which concrete types replace the parameters."""
    if isinstance(hint, typing.TypeVar):
        return bound.get(hint, None)
    names = getattr(hint, "__parameters__", ())
    return hint[tuple(bound.get(name) for name in names)] if names and bound else hint


def _single(hint: Any) -> Iterator[Any]:
    """Yield each part of a union. An annotated type loses its annotation."""
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        for part in typing.get_args(hint):
            yield from _single(part)
    elif typing.get_origin(hint) is typing.Annotated:
        yield from _single(typing.get_args(hint)[0])
    else:
        yield hint


def _is_enum(one: Any) -> bool:
    return isinstance(one, type) and issubclass(one, enum.Enum) and one.__module__ != "enum"


def specimens(one: Any) -> list[Any]:
    """Return every member of an enumeration, or one instance of a struct with a value in every
    field."""
    plain = typing.get_origin(one) or one
    if _is_enum(plain):
        return list(plain)
    return [plain(**{name: _specimen(hint) for name, hint in fields(one).items()})]


def _specimen(hint: Any) -> Any:
    first = next((one for one in _single(hint) if one not in (None, type(None))), None)
    plain, parts = typing.get_origin(first) or first, typing.get_args(first)
    if plain in PLAIN:
        return PLAIN[plain]
    if plain is typing.Literal:
        return parts[0]
    if plain in BOXES:
        return BOXES[plain](_specimen(part) for part in parts if part is not ...)
    if plain in (dict, Mapping):
        return {_specimen(parts[0]): _specimen(parts[1])}
    return specimens(first)[0]
