"""The configuration reference, from the structs that read the YAML: as JSON Schema and as a page.

Nothing is typed twice: keys, types, bounds, units and defaults are the structs' own, and a key's
meaning is the line of its struct's docstring that begins with it.
"""

import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import msgspec
from msgspec import inspect as mi

from bridges.core.fields import Rmf
from bridges.core.graph_kind import AnyGraphKind, GraphKind
from bridges.settings import names as named
from bridges.settings.examples import example, flow
from bridges.settings.leaves import Extra, choices, wanted_text
from drivers.driver_type import AnyDriver

KEYS = r"(?:^|(?<=[.;]\s))((?:`\w+`(?:,\s)?)+): "
MEANING = re.compile(rf"{KEYS}(.*?)(?={KEYS}|\Z)", re.M | re.S)


@dataclass(frozen=True, slots=True)
class Shape:
    """One `kind:` with one `driver:`, and the sections that such a file has."""

    kind: str
    devices_key: str
    driver: str
    type: AnyDriver


def shapes() -> Iterator[Shape]:
    """Every sort of file with devices."""
    for kind in named.kind_names():
        key = named.kind_called(kind).devices_key
        for driver in named.driver_names(kind):
            yield Shape(kind, key, driver, named.driver_called(kind, driver))


def graph_kinds() -> list[AnyGraphKind]:
    """Every sort of file without devices."""
    kinds = (named.kind_called(name) for name in named.kind_names())
    return [kind for kind in kinds if isinstance(kind, GraphKind)]


def schema() -> dict[str, Any]:
    """JSON Schema (2020-12) of a device YAML, for editors."""
    buses = {name: named.bus_called(name).settings for name in named.bus_types()}
    graph = [kind.settings for kind in graph_kinds()]
    types = [Rmf, *buses.values(), *(shape.type.settings for shape in shapes()), *graph]
    refs, components = msgspec.json.schema_components(types, ref_template="#/$defs/{name}")
    by_type = dict(zip(types, refs, strict=True))
    for bus in buses.values():
        _allow_type(components, by_type[bus])
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "rmf-bridges device",
        "oneOf": [
            *(_file(shape, buses, by_type) for shape in shapes()),
            *(_graph_file(kind, by_type) for kind in graph_kinds()),
        ],
        "$defs": components,
    }


def _allow_type(components: dict[str, Any], ref: dict[str, Any]) -> None:
    """A bus's `type:` is read before its struct, and is not one of its fields."""
    component = components[ref["$ref"].rsplit("/", 1)[1]]
    component["properties"].setdefault("type", {"type": "string"})


def _file(shape: Shape, buses: dict[str, Any], by_type: dict[Any, Any]) -> dict[str, Any]:
    kinds_of_bus = [
        {"allOf": [by_type[buses[name]], {"properties": {"type": {"const": name}}}]}
        for name in shape.type.buses
        if name in buses
    ]
    return {
        "type": "object",
        "additionalProperties": False,
        "required": ["kind", "driver", "buses", shape.devices_key],
        "properties": {
            "kind": {"const": shape.kind},
            "driver": {"const": shape.driver},
            "rmf": by_type[Rmf],
            "buses": {"type": "object", "additionalProperties": {"oneOf": kinds_of_bus}},
            shape.devices_key: {
                "type": "object",
                "additionalProperties": by_type[shape.type.settings],
            },
        },
    }


def _graph_file(kind: AnyGraphKind, by_type: dict[Any, Any]) -> dict[str, Any]:
    return {
        "type": "object",
        "additionalProperties": False,
        "required": ["kind"],
        "properties": {
            "kind": {"const": kind.name},
            "rmf": by_type[Rmf],
            kind.devices_key: by_type[kind.settings],
        },
    }


