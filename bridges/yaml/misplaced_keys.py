"""Finds keys in the wrong place: below another section, with a wrong indent, or without a space before
their value."""

from collections.abc import Mapping

from msgspec.inspect import Metadata, StructType, Type, UnionType
from yaml import Node, ScalarNode

from bridges.yaml.parsing import is_plain
from bridges.yaml.positions import MappingEntry
from bridges.yaml.spelling import short


def bare(wanted: Type) -> Type:
    """Return the type that msgspec describes, without its bounds."""
    return wanted.type if isinstance(wanted, Metadata) else wanted


def sections_of(wanted: StructType) -> dict[str, str]:
    """Return a mapping from each key in the sections of a struct to the name of its section. A key of
    the struct itself has the section ""."""
    own = {field.encode_name for field in wanted.fields}
    types = [(f.encode_name, bare(f.type)) for f in wanted.fields]
    inner = [
        (name, part)
        for name, type_ in types
        for part in (type_.types if isinstance(type_, UnionType) else (type_,))
        if isinstance(part, StructType)
    ]
    return {f.encode_name: name for name, part in inner for f in part.fields} | dict.fromkeys(
        own, ""
    )


def misplaced(
    entry: MappingEntry, before: MappingEntry | None, elsewhere: Mapping[str, str]
) -> str:
    """Describe the typing mistake that explains an unknown key; "" if none is found."""
    empty = before is not None and _is_empty(before.value)
    if before is not None and empty and not _is_empty(entry.value):
        return (
            f"'{short(entry.name)}' stands beside '{before.name}', which is empty: indent"
            f" '{short(entry.name)}'"
        )
    if before is not None and is_decimals(entry, before):
        return f"a comma inside a number: write {before.value.value}.{entry.name}"
    if slip := glued(entry):
        return slip
    if section := elsewhere.get(entry.name):
        return f"'{short(entry.name)}' does not belong here: write it below '{section}'"
    return ""


def is_decimals(entry: MappingEntry, before: MappingEntry) -> bool:
    """Return whether this key is the decimals of the number before it, as in `{scan_s: 0,5}`."""
    whole = isinstance(before.value, ScalarNode) and before.value.value.isdecimal()
    return whole and entry.name.isdecimal() and _is_empty(entry.value)


def glued(entry: MappingEntry) -> str:
    """Describe a key without a space before its value, as in `active:high`; "" for any other key."""
    key, colon, value = entry.name.partition(":")
    if not (colon and value and _is_empty(entry.value)):
        return ""
    return f"no space after the colon: write {short(key)}: {short(value)}"


def _is_empty(node: Node) -> bool:
    return isinstance(node, ScalarNode) and is_plain(node) and not node.value
