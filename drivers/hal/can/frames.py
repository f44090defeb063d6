"""Frames on a CAN bus, their ids, and the bus's troubles."""

from collections.abc import Callable
from typing import Final, NamedTuple

EXTENDED: Final = 1 << 31
"""The mark of an id of 29 bits. The mark distinguishes an extended 0x123 from a standard 0x123."""


class Frame(NamedTuple):
    """One data frame. If the `id` has 29 bits, EXTENDED is set."""

    id: int
    payload: bytes


class Trouble(NamedTuple):
    """A trouble of the bus itself (such as bus-off), which an error frame reports. `text` is "" if the
    report says that the trouble is over."""

    text: str
    bus_off: bool


class LinkDown(Exception):
    """The error of an interface that cannot be used now. The error's text says what to check."""


class FrameFilter(NamedTuple):
    """The frames whose id equals `id` in the bits of `mask`. Without a mask all bits must be equal."""

    id: int
    mask: int = 0xFFFF_FFFF

    def fits(self, frame_id: int) -> bool:
        """Does the filter let this id pass?"""
        return (frame_id ^ self.id) & self.mask == 0


Hear = Callable[[Frame, float], None]
"""A function that receives a frame, and the time (monotonic seconds) when the daemon read the frame."""


def named(frame_id: int) -> str:
    """Return an id as people write it: 0x58A, 0x18FF50E5."""
    return f"0x{frame_id & ~EXTENDED:08X}" if frame_id & EXTENDED else f"0x{frame_id:03X}"