def page() -> str:
    """`docs/configuration.md`."""
    sections = [
        "# Configuration reference",
        "Made by `rmf-bridge schema --markdown` from the structs that read the YAML: do not edit."
        " `rmf-bridge schema` prints the same as JSON Schema, for editors.",
        "A file has `kind`, `driver`, `rmf`, `buses` and the devices under their kind's own key. A"
        " supervisor's has `kind`, `rmf` and a section of its own.",
        *_sections("`rmf`", Rmf),
    ]
    for name in named.bus_types():
        sections += _sections(f"Bus of `type: {name}`", named.bus_called(name).settings)
    for shape in shapes():
        title = f"`{shape.devices_key}` with `driver: {shape.driver}`"
        sections += _sections(title, shape.type.settings)
    for kind in graph_kinds():
        sections += _sections(f"`{kind.devices_key}` of `kind: {kind.name}`", kind.settings)
    return "\n\n".join(sections) + "\n"


def _sections(title: str, struct: type) -> Iterator[str]:
    """A struct's table, then those of the structs inside it, each once, by its path from the top."""
    paths: dict[type, list[str]] = {struct: []}
    todo = [(struct, "")]
    while todo:
        current, path = todo.pop(0)
        info = mi.type_info(current)
        assert isinstance(info, mi.StructType)
        for field in info.fields:
            for inner in parts(field.type):
                inside = f"{path}{field.encode_name}"
                if inner not in paths:
                    todo.append((inner, f"{inside}."))
                paths.setdefault(inner, []).append(inside)
    for current, places in paths.items():
        yield f"### {title}: `{places[0]}`" if places else f"## {title}"
        if places[1:]:
            yield f"Likewise {', '.join(f'`{place}`' for place in places[1:])}."
        yield from _struct(current)


def _struct(struct: type) -> Iterator[str]:
    lead, meanings = _docstring(struct)
    if lead:
        yield lead
    info = mi.type_info(struct)
    assert isinstance(info, mi.StructType)
    rows = [
        f"| `{f.encode_name}` | {_type(f.type)} | {_default(f)} | {_example(struct, f)} |"
        f" {meanings.get(f.name, '')} |"
        for f in info.fields
    ]
    heading = ["| key | value | default | example | meaning |", "|---|---|---|---|---|"]
    yield "\n".join([*heading, *rows])


def _example(struct: type, field: mi.Field) -> str:
    text = example(struct, field).replace("|", "\\|")
    return f"`{text}`" if text else "below"


def _docstring(struct: type) -> tuple[str, dict[str, str]]:
    """What a struct is for, and its fields' meanings, its bases' included."""
    meanings: dict[str, str] = {}
    for base in reversed(struct.__mro__):
        for names, text, _ in MEANING.findall(inspect.cleandoc(base.__dict__.get("__doc__") or "")):
            told = " ".join(text.split()).replace("|", "\\|")
            meanings |= dict.fromkeys(re.findall(r"`(\w+)`", names), told)
    lead = MEANING.sub("", inspect.cleandoc(struct.__doc__ or "")).strip()
    return lead, meanings


def parts(info: mi.Type) -> list[type]:
    """The structs that a field's value is made of."""
    match info:
        case mi.StructType(cls=cls):
            return [cls]
        case mi.UnionType(types=types):
            return [cls for part in types for cls in parts(part)]
        case mi.DictType(value_type=part) | mi.ListType(item_type=part):
            return parts(part)
        case mi.VarTupleType(item_type=part) | mi.Metadata(type=part):
            return parts(part)
    return []


def _type(info: mi.Type, extra: Extra | None = None) -> str:
    match info:
        case mi.Metadata(type=part, extra=more):
            return _type(part, more)
        case mi.StructType():
            return "a mapping, below"
        case mi.UnionType(types=types):
            return " or ".join(_type(part, extra) for part in types if part != mi.NoneType())
        case mi.DictType(value_type=part):
            return f"name: {_type(part)}"
        case mi.ListType(item_type=part) | mi.VarTupleType(item_type=part):
            return f"list of {_type(part)}"
        case mi.LiteralType() | mi.EnumType():
            return ", ".join(f"`{choice}`" for choice in choices(info))
    return wanted_text(info, extra).removeprefix("a ")


def _default(field: mi.Field) -> str:
    if field.required:
        return "needed"
    if field.default is msgspec.NODEFAULT or field.default is None:
        return "-"
    value = getattr(field.default, "value", field.default)
    if isinstance(value, msgspec.Struct):
        return "-"
    return f"`{flow(value)}`" if value not in ([], {}, ()) else "-"
