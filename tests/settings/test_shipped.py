"""Every shipped YAML is correct. If a test makes a mistake in a shipped YAML, the loader names the
place of the mistake."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import msgspec
import pytest
import yaml
from msgspec.inspect import (
    BoolType,
    DictType,
    EnumType,
    FloatType,
    IntType,
    ListType,
    LiteralType,
    Metadata,
    NoneType,
    StrType,
    StructType,
    Type,
    UnionType,
    VarTupleType,
    type_info,
)
from yaml import CollectionNode, MappingNode, Node, ScalarNode, SequenceNode

from bridges.kinds import kind_names
from bridges.kinds.shared.rmf_section import Rmf
from bridges.settings import names as named
from bridges.settings.load import load
from bridges.settings.sheets.findings import findings
from bridges.settings.sheets.text import lines
from tests.depth import depth, part
from tests.settings.reading import problems_of
from workbench.commissioning.examples import device_yamls

T = TypeVar("T")

CONFIG = Path(__file__).parents[2] / "config"
FILES = device_yamls()
NAMES = ['"17"', "x", ""]  # each may be valid as a name; or the loader reports another place
SORTS = {"accept_unsafe": "signal", "setpoints": "setpoint", "values": "value", "when": "value"}
"""For these sections: the word by which the loader calls an unknown key in its messages. In all other
sections the word is `key`."""
TRAPS = ["017", "1:30", "no", "1e3", "~", "1.0", "17", "[]", *NAMES]


@dataclass(frozen=True)
class Place:
    """An entry of a mapping in a file's text. `parent` is the key of the whole mapping."""

    key: ScalarNode
    value: Node
    parent: Node
    flow: bool

    @property
    def end(self) -> int:
        """Return where the entry's text ends. PyYAML's own end mark of a block value also covers the
        blank lines and comments that follow."""
        node = self.value
        while isinstance(node, CollectionNode) and not node.flow_style and node.value:
            last = node.value[-1]
            node = last[1] if isinstance(last, tuple) else last
        return int(node.end_mark.index)


def composed(text: str) -> MappingNode:
    """Return the top mapping of a file as YAML nodes. Each node knows its line and column."""
    root = yaml.compose(text)
    assert isinstance(root, MappingNode)
    return root


def places(node: Node, parent: Node) -> Iterator[Place]:
    """Yield every entry of every mapping."""
    if isinstance(node, SequenceNode):
        for item in node.value:
            yield from places(item, item)
    if isinstance(node, MappingNode):
        for key, value in node.value:
            yield Place(key, value, parent, bool(node.flow_style))
            yield from places(value, key)


@dataclass(frozen=True)
class Leaf:
    """A scalar value with the key of its entry. `parent` is the key of the whole mapping."""

    node: ScalarNode
    key: Node
    parent: Node


def scalars(node: Node, key: Node, parent: Node) -> Iterator[Leaf]:
    """Yield every scalar value except keys."""
    if isinstance(node, ScalarNode):
        yield Leaf(node, key, parent)
    elif isinstance(node, SequenceNode):
        for item in node.value:
            yield from scalars(item, item, key)
    else:
        for name, value in node.value:
            yield from scalars(value, name, key)


def at(node: Node) -> str:
    return f"{node.start_mark.line + 1}:{node.start_mark.column + 1}"


def spots(problems: list[str]) -> list[str]:
    return [":".join(p.split(":", 2)[:2]) for p in problems]


def own_names(config: Path) -> set[str]:
    """Return the names in a file that a site can choose: buses, devices, and names in the kind's
    section."""
    loaded = load(config)
    in_buses = (name for bus in loaded.buses.values() for name in names_in(bus))
    return {*loaded.buses, *loaded.devices, *names_in(loaded.section), *in_buses}


def names_in(value: object) -> set[str]:
    """Return the keys of every mapping below a struct."""
    if isinstance(value, dict):
        return {*value, *(name for inner in value.values() for name in names_in(inner))}
    if not isinstance(value, msgspec.Struct):
        return set()
    return {name for key in value.__struct_fields__ for name in names_in(getattr(value, key))}


def some(of: Sequence[T], config: Path, turn: int) -> Sequence[T]:
    """Return every twelfth item. The first item depends on the file and on `turn`, so that different
    tests take different items."""
    return part(of, 12, (FILES.index(config) + 4 * turn) % 12)


def is_own(name: str, names: set[str]) -> bool:
    """Return whether the author of the YAML chose this key freely. Names of floors (`L1`) and codes
    (`1`) count as chosen freely."""
    return name in names or name[0].isupper() or name[0].isdigit()


@pytest.fixture(params=FILES, ids=lambda path: str(path.stem))
def config(request: pytest.FixtureRequest) -> Path:
    path: Path = request.param
    return path


def test_shipped_files_exist() -> None:
    assert len(FILES) >= 3


def test_a_shipped_file_is_correct_and_has_wires_or_addresses(config: Path) -> None:
    loaded = load(config)
    found = findings(loaded)
    rows = [row for p in found.parts for t in p.tables if t.title == "settings" for row in t.rows]
    assert [setting for setting, value, _ in rows if not value] == [], "a setting without a value"
    shown = lines(found, 130)
    assert len(shown) > 4
    assert max(map(len, shown)) <= 130
    assert loaded.text == config.read_bytes()


def test_devices_of_shipped_files_equal_the_structs_of_msgspec(config: Path) -> None:
    for settings in load(config).devices.values():
        raw = msgspec.to_builtins(settings, str_keys=True)
        assert msgspec.convert(raw, type(settings), strict=False) == settings


