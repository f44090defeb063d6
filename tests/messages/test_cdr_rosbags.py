"""Compare our bytes and type hashes with those of rosbags, an independent implementation."""

from typing import Any

import numpy
import pytest
from hypothesis import given
from msgspec import Struct
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from bridges.messages import definitions as d
from bridges.messages.cdr import encode
from bridges.messages.rihs01 import type_hash
from tests.messages.test_definitions import FIELDS
from tests.transports.values import MESSAGE_TYPES, repeatable, values

STORE = get_typestore(Stores.EMPTY)
for _name, _text in FIELDS.items():  # one field per line, as in a .msg file
    _package, _message = _name.split("/")
    STORE.register(get_types_from_msg(_text.replace(",", "\n"), f"{_package}/msg/{_message}"))
EVERY_TYPE = pytest.mark.parametrize("kind", MESSAGE_TYPES, ids=lambda kind: kind.__name__)


def name(kind: type) -> str:
    """Return the name of a message type in ROS."""
    return f"{d.PACKAGES[kind]}/msg/{kind.__name__}"


def theirs(value: Any) -> Any:
    """Return our value as a value of rosbags, which uses arrays for lists of numbers."""
    if isinstance(value, Struct):
        made = STORE.types[name(type(value))]
        members = {name: theirs(getattr(value, name)) for name in value.__struct_fields__}
        if isinstance(value, d.DiagnosticStatus):  # rosbags reads `level` as signed
            members["level"] = (value.level ^ 128) - 128
        return made(**members)
    if isinstance(value, tuple):
        if (value and isinstance(value[0], str)) or (value and isinstance(value[0], Struct)):
            return [theirs(element) for element in value]
        return numpy.array(value, dtype=numpy.uint8)
    return value


@EVERY_TYPE
def test_rosbags_writes_the_same_bytes(kind: Any) -> None:
    @repeatable
    @given(values(kind))
    def check_written_alike(message: Any) -> None:
        written = bytes(STORE.serialize_cdr(theirs(message), name(kind), little_endian=True))
        assert encode(kind, message) == written

    check_written_alike()


@EVERY_TYPE
def test_rosbags_computes_the_same_hash(kind: Any) -> None:
    assert type_hash(kind) == STORE.hash_rihs01(name(kind))
