"""The RIHS01 type hash (ROS REP-2016) of each message, computed from `definitions.py`.

A ROS 2 node announces the hash of its message definition with each endpoint, and warns about a peer
without a hash or with another one. The hash is the SHA-256 of the type's description as JSON: its
fields, then the descriptions of all nested types, sorted by name. It covers the names and types of
fields, but neither constants nor comments.
Source: ros2/rosidl, rosidl_generator_type_description, and type_description_interfaces/FieldType.
"""

import hashlib
import json
import typing

from bridges.rmf.definitions import PACKAGES, field_types

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


def type_hash(message_type: type) -> str:
    """`RIHS01_` and 64 hexadecimal digits."""
    referenced = sorted(_nested_in(message_type), key=_type_name)
    description = {
        "type_description": _description(message_type),
        "referenced_type_descriptions": [_description(nested) for nested in referenced],
    }
    return "RIHS01_" + hashlib.sha256(json.dumps(description).encode()).hexdigest()


def _type_name(message_type: type) -> str:
    return f"{PACKAGES[message_type]}/msg/{message_type.__name__}"


def _description(message_type: type) -> dict[str, object]:
    return {
        "type_name": _type_name(message_type),
        "fields": [
            {"name": name, "type": _field_type(kind)}
            for name, kind in field_types(message_type).items()
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
        "nested_type_name": _type_name(element) if nested else "",
    }


def _element(kind: type) -> type:
    """The type of a sequence's elements, or the type itself; a number type as its ROS name."""
    if typing.get_origin(kind) is tuple:
        kind = typing.get_args(kind)[0]
    return typing.get_args(kind)[1] if typing.get_origin(kind) is typing.Annotated else kind


def _nested_in(message_type: type) -> set[type]:
    direct = {_element(kind) for kind in field_types(message_type).values()} & PACKAGES.keys()
    return direct.union(*(_nested_in(nested) for nested in direct))
