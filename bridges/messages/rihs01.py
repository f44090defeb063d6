"""The RIHS01 type hash (ROS REP-2016) of each message, computed from `definitions.py`.

A ROS 2 node announces the hash of its message definition with each endpoint. The node warns about a
peer that has no hash or another hash.

The hash is the SHA-256 of a JSON text. The text describes the type's fields, and then all nested types,
sorted by name. The hash covers the names and types of fields. It does not cover constants and comments.

Source: ros2/rosidl, rosidl_generator_type_description, and type_description_interfaces/FieldType.
"""

import hashlib
import json
import typing
from collections.abc import Hashable
from functools import cache
from typing import Final

from bridges.messages.definitions import PACKAGES, Message
from bridges.messages.releases import NEWEST, RELEASES, Release

NESTED = 1
TYPE_IDS = {
    "uint8": 3,
    "int32": 6,
    "uint32": 7,
    "uint64": 9,
    "float32": 10,
    "byte": 16,
    bool: 15,
    str: 17,
}
UNBOUNDED_SEQUENCE = 144


def type_hash(message_type: type, release: Release = NEWEST) -> str:
    """Return the hash: `RIHS01_` and 64 hexadecimal digits."""
    return _hash(message_type, release)


@cache
def _hash(message_type: Hashable, release: Release) -> str:
    assert isinstance(message_type, type)
    referenced = sorted(_nested_in(message_type, release), key=type_name)
    description = {
        "type_description": _description(message_type, release),
        "referenced_type_descriptions": [_description(nested, release) for nested in referenced],
    }
    return "RIHS01_" + hashlib.sha256(json.dumps(description).encode()).hexdigest()


def releases_of(hashed: str) -> list[Release]:
    """Return the releases that have a message with this hash."""
    return _by_hash().get(hashed, [])


@cache
def _by_hash() -> dict[str, list[Release]]:
    found: dict[str, list[Release]] = {}
    for release in RELEASES.values():
        for message_type in release.messages():
            found.setdefault(type_hash(message_type, release), []).append(release)
    return found


def type_name(message_type: type) -> str:
    """Return the type's name in ROS, which has the form `package/msg/Name`."""
    return f"{PACKAGES[message_type]}/msg/{message_type.__name__}"


MESSAGES: Final[dict[str, type[Message]]] = {
    type_name(message_type): message_type for message_type in typing.get_args(Message)
}
"""The message types by their names in ROS, such as `rmf_lift_msgs/msg/LiftState`."""


def _description(message_type: type, release: Release) -> dict[str, object]:
    return {
        "type_name": type_name(message_type),
        "fields": [
            {"name": name, "type": _field_type(kind)}
            for name, kind in release.fields(message_type).items()
        ],
    }


def _field_type(kind: type) -> dict[str, object]:
    element = _element(kind)
    nested = element in PACKAGES
    sequence = typing.get_origin(kind) is tuple
    return {
        "type_id": (NESTED if nested else TYPE_IDS[element]) + sequence * UNBOUNDED_SEQUENCE,
        "capacity": 0,
        "string_capacity": 0,
        "nested_type_name": type_name(element) if nested else "",
    }


def _element(kind: type) -> type:
    """Return the type of a sequence's elements, or else the type itself. Return the ROS name in place
    of a type of number."""
    if typing.get_origin(kind) is tuple:
        kind = typing.get_args(kind)[0]
    return typing.get_args(kind)[1] if typing.get_origin(kind) is typing.Annotated else kind


def _nested_in(message_type: type, release: Release) -> set[type]:
    direct = {_element(kind) for kind in release.fields(message_type).values()} & PACKAGES.keys()
    return direct.union(*(_nested_in(nested, release) for nested in direct))
