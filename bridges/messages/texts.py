"""Message definitions as texts, which ROS recordings contain. This file writes such texts from our
table, and compares recorded texts with the table.

A text has one line for each field of the message. For each nested type, three parts follow: a line of
`=`, a line `MSG: package/Name`, and the lines of the type's fields. MCAP calls this form `ros2msg`, and
rosbag2 writes it.
"""

import re
import typing
from functools import cache
from typing import Final

from bridges.messages.definitions import PACKAGES
from bridges.messages.releases import NEWEST, RELEASES, Release
from bridges.messages.rihs01 import type_name

RULE: Final = "=" * 80
LONGEST: Final = 1 << 20
DEEPEST: Final = 8
"""The maximum depth of nested types. A definition that contains itself would otherwise never end."""

Shape = tuple[tuple[str, object], ...]
"""The fields of a message as pairs of a name and a type. A type is a name, or the Shape of a nested
type. A sequence is a type name with `[]`, or a tuple of one Shape."""


class UnknownDefinition(ValueError):
    """Error for a text that is not a definition of a message."""


def text(message_type: type, release: Release) -> str:
    """Return the definition of a message and of all nested types."""
    parts = [_fields(message_type, release)]
    for nested in _below(message_type, release):
        parts += [RULE, f"MSG: {_short(nested)}", _fields(nested, release)]
    return "\n".join(parts) + "\n"


def releases_of(message_type: type, definition: str) -> list[Release]:
    """Return the releases in which the message has this definition, the newest first."""
    try:
        found = _read(_short(message_type), definition)
    except UnknownDefinition:
        return []
    newest_first = sorted(RELEASES.values(), key=lambda release: release is not NEWEST)
    return [r for r in newest_first if r.has(message_type) and found == _shape(message_type, r)]


def _short(message_type: type) -> str:
    return type_name(message_type).replace("/msg/", "/")


def _fields(message_type: type, release: Release) -> str:
    return "\n".join(
        f"{_ros_type(kind)} {name}" for name, kind in release.fields(message_type).items()
    )


def _ros_type(kind: type) -> str:
    """Return the name of a field's type in a definition."""
    if typing.get_origin(kind) is tuple:
        return _ros_type(typing.get_args(kind)[0]) + "[]"
    if kind in PACKAGES:
        return _short(kind)
    if typing.get_origin(kind) is typing.Annotated:
        return str(typing.get_args(kind)[1])
    return {str: "string", bool: "bool"}[kind]


def _element(kind: type) -> type:
    return typing.get_args(kind)[0] if typing.get_origin(kind) is tuple else kind


def _below(message_type: type, release: Release) -> list[type]:
    """Return each nested type of a message once, in the order in which the message first mentions
    it."""
    found: dict[type, None] = {}
    for kind in map(_element, release.fields(message_type).values()):
        if kind in PACKAGES:
            found |= dict.fromkeys([kind, *_below(kind, release)])
    return list(found)


@cache
def _shape(message_type: type, release: Release) -> Shape:
    return tuple(
        (name, _shape_of(kind, release)) for name, kind in release.fields(message_type).items()
    )


def _shape_of(kind: type, release: Release) -> object:
    element = _element(kind)
    if element not in PACKAGES:
        return _ros_type(kind)
    below = _shape(element, release)
    return below if element is kind else (below,)


FIELD: Final = re.compile(r"([A-Za-z][\w/]*)(?:<=\d+)?(\[(?:<=)?\d*\])?\s+([a-z]\w*)\b(?!\s*=)")
"""A pattern for a line with a field: type, `[]`, name. A `=` after the name makes the line a constant.
A default value follows the name without `=`."""


def _read(name: str, definition: str) -> Shape:
    """Return the shape of a definition. Raises UnknownDefinition."""
    if len(definition) > LONGEST:
        raise UnknownDefinition("longer than the definition of any message")
    sections = re.split(r"^=+$\n?", definition, flags=re.MULTILINE)
    own, *others = sections
    texts = {name: own}
    for section in others:
        title, _, body = section.strip().partition("\n")
        texts[title.removeprefix("MSG:").strip().replace("/msg/", "/")] = body
    return _shape_in(name, texts, DEEPEST)


def _shape_in(name: str, texts: dict[str, str], deeper: int) -> Shape:
    if name not in texts or deeper == 0:
        raise UnknownDefinition(name)
    package = name.partition("/")[0]
    found = []
    for line in texts[name].splitlines():
        field = FIELD.match(line.partition("#")[0].strip())
        if field:
            found.append((field[3], _field_in(field, package, texts, deeper)))
    return tuple(found)


def _field_in(field: re.Match[str], package: str, texts: dict[str, str], deeper: int) -> object:
    kind = field[1].replace("/msg/", "/")
    if not kind[0].isupper() and "/" not in kind:
        return kind + ("[]" if field[2] else "")
    below = _shape_in(kind if "/" in kind else f"{package}/{kind}", texts, deeper - 1)
    return (below,) if field[2] else below
