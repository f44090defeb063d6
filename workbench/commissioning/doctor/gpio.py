"""Examine the 40-pin header.

The examination finds the header's chip and the programs that hold its lines. The examination also tells
the levels of the outputs at boot and after a daemon's death.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from drivers.hal.gpio.header import canonical, describe
from drivers.hal.gpio.holders import holders
from drivers.hal.points import Wire
from drivers.unsafe import energised_at_boot
from workbench.commissioning.doctor.chips import Chip, chips, devices, line
from workbench.commissioning.doctor.finding import Finding, note, ok, warning, wrong
from workbench.commissioning.doctor.machine import Machine
from workbench.commissioning.doctor.users import User, group_of, join

GPIO: Final = "gpio"
BOOT: Final = "gpio at boot"
DEATH: Final = "gpio after a death"
BOARDS: Final = {
    "pinctrl-bcm2835": "a Raspberry Pi up to 3",
    "pinctrl-bcm2711": "a Raspberry Pi 4",
    "pinctrl-rp1": "a Raspberry Pi 5",
}
"""Chip label -> model of the board. Raspberry Pi's kernels give these labels to the header's chip."""
HEADER_LABEL: Final = "pinctrl-"
CONFIGS: Final = ("/boot/firmware/config.txt", "/boot/config.txt")
PERSIST: Final = (
    "/sys/module/pinctrl_bcm2835/parameters/persist_gpio_outputs",
    "/sys/module/pinctrl_rp1/parameters/persist_gpio_outputs",
)
ON: Final = "the relay is on until the daemon starts"
KILL_TEST: Final = "rmf-bridge doctor FILE --kill-test tests this with one output"


def gpio(machine: Machine, chip: int | None, who: User) -> Iterator[Finding]:
    """Examine whether the daemon may use the header's chip. `chip` is the chip's number in the YAML, or
    None if the YAML gives no number."""
    if not machine.installed("lgpio"):
        do = (
            "run sudo apt install python3-lgpio, or in the git clone of rmf-bridges run"
            " .venv/bin/pip install '.[gpio]'"
        )
        yield wrong(GPIO, "this Python has no lgpio", "no pin can be claimed", do)
    if not devices(machine):
        do = "run this on the Raspberry Pi; in a container, give it /dev/gpiochip0"
        yield wrong(GPIO, "there is no GPIO chip", "no pin can be claimed", do)
        return
    found = header(machine, chip)
    if found is None:
        yield _no_header(machine, chip)
        return
    board = BOARDS.get(found.label, "not a known Raspberry Pi")
    yield ok(GPIO, f"{found.device.name} is {found.label}, {board}, {found.lines} lines")
    if chip is not None and not found.label.startswith(HEADER_LABEL):
        yield warning(
            GPIO,
            f"the YAML names gpiochip{chip}, whose label is {found.label}",
            f"the header's label begins with {HEADER_LABEL}: this may be another chip",
            "delete chip:, and the daemon finds the header by its label",
        )
    yield _permission(machine, found, who)


def header(machine: Machine, chip: int | None) -> Chip | None:
    """Return the chip that the YAML names. If the YAML names no chip, return the chip with the header's
    label."""
    for one in chips(machine):
        if one.number == chip or (chip is None and one.label.startswith(HEADER_LABEL)):
            return one
    return None


def _no_header(machine: Machine, chip: int | None) -> Finding:
    seen = ", ".join(f"{one.device.name} ({one.label})" for one in chips(machine))
    if len(list(chips(machine))) < len(devices(machine)):
        names = ", ".join(device.name for device in devices(machine))
        do = "use sudo, or join the group gpio"
        text = f"there are {names}, but this user may open only: {seen or 'none of them'}"
        return wrong(GPIO, text, "nobody knows whether the header is there", do)
    text = f"no chip is {'the header' if chip is None else f'gpiochip{chip}'}; there is {seen}"
    return wrong(GPIO, text, "no pin can be claimed", "look at gpiodetect; on a Pi delete chip:")


def _permission(machine: Machine, chip: Chip, who: User) -> Finding:
    state = chip.device.stat()
    group = group_of(machine, state.st_gid)
    if who.may(state):
        return ok(GPIO, f"{who.name} may use {machine.named(chip.device)}")
    mode = f"mode {state.st_mode & 0o777:o}, group {group}"
    text = f"{who.name} may not use {machine.named(chip.device)} ({mode})"
    do = join(who, "gpio")
    if group != "gpio":
        do = 'a udev rule: SUBSYSTEM=="gpio", KERNEL=="gpiochip*", GROUP="gpio", MODE="0660"'
    return wrong(GPIO, text, "the daemon cannot claim a pin", do)


def lines(machine: Machine, chip: Chip, wires: Iterable[Wire]) -> Iterator[Finding]:
    """Find other programs that hold these pins. A caller must make sure that no daemon runs."""
    free = True
    for wire in wires:
        try:
            now = line(machine, chip, _offset(wire))
        except OSError as error:
            found = f"{describe(wire.point)} ({wire.signal}) cannot be examined: {error.strerror}"
            yield note(
                GPIO, found, "the holder of the pin is not known", "use a kernel of 5.10 or newer"
            )
            return
        if now.consumer:
            free = False
            names = " or ".join(holders(chip.device, machine.at("/proc"))) or repr(now.consumer)
            found = f"{describe(wire.point)} ({wire.signal}) is held by {names}"
            do = "stop that program or take its overlay out of config.txt; or use another pin"
            yield wrong(GPIO, found, "the daemon cannot claim the pin", do)
    if free:
        yield ok(GPIO, "no other program holds a pin of this file")


def boot(machine: Machine, wires: Iterable[Wire], accepted: Mapping[str, str]) -> Iterator[Finding]:
    """Examine `gpio at boot`: find relays that are on between power-on and the daemon's start."""
    firmware, off = _firmware(machine), list[str]()
    for wire in (wire for wire in wires if wire.direction == "out"):
        level = firmware.get(_offset(wire))
        unsafe = [text for _, _, text in energised_at_boot([wire])]
        if level is not None and wire.asserted(level):
            found = f"config.txt drives {describe(wire.point)} so that {wire.signal} is on at boot"
            yield wrong(BOOT, found, ON, f"{_safe_line(wire)}, and reboot")
        elif unsafe and level is None:
            reason = accepted.get(wire.signal)
            found = f"{wire.signal}: {unsafe[0]}" + (f"; accepted: {reason}" if reason else "")
            do = f"{_safe_line(wire)}, and a resistor to the safe level"
            yield warning(BOOT, found, ON, do)
        else:
            off.append(wire.signal)
    if off:
        yield ok(BOOT, f"off from power-on: {', '.join(off)}")


