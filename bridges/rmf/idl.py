"""The types of `definitions.py` as cyclonedds wants them: a class for each, naming type and fields.

cyclonedds announces these names and field types to the other nodes, and its C library refuses
samples that do not fit them. It asks the same class to turn samples into bytes and back: ours answer
with `cdr.py`, so a message never takes a second Python form on its way (and is five times faster).
"""

import types
import typing
from typing import Any

from cyclonedds.idl import IdlStruct, annotations
from cyclonedds.idl import types as idl_types

from bridges.rmf import cdr
from bridges.rmf.definitions import PACKAGES, Message
from bridges.rmf.releases import NEWEST, Release
from bridges.rmf.rihs01 import type_hash

SampleType = Any
"""A class that is made here for cyclonedds, which has no types of its own."""

_made: dict[str, SampleType] = {}
"""By the type's hash: releases with the same message share its class."""


def sample_type(message_type: type, release: Release = NEWEST) -> SampleType:
    """The one class that stands for a message type in cyclonedds, named as ROS names it in DDS.

    An instance carries one `message`; cyclonedds sets `sample_info` on those that it has read.
    """
    key = type_hash(message_type, release)
    if key not in _made:
        _made[key] = _make(message_type, release)
    return _made[key]


def _make(message_type: type, release: Release) -> SampleType:
    def body(namespace: dict[str, object]) -> None:
        namespace["__annotations__"] = {
            name: _idl(kind, release) for name, kind in release.fields(message_type).items()
        }
        namespace.update(_calls(message_type, release))

    # In cyclonedds a dot stands for the `::` of IDL.
    typename = f"{PACKAGES[message_type]}.msg.dds_.{message_type.__name__}_"
    made = types.new_class(typename, (IdlStruct,), {"typename": typename}, body)
    return annotations.final(made)  # ROS types are final: an appendable one does not match


def _calls(message_type: type, release: Release) -> dict[str, object]:
    """What cyclonedds calls. Each sample begins with its encoding, so `options` say nothing new."""

    def __init__(self: SampleType, message: Message) -> None:
        self.message = message

    def serialize(self: SampleType, **options: object) -> bytes:
        return cdr.encode(message_type, self.message, release)

    def deserialize(cls: SampleType, sample: bytes, /, **options: object) -> SampleType:
        return cls(cdr.decode(message_type, sample, release))

    def deserialize_key(cls: SampleType, sample: bytes, /, **options: object) -> None:
        """Called when a writer has gone, not for a message. RMF's types have no keys."""

    return {
        "__init__": __init__,
        "serialize": serialize,
        "deserialize": classmethod(deserialize),
        "deserialize_key": classmethod(deserialize_key),
    }


def _idl(kind: type, release: Release) -> object:
    if typing.get_origin(kind) is typing.Annotated:
        return getattr(idl_types, typing.get_args(kind)[1])
    if typing.get_origin(kind) is tuple:
        return idl_types.sequence[_idl(typing.get_args(kind)[0], release)]
    return kind if kind in (str, bool) else sample_type(kind, release)
