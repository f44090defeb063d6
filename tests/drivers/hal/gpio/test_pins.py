"""Names of pins, and impossible wirings of pins."""

import re
from typing import Any

import pytest

from drivers.hal.gpio import J8, boot_level, canonical, describe, wire_problems
from drivers.hal.points import Wire


def wire(point: str, direction: Any = "in", pull: Any = None) -> Wire:
    return Wire("signal", direction, point, "high", pull)


def test_both_spellings_of_every_pin_are_the_same_pin() -> None:
    assert {canonical(f"J8:{position}") for position in J8} == {f"BCM{n}" for n in range(28)}
    assert all(canonical(f"BCM{n}") == f"BCM{n}" for n in range(28))


def test_the_table_is_that_of_gpiozero() -> None:
    from gpiozero.pins.data import PLUS_J8

    gpio = {at: next(iter(f.values())) for at, f in PLUS_J8[2].items() if "gpio" in f}
    assert {at: f"GPIO{number}" for at, number in J8.items()} == gpio


def test_a_pin_is_shown_with_both_names() -> None:
    assert (describe("J8:7"), describe("BCM4")) == ("BCM4 = J8:7", "BCM4 = J8:7")


@pytest.mark.parametrize(
    ("point", "text"),
    [
        ("17", "'17' may be a position or a BCM number: write BCM17 or J8:17"),
        ("GPIO17", "'GPIO17' is not a pin's name: write BCM17"),
        ("bcm 4", "'bcm 4' is not a pin's name: write BCM4"),
        ("BCM04", "'BCM04' is not a pin's name: write BCM4"),
        ("BCM28", "BCM28 is not on the 40-pin header, which has BCM0 to BCM27"),
        ("J8:1", "J8:1 is 3.3 V, not a GPIO pin"),
        ("J8:4", "J8:4 is 5 V, not a GPIO pin"),
        ("J8:39", "J8:39 is ground, not a GPIO pin"),
        ("J8:41", "J8:41 does not exist: the header has positions 1 to 40"),
        (
            "unit 1 coil 0",
            "'unit 1 coil 0' is not a pin: write BCM17, or J8:11 for a position on the header",
        ),
        ("", "'' is not a pin: write BCM17, or J8:11 for a position on the header"),
        ("J8:", "'J8:' is not a pin: write BCM17, or J8:11 for a position on the header"),
        (
            "BCM1١",
            "'BCM1١' is not a pin: write BCM17, or J8:11 for a position on the header",
        ),
        ("BCM١", "'BCM١' is not a pin: write BCM17, or J8:11 for a position on the header"),
    ],
)
def test_anything_else_is_refused_with_what_to_write(point: str, text: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(text)}$"):
        canonical(point)


def test_pins_are_pulled_up_to_bcm8_and_down_from_bcm9_until_they_are_claimed() -> None:
    assert [n for n in range(28) if boot_level(f"BCM{n}")] == list(range(9))


@pytest.mark.parametrize(
    ("checked", "texts"),
    [
        (wire("BCM4", pull="up"), []),
        (wire("BCM4", pull="none"), []),
        (
            wire("BCM4"),
            ["pull is missing: write up, down, or none where an external resistor is fitted"],
        ),
        (wire("J8:3", pull="up"), []),
        (
            wire("J8:3", pull="down"),
            ["BCM2 has a fixed 1.8 kΩ pull-up: write pull: up, or use another pin"],
        ),
        (
            wire("J8:5", pull="none"),
            ["BCM3 has a fixed 1.8 kΩ pull-up: write pull: up, or use another pin"],
        ),
        (wire("BCM18", "out"), []),
        (wire("BCM18", "out", pull="up"), ["an output has no pull"]),
        (
            wire("BCM1", "out"),
            ["BCM1 is for a HAT's EEPROM, and the firmware drives it at boot: use another pin"],
        ),
        (wire("18"), []),
    ],
)
def test_an_impossible_wire_is_reported_with_the_reason(checked: Wire, texts: list[str]) -> None:
    assert list(wire_problems(checked)) == texts


def test_the_table_needs_no_vendor_library() -> None:
    import subprocess
    import sys

    code = (
        "import sys, drivers.hal.gpio, drivers.lift.dry_contact;"
        "sys.exit(bool({'gpiozero', 'lgpio', 'pymodbus'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=30).returncode == 0
