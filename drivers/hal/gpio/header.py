"""The 40-pin header: the spelling of its pins, and checks of the wires on the pins.

A point is written as `BCM17` or `J8:11`. A bare number is refused, because people often mistake the
position of a pin for its BCM number.
"""

import re
from collections.abc import Iterable

from drivers.hal.points import Wire

# Position -> BCM number, for the 40-pin header. The header is the same on every Raspberry Pi since the
# B+ (2014).
# fmt: off
J8 = {
    3: 2, 5: 3, 7: 4, 8: 14, 10: 15, 11: 17, 12: 18, 13: 27, 15: 22, 16: 23, 18: 24, 19: 10,
    21: 9, 22: 25, 23: 11, 24: 8, 26: 7, 27: 0, 28: 1, 29: 5, 31: 6, 32: 12, 33: 13, 35: 19,
    36: 16, 37: 26, 38: 20, 40: 21,
}
# fmt: on
POSITION = {bcm: position for position, bcm in J8.items()}
SUPPLY = {1: "3.3 V", 2: "5 V", 4: "5 V", 17: "3.3 V"}

FIXED_PULL_UP = ("BCM2", "BCM3")
HAT_EEPROM = ("BCM0", "BCM1")
SHARED = {
    "BCM0": "a HAT's EEPROM, which the firmware reads at boot",
    "BCM1": "a HAT's EEPROM, which the firmware reads at boot",
    "BCM2": "I2C (dtparam=i2c_arm=on), and has a fixed 1.8 kΩ pull-up",
    "BCM3": "I2C (dtparam=i2c_arm=on), and has a fixed 1.8 kΩ pull-up",
    "BCM14": "the serial console, which drives the pin at boot (enable_uart=1)",
    "BCM15": "the serial console (enable_uart=1)",
}
"""Pins that the firmware or the kernel uses in common setups of a Raspberry Pi."""


def canonical(point: str) -> str:
    """Return `BCM4` for `J8:7` or `BCM4`. Raises ValueError with the right spelling."""
    if found := re.fullmatch(r"BCM(0|[1-9][0-9]?)", point):
        if int(found[1]) in POSITION:
            return point
        raise ValueError(f"{point} is not on the 40-pin header, which has BCM0 to BCM27")
    if found := re.fullmatch(r"J8:([1-9][0-9]?)", point):
        return _at(int(found[1]))
    if found := re.fullmatch(r"(?:gpio|bcm)[ _:]?0*([0-9]{1,2})", point, re.IGNORECASE):
        raise ValueError(f"{point!r} is not a pin's name: write BCM{found[1]}")
    if point.isdecimal():
        raise ValueError(
            f"{point!r} may be a position or a BCM number: write BCM{point} or J8:{point}"
        )
    raise ValueError(f"{point!r} is not a pin: write BCM17, or J8:11 for a position on the header")


def _at(position: int) -> str:
    if position in J8:
        return f"BCM{J8[position]}"
    if position > 40:
        raise ValueError(f"J8:{position} does not exist: the header has positions 1 to 40")
    raise ValueError(f"J8:{position} is {SUPPLY.get(position, 'ground')}, not a GPIO pin")


def describe(point: str) -> str:
    """Return `BCM4 = J8:7`, for the electrician's table."""
    name = canonical(point)
    return f"{name} = J8:{POSITION[int(name[3:])]}"


def boot_level(point: str) -> bool:
    """Return the level of a pin from power-on until the daemon claims the pin. A pull resistor in the
    chip sets this level.

    The resistor pulls BCM0 to BCM8 up, and BCM9 to BCM27 down (BCM2835 ARM Peripherals, table 6-31).
    The chips after the BCM2835 do the same.
    """
    return int(canonical(point)[3:]) <= 8


def wire_problems(wire: Wire) -> Iterable[str]:
    """Yield each error of a wire on a header pin."""
    try:
        name = canonical(wire.point)
    except ValueError:
        return  # the spelling check reports an invalid point
    if wire.direction == "in":
        if wire.pull is None:
            yield "pull is missing: write up, down, or none where an external resistor is fitted"
        elif name in FIXED_PULL_UP and wire.pull != "up":
            yield f"{name} has a fixed 1.8 kΩ pull-up: write pull: up, or use another pin"
    elif wire.pull is not None:
        yield "an output has no pull"
    elif not wire.read_back:
        yield "read_back is only for the coils of a Modbus module: delete read_back"
    elif wire.flash is not None:
        yield "flash is only for Modbus modules that end pulses themselves: delete flash"
    elif name in HAT_EEPROM:
        yield f"{name} is for a HAT's EEPROM, and the firmware drives it at boot: use another pin"


def wire_warnings(wire: Wire) -> Iterable[str]:
    """Yield a warning if the firmware or the kernel may use this pin too."""
    try:
        name = canonical(wire.point)
    except ValueError:
        return  # the spelling check reports an invalid point
    if name in SHARED:
        free = "; use another pin, or disable this function of the pin in config.txt"
        yield f"{name} is for {SHARED[name]}{free}"
