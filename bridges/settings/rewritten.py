"""Rewrites the renamed keys in the text of a device YAML. Comments, order and layout stay unchanged.

Only the text of a renamed key changes. If a key has moved to another section, its line is cut out,
together with the comment on it. The key then becomes the first key of its new section. `rewritten`
accepts the result only if the result has the same meaning as the original.
"""

from collections.abc import Iterator, Sequence

from msgspec import Struct
from msgspec.structs import replace
from yaml import MappingNode, Node

from bridges.settings.config import Config
from bridges.settings.load import understood
from bridges.settings.renamed_keys import OldKey, old_keys
from bridges.yaml.parsing import SettingsError, YamlFile, compose
from bridges.yaml.positions import below


class NeedsHand(Exception):
    """The error for a text that a person must rewrite, because a program would change its meaning."""


class _Edit(Struct, frozen=True, order=True):
    """An edit that replaces the characters from `start` to `end`."""

    start: int
    end: int
    text: str


def rewritten(config: Config) -> str:
    """Return the file's text with new names in place of old names. Raises NeedsHand."""
    text = config.text.decode()
    root = compose(YamlFile(str(config.path)), config.text)
    edits = {edit for old in old_keys(root) for edit in _edits(text, root, old)}
    for edit in sorted(edits, reverse=True):
        text = text[: edit.start] + edit.text + text[edit.end :]
    try:
        made = understood(config.path, text.encode())
    except SettingsError as error:
        raise NeedsHand(str(error)) from None
    if _meaning(made) != _meaning(config):
        raise NeedsHand("the rewritten text would have another meaning")
    return text


def _meaning(config: Config) -> Config:
    return replace(config, text=b"", warnings=(), old_keys=(), notes=())


def _edits(text: str, root: MappingNode, old: OldKey) -> Iterator[_Edit]:
    *sections, key = old.path
    start, end = _span(old.entry.key)
    place, rest = _deepest(root, sections)
    if place is old.parent and not rest:
        yield _Edit(start, end, key)
        return
    value = slice(*_span(old.entry.value))
    cut, comment = _cut(text, old)
    yield cut
    inner = f"{key}: {text[value]}"
    for name in reversed(rest):
        inner = f"{name}: {{{inner}}}"
    yield _insertion(place, inner, comment + ("\r\n" if "\r\n" in text else "\n"))


def _span(node: Node) -> tuple[int, int]:
    return node.start_mark.index, node.end_mark.index


def _deepest(root: MappingNode, sections: Sequence[str]) -> tuple[MappingNode, Sequence[str]]:
    """Return the innermost section that exists, and the names of the missing sections below it."""
    place = root
    for number, name in enumerate(sections):
        entry = below(place, name)
        if entry is None or not isinstance(entry.value, MappingNode):
            return place, sections[number:]
        place = entry.value
    return place, ()


def _cut(text: str, old: OldKey) -> tuple[_Edit, str]:
    """Return the edit that removes a key with its value, and the comment after the value."""
    start, end = _span(old.entry.key)[0], _span(old.entry.value)[1]
    line = old.entry.key.start_mark.line + 1
    if _span(old.entry.value)[0] < start:  # an alias, which has the place of its anchor
        anchor = old.entry.value.start_mark.line + 1
        raise NeedsHand(f"line {line} takes its value from the anchor (&) on line {anchor}")
    if old.parent.flow_style:
        after = len(text[end:]) - len(text[end:].lstrip(" ,"))
        if text[end + after] != "}":
            return _Edit(start, end + after, ""), ""
        return _Edit(len(text[:start].rstrip(" ,")), end, ""), ""
    first, last = text.rfind("\n", 0, start) + 1, text.find("\n", end)
    last = len(text) if last < 0 else last
    behind = text[end:last].rstrip("\r")
    if text[first:start].strip() or (behind.strip() and not behind.lstrip().startswith("#")):
        raise NeedsHand(f"line {line} has more text than this key")
    return _Edit(first, min(last + 1, len(text)), ""), behind.rstrip()


def _insertion(place: MappingNode, entry: str, behind: str) -> _Edit:
    """Return the edit that makes `entry` the first entry of this mapping. `behind`: the rest of its
    line, with the line's end; not used in braces."""
    if place.flow_style:
        at = place.start_mark.index + 1
        return _Edit(at, at, f"{entry}, " if place.value else entry)
    at = place.value[0][0].start_mark.index
    indent = " " * place.value[0][0].start_mark.column
    return _Edit(at, at, f"{entry}{behind}{indent}")
