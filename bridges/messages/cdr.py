"""Converts messages to bytes and back. The encoding is plain CDR (XCDR1), which ROS 2 uses on the wire.

The bytes of one message are called a sample:

- The header has four bytes: `00 01 00 00` for little endian, `00 00 00 00` for big endian.
- The fields follow in their order.
- A number is aligned to its own size, counted from the end of the header.
- A string is its length as uint32, its UTF-8 bytes, and a NUL. The length includes the NUL.
- A sequence is its length as uint32, and then its elements.

Source: OMG DDS-XTypes 1.3, 7.4.3, and samples of rmw_cyclonedds and rmw_fastrtps.

For each type and release, an encoder and a decoder are built once from the annotations in
`definitions.py`. If a release lacks a field, the encoder leaves the field out. The decoder then gives
the field its default value.
"""

import struct
import typing
from collections.abc import Callable
from functools import cache
from typing import Any, Final, TypeVar

from bridges.messages.definitions import PACKAGES, field_types
from bridges.messages.releases import NEWEST, Release

T = TypeVar("T")
Value = Any
"""A field's value: a number, a text, a bool, a tuple of such values, or a struct of
`definitions.py`."""
Put = Callable[[bytearray, Value], None]
Get = Callable[[bytes, int], tuple[Value, int]]

LITTLE_ENDIAN = b"\x00\x01\x00\x00"
BIG_ENDIAN = b"\x00\x00\x00\x00"
HEADER = 4
LONGEST: Final = 1 << 20
"""The maximum length (bytes) of a sample from the network. A FleetState of 200 robots takes 46 kB, or
0.7 MB if the path of each robot has 50 places."""
LONGEST_FLAT: Final = 1 << 16
"""The maximum length (bytes) of a sample whose type has no lists of messages. This limit is lower than
LONGEST because a hundred such samples may wait in a queue."""
CODES = {"int32": "i", "uint32": "I", "uint64": "Q", "float32": "f"}
BYTES = ("uint8", "byte")


class CdrError(ValueError):
    """Error for bytes that are not a message of the type, or for a message that cannot be encoded."""


def encode(message_type: type, message: object, release: Release = NEWEST) -> bytes:
    """Encode the message as little endian CDR with its header.

    A NUL, and a lone half of a surrogate pair, cannot go on the wire. Each becomes `?`, because
    otherwise such a character in a text from a device would block the device's state message. Raises
    CdrError for a number out of range, and for a value of another type.
    """
    out = bytearray(LITTLE_ENDIAN)
    try:
        _put(message_type, release)(out, message)
    except (struct.error, OverflowError, TypeError, AttributeError, ValueError) as error:
        raise CdrError(f"{message!r} cannot be sent as {message_type.__name__}: {error}") from error
    return bytes(out)


@cache
def longest(message_type: type) -> int:
    """Return the maximum length (bytes) of a sample of this type."""
    listed = (typing.get_args(kind)[:1] for kind in field_types(message_type).values())
    return LONGEST if any(one and one[0] in PACKAGES for one in listed) else LONGEST_FLAT


def decode(message_type: type[T], sample: bytes, release: Release = NEWEST) -> T:
    """Decode the message in a sample of either byte order. Raises CdrError if the sample is invalid.

    Up to three bytes may follow the last field, because RTPS pads payloads to a multiple of four bytes.
    """
    if len(sample) > longest(typing.cast(type, message_type)):
        raise CdrError(f"{len(sample)} bytes long")
    order = _ORDERS.get(sample[:2])
    if order is None:
        raise CdrError(f"not plain CDR: the sample begins with {sample[:4].hex(' ') or 'nothing'}")
    try:
        message, end = _get(typing.cast(type, message_type), order, release)(sample, 4)
    except (struct.error, IndexError) as error:
        raise CdrError(f"cut short: {error}") from error
    except UnicodeDecodeError as error:
        raise CdrError(f"a string is not UTF-8: {error}") from error
    if not 0 <= len(sample) - end <= 3:
        raise CdrError(f"{len(sample)} bytes, where {message_type.__name__} takes {end}")
    return typing.cast(T, message)


def decode_text(sample: bytes) -> str:
    """Decode the text of a std_msgs/String. Raises CdrError."""
    order = _ORDERS.get(sample[:2])
    try:
        return str(_get(str, order or "<", NEWEST)(sample, 4)[0])
    except (struct.error, IndexError, UnicodeDecodeError) as error:
        raise CdrError(f"no text: {error}") from error