def _safe_line(wire: Wire) -> str:
    return f"gpio={_offset(wire)}=op,{'dl' if wire.active == 'high' else 'dh'} in config.txt"


def _firmware(machine: Machine) -> dict[int, bool]:
    """Return BCM number -> level at boot (True is high). Lines of config.txt such as `gpio=18=op,dl`
    set the level."""
    levels: dict[int, bool] = {}
    for text in filter(None, map(machine.text, CONFIGS)):
        for pins, options in re.findall(r"^\s*gpio=([0-9,-]+)=(\S+)", text, re.MULTILINE):
            words = options.split(",")
            level = {"dh": True, "dl": False}.get(next((w for w in words if w in ("dh", "dl")), ""))
            if "op" in words and level is not None:
                levels |= dict.fromkeys(_pins(pins), level)
            elif "ip" in words:
                levels = {pin: old for pin, old in levels.items() if pin not in set(_pins(pins))}
    return levels


def _pins(text: str) -> Iterator[int]:
    for part in filter(None, text.split(",")):
        first, _, last = part.partition("-")
        if first.isdecimal() and (last or first).isdecimal():
            yield from range(int(first), int(last or first) + 1)


def death(machine: Machine) -> Iterator[Finding]:
    """Examine whether the kernel still drives an output after the output's holder died."""
    said = next(filter(None, map(machine.text, PERSIST)), "")
    strict = any(
        re.search(r"^\s*dtparam=.*\bstrict_gpiod\b", machine.text(path) or "", re.MULTILINE)
        for path in CONFIGS
    )
    means = "after a kill -9 a relay stays on until outputs-off succeeds, or for ever"
    if said in ("Y", "1"):
        do = "dtparam=strict_gpiod in /boot/firmware/config.txt, and reboot"
        if strict:
            do = "reboot: strict_gpiod is in config.txt, but not yet in effect"
        yield warning(DEATH, "the kernel keeps an output's level", means, f"{do}. {KILL_TEST}")
    elif said in ("N", "0"):
        yield ok(DEATH, f"the kernel turns a released output into an input. {KILL_TEST}")
    else:
        found = "nobody knows whether the kernel keeps an output's level"
        yield warning(DEATH, found, means, KILL_TEST)


def _offset(wire: Wire) -> int:
    return int(canonical(wire.point).removeprefix("BCM"))
