"""Frames on a CAN bus, their ids, and the bus's troubles."""

from collections.abc import Callable
from typing import Final, NamedTuple

EXTENDED: Final = 1 << 31
"""The mark of an id of 29 bits: 0x123 and an extended 0x123 are different ids."""


class Frame(NamedTuple):
    """One data frame. `id` has EXTENDED set if it has 29 bits."""

    id: int
    payload: bytes


class Trouble(NamedTuple):
    """A trouble of the bus itself, from an error frame. `text`: "" if the controller works again."""

    text: str
    bus_off: bool


class LinkDown(Exception):
    """The interface cannot be used now. The text says what to check."""


class FrameFilter(NamedTuple):
    """The frames whose id equals `id` in the bits of `mask`; without a mask, in all bits."""

    id: int
    mask: int = 0xFFFF_FFFF

    def fits(self, frame_id: int) -> bool:
        """Is this the id of one of these frames?"""
        return (frame_id ^ self.id) & self.mask == 0


Hear = Callable[[Frame, float], None]
"""A receiver: called with a frame and its reading time (monotonic s)."""


def named(frame_id: int) -> str:
    """Return an id as people write it: 0x58A, 0x18FF50E5."""
    return f"0x{frame_id & ~EXTENDED:08X}" if frame_id & EXTENDED else f"0x{frame_id:03X}"