_ORDERS = {LITTLE_ENDIAN[:2]: "<", BIG_ENDIAN[:2]: ">"}


@cache
def _put(kind: type, release: Release) -> Put:
    """Return a function that appends a value of this type to a sample."""
    if typing.get_origin(kind) is typing.Annotated:
        name = typing.get_args(kind)[1]
        return _put_byte if name in BYTES else _putting_number(CODES[name])
    if kind is str:
        return _put_text
    if kind is bool:
        return _put_bool
    if typing.get_origin(kind) is tuple:
        return _putting_sequence(_put(typing.get_args(kind)[0], release))
    fields = release.fields(kind)
    return _putting_struct([(name, _put(member, release)) for name, member in fields.items()])


def _put_byte(out: bytearray, value: int) -> None:
    out.append(value)


def _put_bool(out: bytearray, value: bool) -> None:
    if value is not True and value is not False:
        raise CdrError(f"{value!r} is not a bool")
    out.append(value)


def _putting_number(code: str) -> Put:
    number = struct.Struct("<" + code)
    pack, mask = number.pack, number.size - 1

    def put(out: bytearray, value: float) -> None:
        out += bytes(HEADER - len(out) & mask)
        out += pack(value)

    return put


_put_length = _putting_number("I")


def _put_text(out: bytearray, value: str) -> None:
    text = value.encode(errors="replace").replace(b"\0", b"?")
    _put_length(out, len(text) + 1)
    out += text
    out.append(0)


def _putting_sequence(put_element: Put) -> Put:
    def put(out: bytearray, value: tuple[Value, ...]) -> None:
        _put_length(out, len(value))
        for element in value:
            put_element(out, element)

    return put


def _putting_struct(members: list[tuple[str, Put]]) -> Put:
    def put(out: bytearray, value: object) -> None:
        for name, put_member in members:
            put_member(out, getattr(value, name))

    return put


@cache
def _get(kind: type, order: str, release: Release) -> Get:
    """Return a function that reads a value of this type at a position. The function returns the value
    and the position after the value."""
    if typing.get_origin(kind) is typing.Annotated:
        name = typing.get_args(kind)[1]
        return _get_byte if name in BYTES else _getting_number(order + CODES[name])
    if kind is str:
        return _getting_text(order)
    if kind is bool:
        return _get_bool
    if typing.get_origin(kind) is tuple:
        return _getting_sequence(_get(typing.get_args(kind)[0], order, release), order)
    fields = release.fields(kind)
    return _getting_struct(kind, {name: _get(f, order, release) for name, f in fields.items()})


def _get_byte(sample: bytes, at: int) -> tuple[int, int]:
    return sample[at], at + 1


def _get_bool(sample: bytes, at: int) -> tuple[bool, int]:
    if sample[at] > 1:
        raise CdrError(f"{sample[at]} is not a bool")
    return sample[at] == 1, at + 1


def _getting_number(code: str) -> Get:
    number = struct.Struct(code)
    unpack, size = number.unpack_from, number.size

    def get(sample: bytes, at: int) -> tuple[int, int]:
        at += HEADER - at & size - 1
        return unpack(sample, at)[0], at + size

    return get


def _getting_text(order: str) -> Get:
    unpack = struct.Struct(order + "I").unpack_from

    def get(sample: bytes, at: int) -> tuple[str, int]:
        at += (HEADER - at & 3) + 4
        end = at + unpack(sample, at - 4)[0]
        if sample.find(0, at, end) != end - 1:
            raise CdrError("a string does not end with its only NUL")
        return sample[at : end - 1].decode(), end

    return get


def _getting_sequence(get_element: Get, order: str) -> Get:
    get_length = _getting_number(order + "I")

    def get(sample: bytes, at: int) -> tuple[tuple[Value, ...], int]:
        length, at = get_length(sample, at)
        if length > len(sample) - at:  # each element takes at least 1 byte
            raise CdrError(f"a sequence of {length} elements in {len(sample)} bytes")
        elements = []
        for _ in range(length):
            element, at = get_element(sample, at)
            elements.append(element)
        return tuple(elements), at

    return get


def _getting_struct(kind: type, members: dict[str, Get]) -> Get:
    gets, names = tuple(members.values()), tuple(members)
    whole = names == tuple(field_types(kind))  # False if the release lacks a field

    def get(sample: bytes, at: int) -> tuple[object, int]:
        values = []
        for get_member in gets:
            value, at = get_member(sample, at)
            values.append(value)
        return kind(*values) if whole else kind(**dict(zip(names, values, strict=True))), at

    return get
