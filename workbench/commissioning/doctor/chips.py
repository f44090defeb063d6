"""Read how the kernel describes GPIO chips and lines, without claiming a line (linux/gpio.h)."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from workbench.commissioning.doctor.machine import Machine

CHIP_INFO: Final = 0x8044B401
"""ioctl request GPIO_GET_CHIPINFO_IOCTL. The kernel returns name, label and number of lines."""
CHIP: Final = struct.Struct("=32s32sI")
LINE_INFO: Final = 0xC100B405
"""ioctl request GPIO_V2_GET_LINEINFO_IOCTL. The kernel returns name, consumer, offset, attributes and
flags."""
LINE: Final = struct.Struct("=32s32sIIQ176x")
USED, OUTPUT = 1, 8
"""Flags GPIO_V2_LINE_FLAG_USED and GPIO_V2_LINE_FLAG_OUTPUT."""


@dataclass(frozen=True, slots=True)
class Chip:
    """One GPIO chip: its device file, its label, and its number of lines."""

    device: Path
    label: str
    lines: int

    @property
    def number(self) -> int:
        """The number N of gpiochipN."""
        return int(self.device.name.removeprefix("gpiochip"))


@dataclass(frozen=True, slots=True)
class LineNow:
    """Present state of a line. `consumer` is the holder's name in the kernel, or "" if the line is
    free."""

    consumer: str
    output: bool


def devices(machine: Machine) -> list[Path]:
    """Return the device file of every GPIO chip, ordered by number."""
    found = (p for p in machine.folder("/dev", "gpiochip*") if p.name[8:].isdecimal())
    return sorted(found, key=lambda path: int(path.name[8:]))


def chips(machine: Machine) -> Iterator[Chip]:
    """Yield the chips that this process may open."""
    for device in devices(machine):
        try:
            answer = machine.ioctl(device, CHIP_INFO, bytes(CHIP.size))
        except OSError:
            continue
        _, label, lines = CHIP.unpack(answer)
        yield Chip(device, _text(label), lines)


def line(machine: Machine, chip: Chip, offset: int) -> LineNow:
    """Read a line of this chip. Raises OSError for an unknown line, and on a kernel before 5.10."""
    asked = LINE.pack(b"", b"", offset, 0, 0)
    _, consumer, _, _, flags = LINE.unpack(machine.ioctl(chip.device, LINE_INFO, asked))
    held = _text(consumer) or "somebody" if flags & USED else ""
    return LineNow(held, bool(flags & OUTPUT))


def _text(octets: bytes) -> str:
    return octets.split(b"\0")[0].decode(errors="replace")
