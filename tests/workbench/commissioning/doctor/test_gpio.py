"""The doctor's findings about the GPIO headers of made-up Raspberry Pis."""

import ctypes
from pathlib import Path

import pytest

from drivers.hal.points import Wire
from tests.workbench.commissioning.doctor.kernel_gpio import (
    GET_CHIPINFO,
    GET_LINEINFO,
    GpiochipInfo,
    LineInfo,
)
from tests.workbench.commissioning.doctor.made_up import OTHERS, OURS, MadeUp
from workbench.commissioning.doctor.chips import CHIP, CHIP_INFO, LINE, LINE_INFO, line
from workbench.commissioning.doctor.finding import Finding, ok
from workbench.commissioning.doctor.gpio import boot, death, gpio, header, lines

CALL = Wire("call_L1", "out", "BCM18", "high")
ALARM = Wire("fire_alarm", "in", "J8:7", "low", "down")
RELAY = Wire("door_open", "out", "BCM23", "low")
PERSIST = "/sys/module/pinctrl_bcm2835/parameters/persist_gpio_outputs"
CONFIG = "/boot/firmware/config.txt"


@pytest.fixture
def made(tmp_path: Path) -> MadeUp:
    return MadeUp(tmp_path)


def told(findings: list[Finding]) -> list[tuple[str, str]]:
    return [(one.level, one.found) for one in findings]


def test_the_requests_to_the_kernel_are_those_of_its_header() -> None:
    assert (GET_CHIPINFO, GET_LINEINFO) == (CHIP_INFO, LINE_INFO) == (0x8044B401, 0xC100B405)
    sizes = [ctypes.sizeof(GpiochipInfo), ctypes.sizeof(LineInfo)]
    assert sizes == [CHIP.size, LINE.size] == [68, 256]
    assert (LineInfo.flags.offset, LineInfo.attrs.offset) == (72, 80)


@pytest.mark.parametrize(
    ("label", "board"),
    [
        ("pinctrl-bcm2835", "a Raspberry Pi up to 3"),
        ("pinctrl-bcm2711", "a Raspberry Pi 4"),
        ("pinctrl-rp1", "a Raspberry Pi 5"),
    ],
)
def test_the_header_is_found_by_its_label(made: MadeUp, label: str, board: str) -> None:
    made.chip(0, "brcmvirt-gpio")
    made.chip(11, label)
    assert list(gpio(made.machine, None, made.user)) == [
        ok("gpio", f"gpiochip11 is {label}, {board}, 58 lines"),
        ok("gpio", "pi may use /dev/gpiochip11"),
    ]


def test_another_chip_by_number_is_warned_of(made: MadeUp) -> None:
    made.chip(0, "pinctrl-rp1")
    made.chip(1, "raspberrypi-exp-gpio")
    found = list(gpio(made.machine, 1, made.user))
    assert told(found)[1] == (
        "warning",
        "the YAML names gpiochip1, whose label is raspberrypi-exp-gpio",
    )


def test_a_machine_without_the_header_or_the_library_is_wrong(tmp_path: Path) -> None:
    made = MadeUp(tmp_path, installed=[])
    assert told(list(gpio(made.machine, None, made.user))) == [
        ("wrong", "this Python has no lgpio"),
        ("wrong", "there is no GPIO chip"),
    ]
    made.chip(0, "gpio-sim")
    assert told(list(gpio(made.machine, None, made.user)))[1:] == [
        ("wrong", "no chip is the header; there is gpiochip0 (gpio-sim)")
    ]


def test_a_user_outside_the_group_may_not_claim_a_pin(tmp_path: Path) -> None:
    made = MadeUp(tmp_path, gids=[OTHERS])
    made.write("/etc/group", f"gpio:x:{OURS}:\n")
    made.chip(0, "pinctrl-bcm2711")
    _, found = gpio(made.machine, None, made.user)
    assert (found.level, found.found, found.do) == (
        "wrong",
        "pi may not use /dev/gpiochip0 (mode 660, group gpio)",
        "sudo usermod -aG gpio pi, then log in again",
    )


def test_a_chip_in_another_group_needs_a_udev_rule(tmp_path: Path) -> None:
    made = MadeUp(tmp_path, gids=[OTHERS])
    made.write("/etc/group", "gpio:x:990:\n")
    made.chip(0, "pinctrl-bcm2711", mode=0o600)
    _, found = gpio(made.machine, None, made.user)
    assert (found.level, found.do.partition(":")[0]) == ("wrong", "a udev rule")


