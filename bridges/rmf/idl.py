"""The types of `definitions.py` as cyclonedds wants them: a class for each, naming type and fields.

cyclonedds announces these names and field types to the other nodes, and its C library refuses
samples that do not fit them. It asks the same class to turn samples into bytes and back: ours answer
with `cdr.py`, so a message never takes a second Python form on its way (and is five times faster).
"""

import types
import typing
from dataclasses import fields
from typing import Any

from cyclonedds.idl import IdlStruct, annotations
from cyclonedds.idl import types as idl_types

from bridges.rmf import cdr
from bridges.rmf.definitions import PACKAGES

_made: dict[type, Any] = {}


def sample_type(message_type: type) -> Any:
    """The one class that stands for a message type in cyclonedds, named as ROS names it in DDS.

    An instance carries one `message`; cyclonedds sets `sample_info` on those that it has read.
    """
    if message_type not in _made:
        _made[message_type] = _make(message_type)
    return _made[message_type]


def _make(message_type: type) -> Any:
    def body(namespace: dict[str, Any]) -> None:
        namespace["__annotations__"] = {
            field.name: _idl(field.type) for field in fields(message_type)
        }
        namespace.update(_calls(message_type))

    # In cyclonedds a dot stands for the `::` of IDL.
    typename = f"{PACKAGES[message_type]}.msg.dds_.{message_type.__name__}_"
    made = types.new_class(typename, (IdlStruct,), {"typename": typename}, body)
    return annotations.final(made)  # ROS types are final: an appendable one does not match


def _calls(message_type: type) -> dict[str, Any]:
    """What cyclonedds calls. Each sample begins with its encoding, so `options` say nothing new."""

    def __init__(self: Any, message: Any) -> None:
        self.message = message

    def serialize(self: Any, **options: object) -> bytes:
        return cdr.encode(message_type, self.message)

    def deserialize(cls: Any, sample: bytes, /, **options: object) -> Any:
        return cls(cdr.decode(message_type, sample))

    def deserialize_key(cls: Any, sample: bytes, /, **options: object) -> None:
        """Called for what is no message but the news that a writer has gone; RMF has no keys."""

    return {
        "__init__": __init__,
        "serialize": serialize,
        "deserialize": classmethod(deserialize),
        "deserialize_key": classmethod(deserialize_key),
    }


def _idl(kind: Any) -> Any:
    if typing.get_origin(kind) is typing.Annotated:
        return getattr(idl_types, kind.__metadata__[0])
    if typing.get_origin(kind) is tuple:
        return idl_types.sequence[_idl(typing.get_args(kind)[0])]
    return kind if kind in (str, bool) else sample_type(kind)
