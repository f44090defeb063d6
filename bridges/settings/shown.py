"""Shows the plain settings of a struct as text. A plain setting is a number, a word, or a list of
these. Numbers have their unit. If a value differs from the default, the default is shown too.

Wires, maps and code tables are left out, because their drivers describe them
(`drivers/driver_type.py`).
"""

from collections.abc import Iterator

import msgspec
from msgspec import inspect as mi

Row = tuple[str, str, str]
"""A setting: its path as a key with dots (`limits.stale_after_s`), its value with the unit, and its
default. The default is "" if the value is the default."""

_LEAVES = (str, int, float, bool, type(None))


def plain(struct: object) -> list[Row]:
    """Return every plain setting at any depth: numbers, words, and lists of numbers or words."""
    return list(_rows(struct, (), deep=True))


def choices_of(device: object) -> list[Row]:
    """Return the plain settings of a device and of its sections. Leave out a section that contains
    further sections."""
    return list(_rows(device, (), deep=False))


def _rows(struct: object, path: tuple[str, ...], deep: bool) -> Iterator[Row]:
    for field in _fields(type(struct)):
        value = getattr(struct, field.name)
        here = (*path, field.encode_name)
        if isinstance(value, msgspec.Struct):
            if deep or not any(is_section(f.type) for f in _fields(type(value))):
                yield from _rows(value, here, deep)
        elif _is_plain(value) and not is_section(field.type):
            unit = _unit(field.type)
            yield ".".join(here), _text(value, unit), _instead(field, value, unit)


def _fields(struct: type) -> tuple[mi.Field, ...]:
    info = mi.type_info(struct)
    assert isinstance(info, mi.StructType)
    return info.fields


def is_section(info: mi.Type) -> bool:
    """Return whether a field holds a struct, or a list or mapping of structs."""
    match info:
        case mi.UnionType(types=types):
            return all(is_section(t) for t in types if not isinstance(t, mi.NoneType))
        case mi.ListType(item_type=part) | mi.VarTupleType(item_type=part):
            return is_section(part)
        case mi.Metadata(type=part) | mi.DictType(value_type=part):
            return is_section(part)
    return isinstance(info, mi.StructType)


def _is_plain(value: object) -> bool:
    """Return whether the value is a word or a number, or a list or mapping of words or numbers."""
    value = getattr(value, "value", value)
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        return all(isinstance(item, _LEAVES) for item in value)
    return isinstance(value, _LEAVES)


def _unit(info: mi.Type) -> str:
    """Return the unit of a number; "" if it has no unit."""
    if isinstance(info, mi.Metadata):
        return (info.extra or {}).get("unit", "") or _unit(info.type)
    if isinstance(info, mi.UnionType):
        return next(filter(None, map(_unit, info.types)), "")
    return ""


def _text(value: object, unit: str) -> str:
    value = getattr(value, "value", value)
    if value is None or value in ([], (), {}):
        return "-"
    if value == "":
        return '""'
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        value = f"{value:.10g}"
    if isinstance(value, list | tuple):
        return ", ".join(_text(item, unit) for item in value)
    if isinstance(value, dict):
        return ", ".join(f"{key}: {_text(item, unit)}" for key, item in value.items())
    return f"{value} {unit}".rstrip()


def _instead(field: mi.Field, value: object, unit: str) -> str:
    """Return the default if it differs from the value; otherwise ""."""
    if field.required or field.default in (msgspec.NODEFAULT, None, value):
        return ""
    return f"default: {_text(field.default, unit)}"
