"""Generate the configuration reference from the structs of the YAML, as JSON Schema and as a page.

Keys, types, bounds, units, defaults and meanings come from the structs' fields. Purposes come from the
structs' docstrings.
"""

import inspect
import re
from collections import Counter
from collections.abc import Container, Iterator
from typing import Any

import msgspec
from msgspec import inspect as mi

from bridges import __version__
from bridges.kinds import kind_called, kind_names
from bridges.kinds.shared.graph_kind import AnyGraphKind, GraphKind
from bridges.kinds.shared.recording_section import RecordingSettings
from bridges.kinds.shared.rmf_section import Rmf
from bridges.settings import names as named
from bridges.yaml.scalar_types import Extra, choices, wanted_text
from drivers.driver_type import AnyDriver
from workbench.commissioning.examples import example, field_names, flow

Schema = dict[str, object]
"""A JSON Schema."""

FILE: dict[str, str] = {
    "kind": "the kind of devices in the file: lifts, doors, chargers, or a node without hardware.",
    "driver": "the driver of the devices; a device may name another driver.",
    "rmf": "the way to Open-RMF.",
    "recording": "the recording of the daemon's work.",
    "buses": "name -> a bus, by its `type`.",
    "type": "the sort of a bus, which decides its other keys.",
}
"""Meanings of the keys that no struct has."""


class Shape(msgspec.Struct, frozen=True):
    """One `kind:` with one `driver:`, and the sections of such a file."""

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
    """Yield each section that the devices of a kind share: the kind, the section's key, its struct."""
    for name in kind_names():
        kind = kind_called(name)
        if not isinstance(kind, GraphKind) and kind.section:
            yield name, *kind.section


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

    An editor would show the titles, which are class names. It would also show the struct's description
    at such a key.
    """
    component.pop("title")
    for told in component.get("properties", {}).values():
        for part in told.get("anyOf", ()):
            if "$ref" in part:
                part["description"] = told["description"]


def _allow_type(components: dict[str, dict[str, dict[str, Schema]]], ref: Schema) -> None:
    """Add `type:` to a bus. The program reads this key before the struct, so the key is not a field."""
    component = components[str(ref["$ref"]).rsplit("/", 1)[1]]
    component["properties"].setdefault("type", {"type": "string"})
    component["properties"]["type"]["description"] = FILE["type"]


def _key(name: str, schema: Schema) -> Schema:
    """Return the schema of a key that no struct has."""
    return {name: {"description": FILE[name], **schema}}


def _file(shape: Shape, buses: dict[str, type], by_type: dict[type, Schema]) -> Schema:
    """Return the schema of a file with this driver; a device may name another driver of the kind."""
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
        key: {"description": _purpose(struct), **by_type[struct]}
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
            kind.devices_key: {"description": _purpose(kind.settings), **by_type[kind.settings]},
        },
    }


def page() -> str:
    """Return docs/reference/configuration.md. Structs that several sections share come at the end."""
    rows = [f"| `{key}` | {told} |" for key, told in FILE.items()]
    sections = [
        "# Configuration reference",
        "Generated by `rmf-bridge schema --markdown`: do not edit.",
        "**In an editor.** With a YAML language server (in VS Code the extension `redhat.vscode-yaml`)"
        " an editor completes keys, marks wrong keys and shows the meaning of a key, if the file's"
        " first line names the schema: `# yaml-language-server: $schema=FILE`. `rmf-bridge init` writes"
        " this line. For another file: `rmf-bridge schema > FILE`, again after each upgrade. Only"
        " `check` finds errors across several keys.",
        "A file has these keys, and its devices under the key of their kind (`lifts`, `doors`,"
        " `chargers`, `robots`, `dispensers` or `ingestors`). The file of a supervisor or coordinator"
        " has `kind`, `rmf`, `recording` and one section of its own.",
        "\n".join(["| key | meaning |", "|---|---|", *rows]),
    ]
    headings = _headings(_tops())
    for struct, heading in headings.items():
        if not _is_of_one(heading) and SHARED not in sections:
            sections.append(SHARED)
        sections += _section(struct, headings)
    return "\n\n".join(sections) + "\n"


SHARED = "## Common to several sections"

Headings = dict[type, str]


def _is_of_one(heading: str) -> bool:
    return heading.startswith("## ") or ": `" in heading


def _keys_of(same: list[Shape]) -> str:
    return ", ".join(f"`{shape.devices_key}`" for shape in same)


def _tops() -> Headings:
    """Return a file's sections and their headings. Structs that several sections share come first."""
    found: Headings = {Rmf: "## `rmf`", RecordingSettings: "## `recording`"}
    for name in named.bus_types():
        found[named.bus_called(name).settings] = f"## Bus of `type: {name}`"
    for name, key, struct in shared_sections():
        found[struct] = f"## `{key}` of `kind: {name}`"
    of_driver: dict[type, list[Shape]] = {}
    for shape in shapes():
        of_driver.setdefault(shape.type.settings, []).append(shape)
    last = [
        (s.devices_key, s.type.settings, f"{_keys_of(same)} with `driver: {s.driver}`")
        for same in of_driver.values()
        for s in same
    ] + [
        (k.devices_key, k.settings, f"`{k.devices_key}` of `kind: {k.name}`") for k in graph_kinds()
    ]
    keys: dict[type, list[str]] = {}
    titles: dict[type, list[str]] = {}
    for key, struct, title in last:
        for base in _bases(struct):
            keys.setdefault(base, []).append(f"`{key}`")
            titles.setdefault(base, []).append(title)
    for _, struct, title in last:
        for base in reversed(_bases(struct)):
            if len(keys[base]) > 1 and base not in found:
                every = f"## All {', '.join(dict.fromkeys(keys[base]))}"
                some = f"## {' or '.join(titles[base])}"
                found[base] = some if every in found.values() else every
        found[struct] = f"## {title}"
    return found


