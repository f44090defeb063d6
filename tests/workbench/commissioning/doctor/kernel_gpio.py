"""The kernel's answers about GPIO chips: structures and requests typed from linux/gpio.h.

Source: include/uapi/linux/gpio.h of Linux 6.1 (these parts unchanged since 5.10): gpiochip_info,
gpio_v2_line_attribute, gpio_v2_line_info; and the ioctl numbers by asm-generic/ioctl.h. The C compiler
gives sizes 68 and 256, requests 8044b401 and c100b405, `flags` at 72 and `attrs` at 80.
"""

import ctypes
from typing import Final

NAME: Final = ctypes.c_char * 32
READ, WRITE = 2, 1


class GpiochipInfo(ctypes.Structure):
    """struct gpiochip_info."""

    _fields_ = [("name", NAME), ("label", NAME), ("lines", ctypes.c_uint32)]


class LineAttribute(ctypes.Structure):
    """struct gpio_v2_line_attribute; the union is represented by its widest member."""

    _fields_ = [("id", ctypes.c_uint32), ("padding", ctypes.c_uint32), ("value", ctypes.c_uint64)]


class LineInfo(ctypes.Structure):
    """struct gpio_v2_line_info."""

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
    """Return the number of _IOR or _IOWR of the type 0xB4."""
    return way << 30 | ctypes.sizeof(argument) << 16 | 0xB4 << 8 | number


GET_CHIPINFO: Final = _request(READ, 1, GpiochipInfo)
GET_LINEINFO: Final = _request(READ | WRITE, 5, LineInfo)
USED, ACTIVE_LOW, INPUT, OUTPUT = 1 << 0, 1 << 1, 1 << 2, 1 << 3
"""GPIO_V2_LINE_FLAG_*."""
