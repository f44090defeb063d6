"""Structures and requests of the kernel's GPIO interface, copied from linux/gpio.h.

The source is include/uapi/linux/gpio.h of Linux 6.1: gpiochip_info, gpio_v2_line_attribute and
gpio_v2_line_info. These parts have not changed since Linux 5.10. The ioctl numbers follow
asm-generic/ioctl.h. According to the C compiler, gpiochip_info has 68 bytes and gpio_v2_line_info has
256 bytes. The requests for these two structures are 8044b401 and c100b405. In gpio_v2_line_info `flags`
begins at byte 72 and `attrs` at byte 80.
"""

import ctypes
from typing import Final

NAME: Final = ctypes.c_char * 32
READ, WRITE = 2, 1


class GpiochipInfo(ctypes.Structure):
    """The kernel's `struct gpiochip_info`."""

    _fields_ = [("name", NAME), ("label", NAME), ("lines", ctypes.c_uint32)]


class LineAttribute(ctypes.Structure):
    """The kernel's `struct gpio_v2_line_attribute`. The widest member represents the union."""

    _fields_ = [("id", ctypes.c_uint32), ("padding", ctypes.c_uint32), ("value", ctypes.c_uint64)]


class LineInfo(ctypes.Structure):
    """The kernel's `struct gpio_v2_line_info`."""

    _fields_ = [
        ("name", NAME),
        ("consumer", NAME),
        ("offset", ctypes.c_uint32),
        ("num_attrs", ctypes.c_uint32),
        ("flags", ctypes.c_uint64),
        ("attrs", LineAttribute * 10),
        ("padding", ctypes.c_uint32 * 4),
    ]


def _request(way: int, number: int, argument: type[ctypes.Structure]) -> int:
    """Return the number of an ioctl request of type 0xB4. `way` distinguishes _IOR from _IOWR."""
    return way << 30 | ctypes.sizeof(argument) << 16 | 0xB4 << 8 | number


GET_CHIPINFO: Final = _request(READ, 1, GpiochipInfo)
GET_LINEINFO: Final = _request(READ | WRITE, 5, LineInfo)
USED, ACTIVE_LOW, INPUT, OUTPUT = 1 << 0, 1 << 1, 1 << 2, 1 << 3
"""Flags of a line, named GPIO_V2_LINE_FLAG_* in the kernel."""