def leaves(wanted: Type) -> Iterator[Type]:
    """Yield every type in a struct, down to strings and numbers."""
    if isinstance(wanted, Metadata):
        yield from leaves(wanted.type)
    elif isinstance(wanted, StructType):
        for a_field in wanted.fields:
            yield from leaves(a_field.type)
    elif isinstance(wanted, UnionType):
        assert sum(isinstance(t, StructType) for t in wanted.types) <= 1, wanted
        for member in wanted.types:
            yield from leaves(member)
    elif isinstance(wanted, ListType | VarTupleType):
        yield from leaves(wanted.item_type)
    elif isinstance(wanted, DictType):
        yield from leaves(wanted.key_type)
        yield from leaves(wanted.value_type)
    else:
        yield wanted


def test_every_field_of_every_driver_and_bus_has_a_readable_type() -> None:
    structs = [Rmf, *(named.bus_called(name).settings for name in named.bus_types())]
    for kind in kind_names():
        structs += [named.driver_called(kind, name).settings for name in named.driver_names(kind)]
    sorts = {type(leaf) for struct in structs for leaf in leaves(type_info(struct))}
    assert sorts <= {BoolType, EnumType, FloatType, IntType, LiteralType, NoneType, StrType}
    assert len(structs) >= 7


ANSWERS = ("values", "between_floors", "open", "closed", "moving", "stopped", "up", "down")
"""Keys whose values in an HTTP answer may be anything."""
NAMED_FREELY = ("temperatures",)
"""Sections whose keys the site can choose."""


def test_every_misspelt_key_is_found_at_its_place(config: Path, file: Path) -> None:
    text = config.read_text()
    root = composed(text)
    names = own_names(config)
    for place in some(list(places(root, root)), config, 0):
        section = str(place.parent.value)
        if is_own(place.key.value, names) or section in NAMED_FREELY:
            continue
        if section == "when" and "driver: http" in text:
            continue  # an HTTP answer may have any field
        start = place.key.start_mark.index
        wrong = text[:start] + "z" + text[start:]
        found = problems_of(file, wrong)
        sort = SORTS.get(section, "key")
        line = place.key.start_mark.line + 1
        where = f"{line}:" if section == "setpoints" else f"{at(place.key)}:"
        said = f": unknown {sort} 'z{place.key.value}': "
        assert [p for p in found if p.startswith(where) and said in p], (place.key, found)


def test_every_repeated_key_is_found_at_its_place(config: Path, file: Path) -> None:
    text = config.read_text()
    root = composed(text)
    for place in some(list(places(root, root)), config, 1):
        start = place.key.start_mark.index
        gap = ", " if place.flow else "\n" + " " * place.key.start_mark.column
        added = text[start : place.end] + gap
        found = problems_of(file, text[:start] + added + text[start:])
        before = text[:start] + added
        second = f"{before.count(chr(10)) + 1}:{len(before) - before.rfind(chr(10))}"
        line = place.key.start_mark.line + 1
        assert found == [
            f"{second}: the key '{place.key.value}' is already on line {line}: "
            "delete one of the two"
        ]


def test_every_removed_key_leaves_a_correct_file_or_is_reported(config: Path, file: Path) -> None:
    text = config.read_text()
    root = composed(text)
    every = list(places(root, root))
    needed = [place for place in every if place.key.value in ("kind", "driver", "buses", "type")]
    missed = set()
    for place in [*needed, *some(every, config, 2)]:
        start, end = place.key.start_mark.index, place.end
        while place.flow and text[end] in ", ":
            end += 1
        rest = text[:start] + text[end:]
        found = problems_of(file, rest)
        if f"needs '{place.key.value}'" in " ".join(found):
            assert at(composed(rest) if place.parent is root else place.parent) in spots(found)
            missed.add(place.key.value)
    assert missed >= {place.key.value for place in needed}


def is_blamed(leaf: Leaf, trap: str, found: list[str]) -> bool:
    """Return whether one of these problems leads a reader to this value.

    A missing or changed number can be valid alone, but conflict with another value. Then the problem
    points at the mapping with the value, or names the value's key.
    """
    if at(leaf.node) in spots(found):
        return True
    is_number = trap in ("17", "1.0") and leaf.node.tag.endswith((":float", ":int"))
    if trap != "~" and not is_number:
        return False
    if at(leaf.parent) in spots(found):
        return True
    name = str(leaf.key.value)
    return any(re.search(rf"(?<!\w){re.escape(name)}(?!\w)", p.partition(": ")[2]) for p in found)


def test_every_tricky_value_is_found_at_its_place(config: Path, file: Path) -> None:
    text = config.read_text()
    root = composed(text)
    accepted, values = 0, list(scalars(root, root, root))
    first = FILES.index(config)
    for n, leaf in part(list(enumerate(values)), 2, first % 2):
        node = leaf.node
        for trap in part(TRAPS, len(TRAPS), (first + n) % len(TRAPS)):
            found = problems_of(
                file, f"{text[: node.start_mark.index]}{trap}{text[node.end_mark.index :]}"
            )
            accepted += not found
            if (
                found and trap == "[]"
            ):  # reported at the key, or at the key of the mapping that lacks an item
                assert at(node).partition(":")[0] in {s.partition(":")[0] for s in spots(found)}
            elif found and trap not in NAMES:
                assert is_blamed(leaf, trap, found), (trap, found)
    coordinates = sum(leaf.node.tag.endswith(":float") for leaf in values)
    answers = sum(str(leaf.parent.value) in ANSWERS for leaf in values)
    assert accepted < 40 + 3 * coordinates + len(TRAPS) * answers, accepted


def test_every_shipped_file_cut_at_any_place_is_accepted_or_refused_there(
    config: Path, file: Path
) -> None:
    text = config.read_bytes()
    for end in range(0, len(text), depth(97, 23)):
        problems_of(file, text[:end])
