"""Converts YAML nodes to msgspec structs. It reports all independent problems, such as unknown and
duplicate keys, with line and column.

This module itself walks through the nodes, because `msgspec.convert` stops at the first problem and
knows no lines. The structs, with their bounds and units, are the only description of a file's contents.
"""

from collections.abc import Callable, Hashable, Mapping
from enum import Enum
from functools import cache
from types import MappingProxyType
from typing import Final, NamedTuple, TypeVar, overload

import msgspec
from msgspec import inspect
from msgspec.inspect import (
    DictType,
    ListType,
    Metadata,
    NoneType,
    StructType,
    Type,
    UnionType,
    VarTupleType,
)
from yaml import MappingNode, Node, ScalarNode, SequenceNode

from bridges.yaml.misplaced_keys import bare, glued, is_decimals, misplaced, sections_of
from bridges.yaml.parsing import YamlFile, is_plain
from bridges.yaml.positions import MappingEntry, Spot, is_none, locate
from bridges.yaml.scalar_types import Extra, WrongScalar, leaf, looks, wanted_text
from bridges.yaml.scalars import is_null
from bridges.yaml.spelling import either, nearest, short, unknown

VERBS = ("is", "has", "needs", "must", "says")
"""The first words of problem texts that have no subject. In these texts the key becomes the subject."""

T = TypeVar("T")


@cache
def described(cls: Hashable) -> Type:
    """Return msgspec's description of a type. The description is cached, because making one takes a
    millisecond."""
    return inspect.type_info(cls)


def field_names(struct: type[msgspec.Struct]) -> set[str]:
    """Return the keys of a struct, as they are spelt in a YAML."""
    return {field.encode_name for field in msgspec.structs.fields(struct)}


class Broken(Enum):
    """The type of BROKEN, which stands for an invalid value."""

    BROKEN = "broken"


BROKEN: Final = Broken.BROKEN

_LISTS = (ListType, VarTupleType)
_MAPPINGS = (DictType, StructType)


def _node_of(wanted: Type) -> type[Node]:
    wanted = bare(wanted)
    if isinstance(wanted, _LISTS):
        return SequenceNode
    return MappingNode if isinstance(wanted, _MAPPINGS) else ScalarNode


class _Around(NamedTuple):
    """A section of the YAML, while it is read.

    `fields`: the section's keys and the form of their values (see `known`). `column`: the column at
    which the keys begin.
    """

    spot: Spot
    fields: Mapping[str, str | None]
    column: int


Check = Callable[[str, Spot], str | None]
"""A function that checks a text, and gets its place too. It returns the text of a problem, or None if
there is no problem."""


