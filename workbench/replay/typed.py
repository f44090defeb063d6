"""Check recorded values against a core's own type annotations. This check is necessary, because
`value_codec.value` accepts any type of value with any content in its fields."""

import math
import types
from collections.abc import Callable, Hashable, Iterator, Mapping
from functools import cache
from itertools import zip_longest
from typing import Any, Literal, Never, TypeVar, Union, get_args, get_origin, get_type_hints

from bridges.blackbox.value_codec import Tree, UnknownValue, value

LONGEST = 100


@cache
def types_of(decide: Callable[..., Any]) -> Mapping[str, Any]:
    """Return a core's types: `memory`, `event`, `outputs`, `report`. The types of `outputs` and
    `report` also allow None."""
    hints = get_type_hints(decide)
    memory, outputs, report = get_args(hints["return"])
    told = {"outputs": Union[outputs, None], "report": Union[report, None]}  # noqa: UP007
    return {"memory": memory, "event": hints["event"], **told}


def typed(told: Tree, hint: Any) -> Any:
    """Convert a recorded tree (nested lists and dicts) to the value that it stands for. Raises
    UnknownValue if a part does not have its annotated type."""
    found = value(told)
    if not _fits(found, hint):
        shown = str(told)
        raise UnknownValue(f"the core of this version does not accept the value {shown[:LONGEST]}")
    return found


def _fits(found: Any, hint: Any) -> bool:
    origin, args = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return any(_fits(found, one) for one in args)
    if origin is Literal:
        return any(type(found) is type(one) and found == one for one in args)
    if hint in (Any, object):
        return True
    if hint is float:
        return type(found) in (int, float) and not math.isnan(found)
    if hint is Never or not isinstance(found, origin or hint):
        return False
    if isinstance(found, bool) and hint is not bool:
        return False
    return all(_fits(part, of) for part, of in _parts(found, args))


def _parts(found: Any, args: tuple[Any, ...]) -> Iterator[tuple[Any, Any]]:
    """Yield a value's parts with their types. `args` are the arguments of the value's type."""
    kind: Any = type(found)
    if fields := _fields(kind, args):
        yield from ((getattr(found, name), hint) for name, hint in fields.items())
    elif isinstance(found, Mapping):
        yield from (pair for both in found.items() for pair in zip(both, args, strict=False))
    elif isinstance(found, tuple) and args[1:] != (...,):
        yield from zip_longest(found, args, fillvalue=Never)
    elif isinstance(found, tuple | frozenset):
        yield from ((part, args[0]) for part in found)


@cache
def _fields(kind: Hashable, args: tuple[Any, ...]) -> Mapping[str, Any]:
    """Return the fields of a struct or named tuple with their types. Return {} for other types."""
    if not hasattr(kind, "__struct_fields__") and not hasattr(kind, "_fields"):
        return {}
    own = dict(zip(getattr(kind, "__parameters__", ()), args, strict=False))
    return {name: _closed(hint, own) for name, hint in get_type_hints(kind).items()}


def _closed(hint: Any, own: Mapping[Any, Any]) -> Any:
    """Return a type without type variables. `own` is type variable -> its type in the class that
    contains the field."""
    if isinstance(hint, TypeVar):
        return own.get(hint, Any)
    open_ = getattr(hint, "__parameters__", ()) if get_origin(hint) else ()
    return hint[tuple(own.get(one, Any) for one in open_)] if open_ else hint
