"""The pins of a process whose only task is to switch outputs off.

Without gpiozero the process makes the same lgpio calls as the daemon.
"""

import pytest

from drivers.hal.gpio import GpioBus, GpioSettings, open_bus, open_to_switch_off
from drivers.hal.points import HalError
from tests.drivers.hal.gpio.lgpio_stand_in import HANDLE, Call, StandIn

EDGES = ("gpio_claim_alert", "callback", "cancel")


def switched_off(bus: GpioBus) -> dict[str, bool]:
    lines = bus.lines({"BCM4": "down", "BCM5": None}, {"BCM17": True, "BCM18": False})
    lines.claim()
    lines.write({"BCM17": True, "BCM18": False})
    outputs = lines.outputs()
    lines.close()
    bus.close()
    return outputs


def test_every_call_but_those_for_edges_is_the_daemons(lgpio: StandIn) -> None:
    assert switched_off(open_bus(GpioSettings(chip=0))) == {"BCM17": True, "BCM18": False}
    daemons = [call for call in lgpio.claims() if call[0] not in EDGES]
    lgpio.calls.clear()
    assert switched_off(open_to_switch_off(GpioSettings(chip=0))) == {"BCM17": True, "BCM18": False}
    assert lgpio.claims() == daemons
    assert daemons[:3] == [
        ("gpiochip_open", 0),
        ("gpio_claim_output", HANDLE, 17, 1),
        ("gpio_claim_output", HANDLE, 18, 0),
    ]


def test_a_line_that_another_has_is_reported_with_its_holder_and_nothing_stays_claimed(
    lgpio: StandIn,
) -> None:
    lgpio.holders = {18: "lg"}
    lines = open_to_switch_off(GpioSettings(chip=0)).lines({}, {"BCM17": True, "BCM18": False})
    with pytest.raises(HalError, match=r"^BCM18: GPIO busy; it is held by 'lg': "):
        lines.claim()
    released: list[Call] = [("gpio_write", HANDLE, 17, 1), ("gpio_free", HANDLE, 17)]
    assert lgpio.calls[-2:] == released


def test_a_chip_that_fails_while_it_is_read_is_a_hal_error(lgpio: StandIn) -> None:
    lines = open_to_switch_off(GpioSettings(chip=0)).lines({}, {"BCM17": True})
    lines.claim()
    lgpio.broken = {"gpio_read"}
    with pytest.raises(HalError, match=r"^BCM17 = J8:11: broken$"):
        lines.outputs()


def test_a_chip_that_is_not_there_is_named(lgpio: StandIn) -> None:
    with pytest.raises(HalError, match=r"^/dev/gpiochip9: there is no such chip$"):
        open_to_switch_off(GpioSettings(chip=9))
