"""Places of values in a YAML file, and the places (line and column) at which errors about these values
are reported."""

from collections.abc import Iterable

from msgspec import Struct
from yaml import MappingNode, Node, ScalarNode, SequenceNode

from bridges.yaml.parsing import is_plain
from bridges.yaml.scalars import is_null_word
from bridges.yaml.spelling import short


class Spot(Struct, frozen=True):
    """A node that will become a value.

    - `at`: the value's key, at which errors about the whole value are reported
    - `label`: the value's name in error texts
    - `path`: the value's path below the top struct
    """

    node: Node
    at: Node
    label: str
    path: tuple[str, ...] = ()


class MappingEntry(Struct, frozen=True):
    """One `key: value` of a mapping."""

    name: str
    key: Node
    value: Node

    def spot(self, path: tuple[str, ...] = ()) -> Spot:
        """Return the Spot of the value. `path`: the path of the mapping."""
        return Spot(self.value, self.key, f"'{short(self.name)}'", (*path, self.name))

    def where(self) -> Node:
        """Return the node at which errors about the value are reported. This is the value itself for a
        scalar, and the key for any other value."""
        node = self.value
        if isinstance(node, ScalarNode) and (node.value or not is_plain(node)):
            return node
        return self.key


def below(node: Node, part: str) -> MappingEntry | None:
    """Return the entry of a mapping, or the item of a list, that has the name `part`."""
    if isinstance(node, MappingNode):
        for key, value in node.value:
            if isinstance(key, ScalarNode) and key.value == part:
                return MappingEntry(part, key, value)
    if isinstance(node, SequenceNode) and part.isdecimal() and int(part) < len(node.value):
        return MappingEntry(part, node.value[int(part)], node.value[int(part)])
    return None


def locate(spot: Spot, path: Iterable[object]) -> MappingEntry:
    """Return the entry at `path` below a value. If that entry does not exist, return its nearest
    existing parent."""
    found = MappingEntry("", spot.at, spot.node)
    for part in path:
        entry = below(found.value, str(part))
        if entry is None:
            break
        found = entry
    return found


def is_none(node: Node) -> bool:
    """Return whether the value is `null` or `~`. An empty value does not count, because somebody has
    probably forgotten it."""
    return isinstance(node, ScalarNode) and is_plain(node) and is_null_word(node.value)
