"""The header's chip and the claims of its lines, through lgpio alone. Import this file only where lgpio
is installed.

The import of lgpio creates a FIFO (a named pipe) in the working directory. So import this file only
while the runtime directory is the working directory.
"""

import os
from collections.abc import Callable, Iterable
from pathlib import Path

import lgpio

from drivers.hal import HalError
from drivers.hal.gpio.holders import holders

HEADER_LABEL = "pinctrl-"
PULLS = {"up": lgpio.SET_PULL_UP, "down": lgpio.SET_PULL_DOWN, "floating": lgpio.SET_PULL_NONE}
DEV = Path("/dev")


def open_chip(chip: int | None, dev: Path = DEV) -> tuple[int, int]:
    """Open this chip. Without a number, find the header's chip by its label. Return (handle, number).
    Raises HalError."""
    if chip is not None:
        return _open(chip, dev), chip
    numbers = sorted(int(p.name[8:]) for p in dev.glob("gpiochip*") if p.name[8:].isdecimal())
    refused = []
    for number in numbers:
        try:
            handle = _open(number, dev)
        except HalError as error:
            refused.append(str(error))
            continue
        if _label(handle).startswith(HEADER_LABEL):
            return handle, number
        lgpio.gpiochip_close(handle)
    raise HalError(_not_found(numbers, refused))


def claim(
    call: Callable[[int, int, int], object], handle: int, chip: int, line: int, value: int
) -> None:
    """Claim a line with `call`, which is a function of lgpio. Raises HalError with the name of the
    line's holder."""
    try:
        call(handle, line, value)
    except lgpio.error as error:
        raise HalError(f"BCM{line}: {error.value}{_holder(handle, chip, line)}") from error


def _holder(handle: int, chip: int, line: int) -> str:
    """Name the holder of the line by the processes that have the chip open. If no process can be seen,
    return the kernel's label."""
    *_, label = lgpio.gpio_get_line_info(handle, line)
    if not label:
        return ""
    names = " or ".join(holders(Path(f"/dev/gpiochip{chip}"))) or repr(label)
    return f"; it is held by {names}: stop the holder, or take another pin"


def _open(chip: int, dev: Path) -> int:
    path = dev / f"gpiochip{chip}"
    try:
        handle: int = lgpio.gpiochip_open(chip)
    except lgpio.error as error:
        if not path.exists():
            why = "there is no such chip"
        elif not os.access(path, os.R_OK | os.W_OK):
            why = "no permission: the daemon's user must be in the group gpio"
        else:
            why = str(error.value)
        raise HalError(f"{path}: {why}") from error
    return handle


def _label(handle: int) -> str:
    *_, label = lgpio.gpio_get_chip_info(handle)
    return str(label)


def _not_found(numbers: Iterable[int], refused: list[str]) -> str:
    if refused:
        return "; ".join(refused)
    seen = ", ".join(f"gpiochip{n}" for n in numbers) or "no GPIO chip at all"
    return f"no chip has the label of a Raspberry Pi's header ({HEADER_LABEL}…); chips here: {seen}"