class Values:
    """Converts one file's nodes to values. It notes problems of the file.

    - `checks`: maps a name to a check, for texts whose type has `Meta(extra={"check": name})`. Only
      this check accepts or refuses such a text.
    - `owner(key)`: returns a text about an unknown key of the outermost struct. The text says where the
      key belongs; "" if this is unknown.
    - `structs`: every struct made so far, with its path
    """

    def __init__(
        self,
        page: YamlFile,
        checks: Mapping[str, Check] | None = None,
        owner: Callable[[str], str] = lambda key: "",
    ) -> None:
        self._page = page
        self._checks = checks or {}
        self._owner = owner
        self._around: list[_Around] = []
        self.structs: list[tuple[tuple[str, ...], object]] = []

    @overload
    def make(self, cls: type[T], spot: Spot, besides: tuple[str, ...] = ()) -> T | Broken: ...

    @overload
    def make(self, cls: object, spot: Spot, besides: tuple[str, ...] = ()) -> object: ...

    def make(self, cls: object, spot: Spot, besides: tuple[str, ...] = ()) -> object:
        """Convert a node to a `cls`. Return BROKEN if this fails.

        `cls`: a type, or msgspec's description of a type. `besides`: keys that are allowed too, because
        the caller reads them itself.
        """
        wanted = cls if isinstance(cls, Type) else described(cls)
        if isinstance(wanted, StructType):
            return self._struct(wanted, spot, besides)
        return self._value(wanted, spot)

    def entries(self, spot: Spot) -> list[MappingEntry]:
        """Return a mapping's valid entries. Note each duplicate key, each merge key and each key that
        is not text."""
        if not isinstance(spot.node, MappingNode):
            self._mismatch(spot, "a mapping (key: value)")
            return []
        seen: dict[str, MappingEntry] = {}
        for key, value in spot.node.value:
            if not isinstance(key, ScalarNode):
                self._page.note(key, f"a key must be text, but this is {looks(key)}")
            elif key.value == "<<" and is_plain(key):
                self._page.note(key, "merge keys ('<<') are not accepted: write the keys out")
            elif key.value in seen:
                self._double(key, seen[key.value].key)
            else:
                seen[key.value] = MappingEntry(key.value, key, value)
        return list(seen.values())

    def known(
        self,
        entries: list[MappingEntry],
        spot: Spot,
        fields: Mapping[str, str | None],
        elsewhere: Mapping[str, str] | None = None,
        refused: Mapping[str, str] = MappingProxyType({}),
    ) -> dict[str, MappingEntry]:
        """Return the entries whose keys are in `fields`, and note the other entries.

        - `fields`: maps a key to a description of its value, or to None for an optional key
        - `elsewhere`: maps a key to the section to which it belongs
        - `refused`: maps a key to the reason why it is not allowed here

        If an unknown key resembles a missing key, only the unknown key is reported. So one typing
        mistake is one problem.
        """
        found = {e.name: e for e in entries}
        near = {nearest(name, fields) for name in found if name not in fields}
        cut: set[str] = set()
        for before, entry in zip([None, *entries], entries, strict=False):
            if entry.name not in fields:
                if before and is_decimals(entry, before):
                    cut.add(before.name)  # its decimals became this key, so its value is wrong
                self._page.note(
                    entry.key,
                    refused.get(entry.name)
                    or misplaced(entry, before, elsewhere or {})
                    or self._too_deep(entry)
                    or self._owned(entry, spot, fields)
                    or unknown("key", entry.name, fields),
                )
        for name, wanted in fields.items():
            if isinstance(spot.node, MappingNode) and wanted and name not in {*found, *near}:
                self._page.note(spot.at, _missing(spot, name, wanted))
        return {name: entry for name, entry in found.items() if name in fields and name not in cut}

    def _owned(self, entry: MappingEntry, spot: Spot, fields: Mapping[str, str | None]) -> str:
        """Return the text of `owner` about an unknown key. Return "" inside a section, and for a key
        that resembles a key of the struct."""
        if spot.path or nearest(entry.name, fields):
            return ""
        return self._owner(entry.name)

    def _too_deep(self, entry: MappingEntry) -> str:
        """Describe a key that belongs to one of the outer sections; "" for any other key. Delete the
        problem that the outer section lacks this key."""
        for around in reversed(self._around):
            if entry.name in around.fields:
                missing = _missing(around.spot, entry.name, around.fields[entry.name] or "")
                self._page.problems[:] = [p for p in self._page.problems if p.text != missing]
                return (
                    f"'{short(entry.name)}' is indented too far: it belongs to {around.spot.label},"
                    f" so write {around.column} spaces before it"
                )
        return ""

    def _value(self, wanted: Type, spot: Spot, extra: Extra | None = None) -> object:
        if isinstance(wanted, Metadata):
            return self._value(wanted.type, spot, wanted.extra)
        if isinstance(wanted, UnionType):
            return self._union(wanted, spot, extra)
        if isinstance(wanted, StructType):
            return self._struct(wanted, spot, ())
        if isinstance(wanted, DictType):
            return self._dict(wanted, spot)
        if isinstance(wanted, _LISTS):
            return self._list(wanted, spot)
        return self._leaf([wanted], spot, extra or {})

    def _union(self, wanted: UnionType, spot: Spot, extra: Extra | None) -> object:
        """Convert the node to the member of the union that fits the node's form (scalar, list or
        mapping). If several scalar types fit, the first one that accepts the scalar is used."""
        members = [t for t in wanted.types if not isinstance(t, NoneType)]
        if len(members) < len(wanted.types) and is_none(spot.node):
            return None
        fitting = [t for t in members if isinstance(spot.node, _node_of(t))]
        if not fitting:
            structs = [t for t in members if isinstance(t, StructType)]
            keys = [f.encode_name for t in structs for f in t.fields if f.required]
            shown = f": {{{', '.join(f'{key}: …' for key in keys)}}}" if keys else ""
            self._mismatch(spot, wanted_text(wanted) + shown)
            return BROKEN
        if len(fitting) == 1:
            return self._value(fitting[0], spot, extra)
        return self._leaf(fitting, spot, extra or {})

    def _leaf(self, types: list[Type], spot: Spot, extra: Extra) -> object:
        if not isinstance(spot.node, ScalarNode):
            self._mismatch(spot, either(wanted_text(t, extra) for t in types))
            return BROKEN
        try:
            value = leaf(types, spot.node, extra)
        except WrongScalar as wrong:
            empty = is_plain(spot.node) and not spot.node.value
            self._page.note(spot.at if empty else spot.node, f"{spot.label} {wrong}")
            return BROKEN
        check = self._checks.get(extra.get("check", ""))
        reason = check(spot.node.value, spot) if check else None
        if reason is None:
            return value
        self._page.note(spot.node, reason)
        return BROKEN

    def _list(self, wanted: ListType | VarTupleType, spot: Spot) -> object:
        if not isinstance(spot.node, SequenceNode):
            self._mismatch(spot, wanted_text(wanted))
            return BROKEN
        values = [
            self._value(
                wanted.item_type,
                Spot(node, node, f"item {i + 1} of {spot.label}", (*spot.path, str(i))),
            )
            for i, node in enumerate(spot.node.value)
        ]
        if self._miscounted(wanted, spot, len(values)) or BROKEN in values:
            return BROKEN
        return values if isinstance(wanted, ListType) else tuple(values)

    def _dict(self, wanted: DictType, spot: Spot) -> object:
        made: dict[object, tuple[object, Node]] = {}
        before = len(self._page.problems)
        entries = self.entries(spot)
        broken = len(self._page.problems) > before
        for entry in entries:
            if slip := glued(entry):
                self._page.note(entry.key, slip)
                broken = True
                continue
            key = self._value(wanted.key_type, Spot(entry.key, entry.key, "this key"))
            value = self._value(wanted.value_type, entry.spot(spot.path))
            if key is not BROKEN and key in made:
                self._double(entry.key, made[key][1])
                broken = True
            made[key] = (value, entry.key)
            broken = broken or key is BROKEN or value is BROKEN
        if broken or self._miscounted(wanted, spot, len(made)):
            return BROKEN
        return {key: value for key, (value, _) in made.items()}

    def _struct(self, wanted: StructType, spot: Spot, besides: tuple[str, ...]) -> object:
        fields = {f.encode_name: f for f in wanted.fields}
        known = {n: wanted_text(f.type) if f.required else None for n, f in fields.items()}
        before = len(self._page.problems)
        fitting = {**dict.fromkeys(besides), **known}
        entries = self.entries(spot)
        refused = getattr(wanted.cls, "refused", {})
        found = self.known(entries, spot, fitting, sections_of(wanted), refused)
        broken = len(self._page.problems) > before
        self._around.append(
            _Around(spot, known, entries[0].key.start_mark.column if entries else 0)
        )
        values = {
            fields[name].name: self._value(fields[name].type, entry.spot(spot.path))
            for name, entry in found.items()
            if name in fields
        }
        self._around.pop()
        if broken or BROKEN in values.values():
            return BROKEN
        made = wanted.cls(**values)
        self.structs.append((spot.path, made))
        self._ask(made, spot)
        return made

    def _ask(self, made: object, spot: Spot) -> None:
        problems = getattr(made, "problems", None)
        for path, text in problems() if problems else ():
            entry = locate(spot, path)
            self._page.note(entry.where(), _of_subject(path, entry.name, spot.label, text))

    def _miscounted(self, wanted: ListType | VarTupleType | DictType, spot: Spot, n: int) -> bool:
        least, most = wanted.min_length or 0, wanted.max_length
        if n < least:
            self._page.note(spot.at, f"{spot.label} has {n} entries: at least {least} are needed")
        elif most is not None and n > most:
            self._page.note(spot.at, f"{spot.label} has {n} entries: at most {most} are allowed")
        else:
            return False
        return True

    def _double(self, key: Node, first: Node) -> None:
        name = short(key.value)
        line = first.start_mark.line + 1
        self._page.note(key, f"the key '{name}' is already on line {line}: delete one of the two")

    def _mismatch(self, spot: Spot, wanted: str) -> None:
        where = MappingEntry("", spot.at, spot.node).where()
        if isinstance(spot.node, ScalarNode) and is_plain(spot.node) and is_null(spot.node.value):
            self._page.note(where, f"{spot.label} has no value: write {wanted}")
        else:
            self._page.note(where, f"{spot.label} is {looks(spot.node)}: write {wanted}")


def _missing(spot: Spot, name: str, wanted: str) -> str:
    return f"{spot.label} needs '{name}': {wanted}"


def _of_subject(path: tuple[str, ...], name: str, label: str, text: str) -> str:
    """Put the key before the text as its subject. If the text names the key already, return it
    unchanged."""
    if text.partition(" ")[0] in VERBS:
        return f"'{short(name)}' {text}" if name else f"{label} {text}"
    key = name
    if name.isdecimal():  # an item of a list, or a number in a table of codes
        key = next((part for part in reversed(path) if not part.isdecimal()), "")
    if (key or label) in text:
        return text
    return f"'{short(key)}': {text}" if key else f"{label}: {text}"