def test_a_pin_that_another_program_holds_is_named(made: MadeUp) -> None:
    made.chip(0, "pinctrl-bcm2711", held={18: "spi0 CS1"})
    chip = header(made.machine, None)
    assert chip is not None
    made.write("/proc/1/cmdline")
    assert told(list(lines(made.machine, chip, [CALL, ALARM]))) == [
        ("wrong", "BCM18 = J8:12 (call_L1) is held by 'spi0 CS1'")
    ]
    assert told(list(lines(made.machine, chip, [ALARM]))) == [
        ("ok", "no other program holds a pin of this file")
    ]


def test_a_doctor_without_permission_for_the_chip_says_so_and_judges_nothing_on_it(
    made: MadeUp,
) -> None:
    made.chip(0, "pinctrl-rp1")
    made.chip(10, "gpio-brcmstb@107d508500")
    made.hidden = {"gpiochip0"}
    assert list(gpio(made.machine, None, made.user)) == [
        Finding(
            "gpio",
            "wrong",
            "there are gpiochip0, gpiochip10, but this user may open only:"
            " gpiochip10 (gpio-brcmstb@107d508500)",
            "nobody knows whether the header is there",
            "use sudo, or join the group gpio",
        )
    ]


def test_a_pin_in_use_without_a_name_is_held_by_somebody(made: MadeUp) -> None:
    made.chip(4, "pinctrl-rp1", held={18: ""})
    chip = header(made.machine, None)
    assert chip is not None
    made.write("/proc/1/cmdline")
    assert told(list(lines(made.machine, chip, [CALL]))) == [
        ("wrong", "BCM18 = J8:12 (call_L1) is held by 'somebody'")
    ]


def test_a_line_shows_whether_it_is_driven(made: MadeUp) -> None:
    made.chip(0, "pinctrl-bcm2711", outputs=[18])
    chip = header(made.machine, None)
    assert chip is not None
    assert [line(made.machine, chip, n).output for n in (17, 18)] == [False, True]


def test_outputs_that_the_boot_leaves_off_are_well(made: MadeUp) -> None:
    assert told(list(boot(made.machine, [CALL, ALARM], {}))) == [
        ("ok", "off from power-on: call_L1")
    ]


def test_an_accepted_relay_that_is_on_at_boot_is_warned_of(made: MadeUp) -> None:
    (found,) = boot(made.machine, [RELAY], {"door_open": "the contactor is supplied later"})
    assert found.level == "warning"
    assert found.found.endswith("; accepted: the contactor is supplied later")
    assert found.do == "gpio=23=op,dh in config.txt, and a resistor to the safe level"


@pytest.mark.parametrize("line", ["gpio=23=op,dh", "  gpio=20-24=op,pn,dh", "gpio=4,23=op,dh"])
def test_the_firmware_can_switch_a_relay_off_at_boot(made: MadeUp, line: str) -> None:
    made.write(CONFIG, f"# gpio=23=op,dl\n{line}\n")
    assert told(list(boot(made.machine, [RELAY], {}))) == [("ok", "off from power-on: door_open")]


def test_the_firmware_can_switch_a_relay_on_at_boot(made: MadeUp) -> None:
    made.write(CONFIG, "gpio=18=op,dh\n")
    (found,) = boot(made.machine, [CALL], {})
    assert (found.level, found.do) == ("wrong", "gpio=18=op,dl in config.txt, and reboot")


@pytest.mark.parametrize(
    ("said", "config", "level", "do"),
    [
        ("Y\n", "", "warning", "dtparam=strict_gpiod in /boot/firmware/config.txt, and reboot"),
        ("Y\n", "dtparam=i2c_arm=on,strict_gpiod\n", "warning", "reboot: strict_gpiod is in"),
        ("N\n", "dtparam=strict_gpiod\n", "ok", ""),
        ("", "", "warning", "rmf-bridge doctor FILE --kill-test"),
    ],
)
def test_it_says_whether_the_kernel_keeps_outputs_after_a_death(
    made: MadeUp, said: str, config: str, level: str, do: str
) -> None:
    made.write(PERSIST, said)
    made.write(CONFIG, config)
    (found,) = death(made.machine)
    assert (found.level, found.do.startswith(do)) == (level, True)
