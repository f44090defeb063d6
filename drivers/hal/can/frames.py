"""Frames on a CAN bus, as the devices and the bus speak of them."""

from collections.abc import Callable
from typing import Final, NamedTuple

EXTENDED: Final = 1 << 31
"""In a frame's id: it has 29 bits. (0x123 and an extended 0x123 are two.)"""


class Frame(NamedTuple):
    """One data frame; `id` with EXTENDED where it has 29 bits."""

    id: int
    payload: bytes


class Trouble(NamedTuple):
    """The bus's own, from an error frame. `text`: "" when the controller is well again."""

    text: str
    bus_off: bool


class LinkDown(Exception):
    """The interface cannot be used now. The text says what to look at."""


class Wanted(NamedTuple):
    """Frames whose id has these bits where `mask` has ones; all of it where there is no mask."""

    id: int
    mask: int = 0xFFFF_FFFF

    def fits(self, frame_id: int) -> bool:
        """Is it one of them?"""
        return (frame_id ^ self.id) & self.mask == 0


Hear = Callable[[Frame, float], None]
"""Takes a frame and when it was read (monotonic s)."""


def named(frame_id: int) -> str:
    """An id as people write it: 0x58A, 0x18FF50E5."""
    return f"0x{frame_id & ~EXTENDED:08X}" if frame_id & EXTENDED else f"0x{frame_id:03X}"
