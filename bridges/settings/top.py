"""The top of a device YAML: the top keys of each kind, and the values that are one word (`kind`,
`driver`)."""

from typing import Final

from msgspec.inspect import LiteralType
from msgspec.structs import fields

from bridges.kinds import kind_called, kind_names
from bridges.kinds.shared.graph_kind import AnyKind, GraphKind
from bridges.kinds.shared.recording_section import RecordingSettings
from bridges.kinds.shared.rmf_section import Rmf
from bridges.settings import names as named
from bridges.yaml.positions import MappingEntry
from bridges.yaml.spelling import either
from bridges.yaml.values import BROKEN, Values, field_names
from drivers.driver_type import AnyDriver

MAPPING: Final = "a mapping (key: value)"


def top_keys(kind: AnyKind | None) -> dict[str, str | None]:
    """Return a mapping from each top key to a description of its value, or to None for an optional key.
    `kind`: the file's kind, or None if it is unknown."""
    first = {"kind": either(kind_names())}
    if isinstance(kind, GraphKind):
        return {**first, "rmf": None, "recording": None, kind.devices_key: None}
    if kind is None:
        all_kinds = map(kind_called, kind_names())
        sections = dict[str, str | None]()
        for found in all_kinds:
            sections |= _sections(found)
        return {
            **first,
            "driver": "a driver of that kind",
            "rmf": None,
            "recording": None,
            "buses": MAPPING,
            **sections,
        }
    driver = either(named.driver_names(kind.name))
    shared = {"rmf": None, "recording": None, "buses": MAPPING}
    section = {kind.section[0]: MAPPING} if kind.section else {}
    return {**first, "driver": driver, **shared, **section, kind.devices_key: MAPPING}


def _sections(kind: AnyKind) -> dict[str, None]:
    """Return the keys of a kind's own sections."""
    shared = [] if isinstance(kind, GraphKind) or not kind.section else [kind.section[0]]
    return dict.fromkeys([*shared, kind.devices_key])


def word(values: Values, entry: MappingEntry | None, words: list[str]) -> str | None:
    """Return the word that is the entry's value. Return None if the entry is missing or its word is not
    in `words`."""
    if entry is None:
        return None
    found = values.make(LiteralType(tuple(words)), entry.spot())
    return None if found is BROKEN else str(found)


def keys_below(kind: AnyKind | None, driver: AnyDriver | None) -> dict[str, str]:
    """Return a mapping from a key to its section, for each key that does not belong at the top of the
    file."""
    below_top = {field.encode_name: "rmf" for field in fields(Rmf)}
    below_top |= {field.encode_name: "recording" for field in fields(RecordingSettings)}
    if isinstance(kind, GraphKind):
        below_top |= {field.encode_name: kind.devices_key for field in fields(kind.settings)}
    elif kind and driver:
        if kind.section:
            key, struct = kind.section
            below_top |= {field.encode_name: key for field in fields(struct)}
        place = f"{kind.devices_key}: <name>"
        below_top |= {field.encode_name: place for field in fields(driver.settings)}
    return below_top


def owner(kind: str, key: str) -> str:
    """Return a text that names the other drivers of the kind with this key; "" if no driver has the
    key."""
    found = [
        name
        for name in named.driver_names(kind)
        if key in field_names(named.driver_called(kind, name).settings)
    ]
    return f"unknown key '{key}': it is a key of driver {either(found)}" if found else ""
