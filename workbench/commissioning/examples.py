"""Examples for the keys of the configuration reference.

An example is the value in a shipped file. If no shipped file has the key, the example is the default.
If there is no default, the example is some value of the right type. Shipped files are tested, so these
examples stay valid.
"""

import functools
from collections.abc import Iterator
from pathlib import Path

import msgspec
import yaml
from msgspec import inspect as mi

import drivers
from bridges.kinds import kind_names
from bridges.settings import names as named
from bridges.settings.load import load
from bridges.settings.shown import is_section
from bridges.yaml.scalar_types import choices
from drivers.profiles import Profile

CONFIG = Path(drivers.__file__).parents[1] / "config"
LONGEST = 72

WRITTEN: dict[str, object] = {
    "topics": {"lift_states": "ward/lift_states"},
    "connect": ["tcp/192.168.1.10:7447"],
    "listen": ["tcp/0.0.0.0:7447"],
    "user": "lift1",
    "password_file": "/etc/rmf-bridges/zenoh.password",
    "ca": "/etc/rmf-bridges/ca.pem",
    "certificate": "/etc/rmf-bridges/lift1.pem",
    "private_key": "/etc/rmf-bridges/lift1.key",
    "token_file": "/etc/rmf-bridges/charger.token",
    "token_header": "X-API-Key",
    "ca_file": "/etc/rmf-bridges/ca.pem",
    "push_path": "/events",
    "certificate_file": "/etc/rmf-bridges/lift1.pem",
    "key_file": "/etc/rmf-bridges/lift1.key",
    "without_timer": "the lamp may stay on",
    "driver": "register",
    "bus": "module",
    "accept_unsafe": {"fire_alarm": "the panel supervises its own loop"},
    "station": {"MobileErrors.GridError": "the grid supply is not right"},
    "robot": {"MobileErrors.OverTemperature": "the receiver is too hot"},
    "at_height": "PadStatus.AtHeight",
    "range_ok": "PadStatus.RangeOk",
    "temperatures": {"coil": "MobileTerminals.CoilTemperature"},
    "state_words": {"READY": 0, "CHARGING": 2},
    "doors": ["ward_door"],
    "lifts": ["Lift1"],
    "maps": {"L1": "ground floor"},
    "paths": {"battery": "/robots/$robot/battery"},
}
"""Examples for keys that shipped files lack. One example is enough for each key, because the key has
the same meaning in every section."""

Found = dict[tuple[type, str], str]


def example(struct: type, field: mi.Field) -> str:
    """Return `key: value` as in a YAML. Return "" for a section, because the section's keys have their
    own examples."""
    if is_section(field.type):
        return ""
    shown = next(
        (_shipped()[c, field.name] for c in struct.__mro__ if (c, field.name) in _shipped()), ""
    )
    if not shown:
        written = field.name in WRITTEN and not _is_numbered(field.type)
        shown = flow(WRITTEN[field.name] if written else _by_type(field))
    return f"{field.encode_name}: {shown}"


def device_yamls() -> list[Path]:
    """Return the shipped device YAMLs. Leave out files named `fleet_*.yaml`, which configure RMF's
    fleet adapters."""
    return sorted(f for f in CONFIG.glob("*.yaml") if not f.name.startswith("fleet_"))


@functools.cache
def _shipped() -> Found:
    """Return the shortest value of each field in the shipped files. Leave out values equal to the
    default."""
    found: Found = {}
    for file in device_yamls():
        config = load(file)
        tops = [config.rmf, *config.buses.values(), *config.devices.values(), config.section]
        for top in tops:
            _collect(top, found)
    for profile in _profiles():
        for name in profile.names():
            _collect(profile.load(name), found)
    return found


def _profiles() -> Iterator[Profile[msgspec.Struct]]:
    """Return every type of driver profile."""
    for kind in kind_names():
        for driver in named.driver_names(kind):
            found = vars(named.driver_module(kind, driver)).get("PROFILE")
            if isinstance(found, Profile):
                yield found


def _collect(value: object, found: Found) -> None:
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        for item in value:
            _collect(item, found)
    if isinstance(value, msgspec.Struct):
        for field in msgspec.structs.fields(value):
            inner = getattr(value, field.name)
            _collect(inner, found)
            if inner not in (None, [], {}, field.default):
                _note(found, type(value), field.name, flow(msgspec.to_builtins(inner)))


def _note(found: Found, struct: type, name: str, text: str) -> None:
    for base in struct.__mro__:
        if len(text) <= LONGEST and name in field_names(base):
            found[base, name] = min(found.get((base, name), text), text, key=len)


def field_names(base: type) -> tuple[str, ...]:
    """Return a struct's field names. Return no names for msgspec.Struct and for its base classes."""
    if not issubclass(base, msgspec.Struct) or base is msgspec.Struct:
        return ()
    return base.__struct_fields__


def flow(value: object) -> str:
    """Format a value as YAML on one line."""
    text = yaml.safe_dump(
        value, default_flow_style=True, width=10**6, allow_unicode=True, sort_keys=False
    )
    return text.removesuffix("\n...\n").strip()


def _is_numbered(info: mi.Type) -> bool:
    """Return whether the mapping's keys are numbers."""
    if isinstance(info, mi.Metadata):
        return _is_numbered(info.type)
    key = info.key_type if isinstance(info, mi.DictType) else None
    return isinstance(key.type if isinstance(key, mi.Metadata) else key, mi.IntType)


def _by_type(field: mi.Field) -> object:
    if isinstance(field.default, str | int | float) and not isinstance(field.default, bool):
        return field.default
    return _any_of(field.type, field)


def _any_of(info: mi.Type, field: mi.Field) -> object:
    """Return some valid value of this type."""
    match info:
        case mi.Metadata(type=part):
            return _any_of(part, field)
        case mi.UnionType(types=types):
            return _any_of(next(t for t in types if not isinstance(t, mi.NoneType)), field)
        case mi.DictType(key_type=key, value_type=part):
            return {_any_of(key, field): _any_of(part, field)}
        case mi.ListType(item_type=part) | mi.VarTupleType(item_type=part):
            return [_any_of(part, field)]
        case mi.LiteralType() | mi.EnumType():
            return list(choices(info).values())[-1]
        case mi.BoolType():
            return field.default is not True
        case mi.FloatType() | mi.IntType():
            return _number(info)
    return "text"


def _number(info: mi.FloatType | mi.IntType) -> float:
    """Return a plain number within the bounds."""
    least = info.ge if info.ge is not None else 1
    most = info.le if info.le is not None else least + 10
    return next(n for n in (5, 1, 10, least, most) if least <= n <= most)
