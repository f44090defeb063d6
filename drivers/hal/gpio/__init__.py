"""GPIO: the pins of a Raspberry Pi's 40-pin header, through gpiozero on lgpio.

A pin becomes an output and gets its safe level in one call, so the output never has the wrong level. A
released output keeps its safe level (`drivers/hal/gpio/pins.py`). Every scan reads the levels of all
inputs. An edge only starts a scan earlier (`wake`), because lgpio may miss edges.

    header.py     the spelling of pins
    bus.py        claims, samples, drives and releases pins
    pins.py       gpiozero's pins on lgpio; imported when the header is opened
    bare.py       the same claims without gpiozero, to switch off from a new process
    chip.py       finds the chip, and the holder of a line
    dead_man.py   switches the outputs to their safe level when scans stop
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated

import msgspec

from bridges.kinds.shared.fields import Period, tells
from drivers.hal import BusSettings, BusType, HalError, Needs, Where
from drivers.hal.gpio.bus import Factory, GpioBus
from drivers.hal.gpio.header import (
    J8,
    boot_level,
    canonical,
    describe,
    wire_problems,
    wire_warnings,
)

__all__ = [
    "BUS",
    "J8",
    "GpioBus",
    "GpioSettings",
    "boot_level",
    "canonical",
    "describe",
    "open_bus",
    "wire_problems",
    "wire_warnings",
]


HEADER_CHIPS = (None, 0, 4)
"""The settings of `chip` that mean the header. On a Raspberry Pi 5 the header is gpiochip4 with kernels
before 6.6.45, and then gpiochip0, with gpiochip4 as a link to it. On every other Pi it is gpiochip0."""


class GpioSettings(BusSettings, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="gpio"):
    """The header's pins."""

    chip: Annotated[
        Annotated[int, msgspec.Meta(ge=0, le=255)] | None,
        tells("""the number N of `/dev/gpiochipN`. Without a number the daemon finds the chip by the
        chip's label `pinctrl-…`."""),
    ] = None
    scan_s: Annotated[Period, tells("how often every input is read.")] = 0.05


def where(settings: GpioSettings) -> Where:
    """Return the hardware that the bus uses: the header, or another chip."""
    chip = settings.chip
    return Where("the header" if chip in HEADER_CHIPS else f"gpiochip{chip}", local=True)


def needs(settings: GpioSettings) -> Needs:
    """Return the permission to use the chip in the settings. Without a chip in the settings, return the
    permission for every chip, because the bus opens each chip to read its label."""
    chip = "char-gpiochip" if settings.chip is None else f"/dev/gpiochip{settings.chip}"
    return Needs((chip,), group="gpio")


def open_bus(
    settings: GpioSettings,
    factory: Factory | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> "GpioBus":
    """Open the header's pins. Raises HalError, whose text says what to check.

    `factory` is a gpiozero pin factory whose pins claim lines in the same way as `pins.py`.
    """
    if factory is None:
        with _with_lgpio():
            from drivers.hal.gpio.pins import open_factory
        factory = open_factory(settings.chip)
    return GpioBus(factory, clock)


def open_to_switch_off(settings: GpioSettings) -> "GpioBus":
    """Open the same pins without gpiozero. Raises HalError."""
    with _with_lgpio():
        from drivers.hal.gpio.bare import BareFactory
    return GpioBus(BareFactory(settings.chip), time.monotonic)


@contextmanager
def _with_lgpio() -> Iterator[None]:
    """Turn errors of importing lgpio into HalError."""
    try:
        yield
    except ImportError as error:
        raise HalError(
            f"GPIO needs lgpio ({error}): run `apt install python3-lgpio`, or in a git clone"
            " `.venv/bin/pip install '.[gpio]'`; or run with --simulate"
        ) from error
    except OSError as error:  # lgpio's import makes a FIFO in the working directory
        raise HalError(f"lgpio cannot write in the working directory: {error}") from error


BUS = BusType(
    settings=GpioSettings,
    open_bus=open_bus,
    open_to_switch_off=open_to_switch_off,
    where=where,
    needs=needs,
    fake="hal_fakes.gpio",
    fake_inside=True,
    canonical=canonical,
    describe=describe,
    wire_problems=wire_problems,
    wire_warnings=wire_warnings,
)
