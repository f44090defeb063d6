"""The types of `definitions.py` for cyclonedds. Each type has a class with the type's name and fields.

cyclonedds announces these names and fields to other nodes. Its C library refuses a sample that does not
fit the announced fields.

cyclonedds also calls these classes to encode and decode samples. The classes do this with `cdr.py`, and
keep the decoded message. Converting the message to one of cyclonedds's own objects would take five
times as long.
"""

import types
import typing
from typing import Protocol

from cyclonedds.idl import IdlStruct, annotations
from cyclonedds.idl import types as idl_types

from bridges.messages import cdr
from bridges.messages.definitions import PACKAGES, Message
from bridges.messages.releases import NEWEST, Release
from bridges.messages.rihs01 import type_hash


class IdlSample(Protocol):
    """A message for cyclonedds. `sample_type` makes the classes of such messages."""

    message: Message

    def __init__(self, message: Message) -> None: ...


_made: dict[str, type[IdlSample]] = {}
"""The classes by type hash. Releases with the same message share one class."""


def sample_type(message_type: type, release: Release = NEWEST) -> type[IdlSample]:
    """Return cyclonedds's class for a message type. The class has the type's name in ROS's DDS.

    cyclonedds sets `sample_info` on the instances that it reads.
    """
    key = type_hash(message_type, release)
    if key not in _made:
        _made[key] = _make(message_type, release)
    return _made[key]


def _make(message_type: type, release: Release) -> type[IdlSample]:
    def body(namespace: dict[str, object]) -> None:
        namespace["__annotations__"] = {
            name: _idl(kind, release) for name, kind in release.fields(message_type).items()
        }
        namespace.update(_calls(message_type, release))

    # In cyclonedds a dot stands for the `::` of IDL.
    typename = f"{PACKAGES[message_type]}.msg.dds_.{message_type.__name__}_"
    made = types.new_class(typename, (IdlStruct,), {"typename": typename}, body)
    final: type[IdlSample] = annotations.final(
        made
    )  # ROS's types are final and match only final types
    return final


def _calls(message_type: type, release: Release) -> dict[str, object]:
    """Return the methods that cyclonedds calls. cyclonedds passes the encoding in `options`, but the
    methods do not need it, because each sample also names its encoding."""

    def __init__(self: IdlSample, message: Message) -> None:
        self.message = message

    def serialize(self: IdlSample, **options: object) -> bytes:
        return cdr.encode(message_type, self.message, release)

    def deserialize(cls: type[IdlSample], sample: bytes, /, **options: object) -> IdlSample:
        return cls(cdr.decode(message_type, sample, release))

    def deserialize_key(cls: type[IdlSample], sample: bytes, /, **options: object) -> None:
        """Do nothing. cyclonedds calls this method for the key of a sample when its writer has left.
        RMF's types have no keys."""

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