def _headings(tops: Headings) -> Headings:
    """Return every struct of the page with its heading, in the page's order."""
    everywhere = [struct for top in tops for struct, _ in _inside(top, ())]
    heirs = Counter(base for struct in {*tops, *everywhere} for base in _bases(struct))
    shared = (base for base, many in heirs.items() if many > 1 and len(_fields(base)) > 1)
    printed = {*tops, *everywhere, *shared}  # a base with a single key is printed by its heirs
    inside = {top: list(_inside(top, printed)) for top in tops}
    tops_of = Counter(struct for found in inside.values() for struct in {s for s, _ in found})
    ordered: Headings = {}
    for top, heading in tops.items():
        ordered[top] = heading
        for struct, path in inside[top]:
            if tops_of[struct] == 1:
                ordered.setdefault(struct, f"#{heading}: `{path}`")
    rest = sorted((_purpose(s).partition(".")[0], s) for s in printed if s not in ordered)
    return ordered | {struct: f"### {title}" for title, struct in rest}


def _inside(top: type, printed: Container[type]) -> Iterator[tuple[type, str]]:
    """Yield the structs inside a struct, each with its relative path. Structs of printed bases are left
    out."""
    todo, seen = [(top, "")], {top}
    while todo:
        struct, path = todo.pop(0)
        for field in _own(struct, printed):
            for inner in parts(field.type):
                if inner not in seen:
                    seen.add(inner)
                    yield inner, f"{path}{field.encode_name}"
                    todo.append((inner, f"{path}{field.encode_name}."))


def _bases(struct: type) -> list[type]:
    """Return the base structs with fields, nearest first."""
    return [base for base in struct.__mro__[1:] if field_names(base)]


def _fields(struct: type) -> tuple[mi.Field, ...]:
    info = mi.type_info(struct)
    assert isinstance(info, mi.StructType)
    return info.fields


def _own(struct: type, printed: Container[type]) -> list[mi.Field]:
    """Return the fields that the nearest printed base lacks or defines otherwise."""
    base = _printed_base(struct, printed)
    known = _fields(base) if base else ()
    return [field for field in _fields(struct) if field not in known]


def _printed_base(struct: type, printed: Container[type]) -> type | None:
    return next((base for base in _bases(struct) if base in printed), None)


def _section(struct: type, headings: Headings) -> Iterator[str]:
    heading, purpose = headings[struct], _purpose(struct)
    yield heading
    if not _is_of_one(heading):
        purpose = purpose.partition(".")[2].strip()
    base = _printed_base(struct, headings)
    besides = f"The keys of {_link(headings[base])} belong here too." if base else ""
    if lead := f"{purpose} {besides}".strip():
        yield lead
    rows = [
        _row(
            f"`{f.encode_name}`",
            _type(f.type, headings),
            _default(f),
            _example(struct, f),
            meaning(struct, f.encode_name),
        )
        for f in _own(struct, headings)
    ]
    if rows:
        heads = ["| key | value | default | example | meaning |", "|---|---|---|---|---|"]
        yield "\n".join([*heads, *rows])


def _row(*cells: str) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _link(heading: str, text: str = "") -> str:
    title = heading.lstrip("# ")
    anchor = re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")
    return f"[{text or title}](#{anchor})"


def _example(struct: type, field: mi.Field) -> str:
    text = example(struct, field)
    return f"`{text}`" if text else "-"


def meaning(struct: type, key: str) -> str:
    """Return the meaning of a key of this struct."""
    (wanted,) = (field.type for field in _fields(struct) if field.encode_name == key)
    told = wanted.extra_json_schema if isinstance(wanted, mi.Metadata) else None
    return str((told or {}).get("description", ""))


def _purpose(struct: type) -> str:
    return " ".join(inspect.cleandoc(struct.__doc__ or "").split())


def parts(info: mi.Type) -> list[type]:
    """Return the structs inside a field's value."""
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


def _type(info: mi.Type, headings: Headings, extra: Extra | None = None) -> str:
    match info:
        case mi.Metadata(type=part, extra=more):
            return _type(part, headings, more)
        case mi.StructType(cls=cls):
            return _link(headings[cls], "a mapping")
        case mi.UnionType(types=types):
            some = (part for part in types if part != mi.NoneType())
            return " or ".join(_type(part, headings, extra) for part in some)
        case mi.DictType(value_type=part):
            return f"name: {_type(part, headings)}"
        case mi.ListType(item_type=part) | mi.VarTupleType(item_type=part):
            return f"list of {_type(part, headings)}"
        case mi.LiteralType() | mi.EnumType():
            return ", ".join(f"`{choice}`" for choice in choices(info))
    return wanted_text(info, extra).removeprefix("a ")


def _default(field: mi.Field) -> str:
    if field.required:
        return "required"
    if field.default is msgspec.NODEFAULT or field.default is None:
        return "-"
    value = getattr(field.default, "value", field.default)
    if isinstance(value, msgspec.Struct):
        return "-"
    return f"`{flow(value)}`" if value not in ([], {}, ()) else "-"
