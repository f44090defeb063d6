"""Keys that had another name in an earlier version. One table tells how to read old keys, how to warn
about them, and how to rewrite them.

Suppose that version 1.4 renames a key. Every version 1.x and 2.x then still reads the old name
(docs/reference/promises.md). `check`, `enable` and `run` read such a file, and `rmf-bridge migrate`
rewrites it (`rewritten.py`).
"""

from collections.abc import Iterator, Sequence
from typing import Final

from msgspec import Struct
from yaml import MappingNode, Mark, Node, ScalarNode

from bridges.yaml.parsing import Problem, YamlFile
from bridges.yaml.positions import MappingEntry, below


class RenamedKey(Struct, frozen=True):
    """One key that was renamed or moved.

    - `was`: the old path from the top of the file
    - `now`: the new path. A `*` in a path stands for any name. This name is the same in both paths.
    - `since`: the version that renamed the key
    """

    was: str
    now: str
    since: str


RENAMED: Final = (
    RenamedKey(
        "chargers.*.map.stops_unfed_s", "chargers.*.limits.peer_internal_timeout_s", "0.1.0"
    ),
)


class OldKey(Struct, frozen=True):
    """A renamed key in one file.

    `parent`: the mapping around the key. `entry`: the key and its value. `path`: the key's new path.
    """

    parent: MappingNode
    entry: MappingEntry
    path: tuple[str, ...]

    def remark(self, file: str) -> str:
        """Return the text that tells the key's new spelling."""
        value = self.entry.value.value if isinstance(self.entry.value, ScalarNode) else "…"
        *sections, key = self.path
        opened = "".join(f"{{{name}: " for name in sections)
        text = f"{opened}{{{key}: {value}}}{'}' * len(sections)}"[1:-1]
        return f"'{self.entry.name}' has a new name: write {text} (rmf-bridge migrate {file})"


def old_keys(root: MappingNode) -> list[OldKey]:
    """Return every key of the file that has been renamed."""
    return [old for row in RENAMED for old in _matches(root, row)]


def read_as_renamed(page: YamlFile, root: MappingNode) -> list[Problem]:
    """Move renamed keys to their new places, and return a warning for each of them.

    If a file has both the old and the new name, note a problem.
    """
    found = old_keys(root)
    for old in found:
        pair = (old.entry.key, old.entry.value)
        old.parent.value = [one for one in old.parent.value if one != pair]
    for old in found:
        _put(page, root, old)
    return [page.problem(old.entry.key, f"warning: {old.remark(page.file)}") for old in found]


def _matches(root: MappingNode, row: RenamedKey) -> Iterator[OldKey]:
    *sections, key = row.was.split(".")
    for node, names in _below(root, sections, ()):
        entry = below(node, key)
        if entry:
            rest = iter(names)
            path = tuple(next(rest) if part == "*" else part for part in row.now.split("."))
            yield OldKey(node, entry, path)


def _below(
    node: Node, sections: Sequence[str], names: tuple[str, ...]
) -> Iterator[tuple[MappingNode, tuple[str, ...]]]:
    """Yield (mapping, names) for each mapping at the path. `names`: the names that stand in the place
    of each `*` of the path."""
    if not isinstance(node, MappingNode):
        return
    if not sections:
        yield node, names
        return
    for key, value in node.value:
        if isinstance(key, ScalarNode) and sections[0] in ("*", key.value):
            own = (key.value,) if sections[0] == "*" else ()
            yield from _below(value, sections[1:], names + own)


def _put(page: YamlFile, root: MappingNode, old: OldKey) -> None:
    """Put the value at its new path, with the line and column of the old key. If the new section is not
    a mapping, leave it unchanged, because its reader reports this."""
    node: Node = root
    *sections, key = old.path
    for part in sections:
        node = _section(node, part, old)
    if not isinstance(node, MappingNode):
        return
    present = below(node, key)
    if present is None:
        node.value.append((_key(key, old), old.entry.value))
    elif present.value is not old.entry.value:  # with an alias, both keys may have the same value
        text = f"'{old.entry.name}' is the old name of '{key}', which the file has too: delete it"
        page.note(old.entry.key, text)


def _section(node: Node, name: str, old: OldKey) -> Node:
    entry = below(node, name)
    if entry or not isinstance(node, MappingNode):
        return entry.value if entry else node
    made = MappingNode("tag:yaml.org,2002:map", [], *_marks(old))
    node.value.append((_key(name, old), made))
    return made


def _key(name: str, old: OldKey) -> ScalarNode:
    return ScalarNode("tag:yaml.org,2002:str", name, *_marks(old))


def _marks(old: OldKey) -> tuple[Mark | None, Mark | None]:
    return old.entry.key.start_mark, old.entry.key.end_mark
