"""The JSON Schema of a device YAML, for editors.

Keys, types, bounds, units, defaults and meanings come from the structs' fields. Purposes come from the
structs' docstrings.
"""

import inspect
from collections.abc import Iterator
from typing import Any

import msgspec

from bridges import __version__
from bridges.kinds import kind_called, kind_names
from bridges.kinds.shared.graph_kind import AnyGraphKind, GraphKind
from bridges.kinds.shared.recording_section import RecordingSettings
from bridges.kinds.shared.rmf_section import Rmf
from bridges.settings import names as named
from drivers.driver_type import AnyDriver

Schema = dict[str, object]
"""A JSON Schema."""

FILE: dict[str, str] = {
    "kind": "the kind of devices in the file: lifts, doors, chargers, or a node without hardware.",
    "driver": "the driver of the devices; a device may name another driver.",
    "rmf": "the connection to Open-RMF.",
    "recording": "how the daemon records its work.",
    "buses": "name -> the settings of a bus, which depend on the bus's `type`.",
    "type": "the type of a bus, which decides the other keys of the bus.",
}
"""Meanings of the keys that no struct has."""


class Shape(msgspec.Struct, frozen=True):
    """One `kind:` with one `driver:`, and the sections of a file with this kind and driver."""

    kind: str
    devices_key: str
    driver: str
    type: AnyDriver


def shapes() -> Iterator[Shape]:
    """Return every combination of kind and driver."""
    for kind in kind_names():
        key = kind_called(kind).devices_key
        for driver in named.driver_names(kind):
            yield Shape(kind, key, driver, named.driver_called(kind, driver))


def shared_sections() -> Iterator[tuple[str, str, type]]:
    """Yield each section that all devices of a kind share, as the kind, the section's key and its
    struct."""
    for name in kind_names():
        kind = kind_called(name)
        if not isinstance(kind, GraphKind) and kind.section:
            yield name, *kind.section


def purpose(struct: type) -> str:
    """Return the purpose of a section. The purpose is the struct's docstring on one line."""
    return " ".join(inspect.cleandoc(struct.__doc__ or "").split())


def graph_kinds() -> list[AnyGraphKind]:
    """Return every kind without devices."""
    kinds = (kind_called(name) for name in kind_names())
    return [kind for kind in kinds if isinstance(kind, GraphKind)]


def schema() -> Schema:
    """Return the JSON Schema (2020-12) of a device YAML, for editors."""
    buses = {name: named.bus_called(name).settings for name in named.bus_types()}
    graph = [kind.settings for kind in graph_kinds()]
    types: list[type] = [
        Rmf,
        RecordingSettings,
        *buses.values(),
        *(shape.type.settings for shape in shapes()),
        *(struct for _, _, struct in shared_sections()),
        *graph,
    ]
    refs, components = msgspec.json.schema_components(types, ref_template="#/$defs/{name}")
    for component in components.values():
        _for_editors(component)
    by_type = dict(zip(types, refs, strict=True))
    for bus in buses.values():
        _allow_type(components, by_type[bus])
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:rmf-bridges:device:{__version__}",
        "title": "rmf-bridges device",
        "oneOf": [
            *(_file(shape, buses, by_type) for shape in shapes()),
            *(_graph_file(kind, by_type) for kind in graph_kinds()),
        ],
        "$defs": components,
    }


def _for_editors(component: dict[str, Any]) -> None:
    """Remove titles, and give each nullable key its own description.

    Otherwise an editor would show the titles, which are class names. At a nullable key, an editor would
    show the struct's description.
    """
    component.pop("title")
    for told in component.get("properties", {}).values():
        for part in told.get("anyOf", ()):
            if "$ref" in part:
                part["description"] = told["description"]


def _allow_type(components: dict[str, dict[str, dict[str, Schema]]], ref: Schema) -> None:
    """Add `type:` to the schema of a bus. No struct has the field `type`, because the program reads
    this key before the program chooses the struct."""
    component = components[str(ref["$ref"]).rsplit("/", 1)[1]]
    component["properties"].setdefault("type", {"type": "string"})
    component["properties"]["type"]["description"] = FILE["type"]


def _key(name: str, schema: Schema) -> Schema:
    """Return the schema of a key that no struct has."""
    return {name: {"description": FILE[name], **schema}}


def _file(shape: Shape, buses: dict[str, type], by_type: dict[type, Schema]) -> Schema:
    """Return the schema of a file with this driver. A device may name another driver of the same
    kind."""
    of_kind = [other for other in shapes() if other.kind == shape.kind]
    kinds_of_bus = [
        {"allOf": [by_type[buses[name]], {"properties": _key("type", {"const": name})}]}
        for name in buses
        if any(name in other.type.buses for other in of_kind)
    ]
    devices = [
        {"allOf": [by_type[other.type.settings], _named_by_device(other, shape)]}
        for other in of_kind
    ]
    shared = {
        key: {"description": purpose(struct), **by_type[struct]}
        for kind, key, struct in shared_sections()
        if kind == shape.kind
    }
    return {
        "type": "object",
        "additionalProperties": False,
        "required": ["kind", "driver", "buses", *shared, shape.devices_key],
        "properties": {
            **_key("kind", {"const": shape.kind}),
            **_key("driver", {"const": shape.driver}),
            **_key("rmf", by_type[Rmf]),
            **_key("recording", by_type[RecordingSettings]),
            **_key("buses", {"type": "object", "additionalProperties": {"oneOf": kinds_of_bus}}),
            **shared,
            shape.devices_key: {
                "description": f"a {shape.kind}'s name on RMF's graph -> its settings.",
                "type": "object",
                "additionalProperties": {"oneOf": devices},
            },
        },
    }


def _named_by_device(driver: Shape, of_file: Shape) -> Schema:
    """Require each device to name its driver, except a device that uses the file's driver."""
    required = [] if driver == of_file else ["driver"]
    return {"required": required, "properties": _key("driver", {"const": driver.driver})}


def _graph_file(kind: AnyGraphKind, by_type: dict[type, Schema]) -> Schema:
    return {
        "type": "object",
        "additionalProperties": False,
        "required": ["kind"],
        "properties": {
            **_key("kind", {"const": kind.name}),
            **_key("rmf", by_type[Rmf]),
            **_key("recording", by_type[RecordingSettings]),
            kind.devices_key: {"description": purpose(kind.settings), **by_type[kind.settings]},
        },
    }
