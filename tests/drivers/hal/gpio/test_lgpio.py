"""The pin factory for real hardware. A stand-in records each lgpio call of the factory."""

import os
import sys
from pathlib import Path

import pytest

from drivers import DriverError
from drivers.hal.gpio import GpioBus, GpioSettings, open_bus
from drivers.hal.points import HalError, Points, Wire
from tests.drivers.hal.gpio.conftest import forget
from tests.drivers.hal.gpio.lgpio_stand_in import HANDLE, StandIn


def header(chip: int = 0) -> GpioBus:
    return open_bus(GpioSettings(chip=chip))


def test_an_active_low_output_is_claimed_once_at_high_and_never_clicks(lgpio: StandIn) -> None:
    bus = header()
    lines = bus.lines({}, {"BCM17": True})
    lines.claim()
    assert lgpio.claims() == [("gpiochip_open", 0), ("gpio_claim_output", HANDLE, 17, 1)]
    bus.close()


def test_an_active_high_output_is_claimed_once_at_low(lgpio: StandIn) -> None:
    bus = header()
    lines = bus.lines({}, {"BCM18": False})
    lines.claim()
    assert lgpio.claims() == [("gpiochip_open", 0), ("gpio_claim_output", HANDLE, 18, 0)]
    bus.close()


def test_from_claim_to_close_lgpio_gets_exactly_these_calls(lgpio: StandIn) -> None:
    bus = header()
    lines = bus.lines(
        {"BCM4": "down", "BCM2": "up", "BCM5": "none"}, {"BCM18": False, "BCM7": True}
    )
    lines.claim()
    lines.write({"BCM18": True})
    lgpio.levels[4] = 1
    levels = lines.read()
    outputs = lines.outputs()
    lines.close()
    bus.close()
    assert (levels, outputs) == (
        {"BCM4": True, "BCM2": False, "BCM5": False},
        {"BCM18": True, "BCM7": True},
    )
    assert lgpio.claims() == [
        ("gpiochip_open", 0),
        ("gpio_claim_output", HANDLE, 18, 0),
        ("gpio_claim_output", HANDLE, 7, 1),
        ("gpio_claim_input", HANDLE, 4, lgpio.SET_PULL_DOWN),
        ("gpio_claim_alert", HANDLE, 4, lgpio.BOTH_EDGES, lgpio.SET_PULL_DOWN),
        ("callback", HANDLE, 4, lgpio.BOTH_EDGES),
        ("gpio_claim_input", HANDLE, 2, lgpio.SET_PULL_UP),
        ("gpio_claim_alert", HANDLE, 2, lgpio.BOTH_EDGES, lgpio.SET_PULL_UP),
        ("callback", HANDLE, 2, lgpio.BOTH_EDGES),
        ("gpio_claim_input", HANDLE, 5, lgpio.SET_PULL_NONE),
        ("gpio_claim_alert", HANDLE, 5, lgpio.BOTH_EDGES, lgpio.SET_PULL_NONE),
        ("callback", HANDLE, 5, lgpio.BOTH_EDGES),
        ("gpio_write", HANDLE, 18, 1),
        ("gpio_read", HANDLE, 4),
        ("gpio_read", HANDLE, 2),
        ("gpio_read", HANDLE, 5),
        ("gpio_read", HANDLE, 18),
        ("gpio_read", HANDLE, 7),
        ("gpio_write", HANDLE, 18, 0),
        ("gpio_free", HANDLE, 18),
        ("gpio_write", HANDLE, 7, 1),
        ("gpio_free", HANDLE, 7),
        ("cancel", 4),
        ("gpio_free", HANDLE, 4),
        ("cancel", 2),
        ("gpio_free", HANDLE, 2),
        ("cancel", 5),
        ("gpio_free", HANDLE, 5),
        ("gpiochip_close", HANDLE),
    ]


def test_a_bus_that_is_closed_leaves_every_output_safe(lgpio: StandIn) -> None:
    bus = header()
    lines = bus.lines({}, {"BCM18": False, "BCM7": True})
    lines.claim()
    lines.write({"BCM18": True, "BCM7": False})
    bus.close()
    bus.close()
    assert (lgpio.levels[18], lgpio.levels[7]) == (0, 1)
    assert lgpio.claims()[-1] == ("gpiochip_close", HANDLE)


def test_an_edge_wakes_whoever_asked(lgpio: StandIn) -> None:
    bus = header()
    lines = bus.lines({"BCM4": "down"}, {})
    lines.claim()
    lgpio.edges[4](0, 4, 1, 0)  # without a listener nothing happens
    woken = []
    bus.on_edge(lambda: woken.append("woken"))
    lgpio.edges[4](0, 4, 0, 1)
    assert woken == ["woken"]
    bus.close()


def test_a_pin_that_another_program_holds_is_named_with_its_holder(lgpio: StandIn) -> None:
    lgpio.holders[23] = "gpiomon"
    bus = header()
    lines = bus.lines({"BCM4": "down"}, {"BCM22": False, "BCM23": False})
    with pytest.raises(HalError) as refused:
        lines.claim()
    assert str(refused.value) == (
        "BCM23: GPIO busy; it is held by 'gpiomon': stop the holder, or take another pin"
    )
    bus.close()


def test_a_claim_that_fails_half_way_lets_go_of_all_and_can_be_tried_again(lgpio: StandIn) -> None:
    lgpio.holders[23] = "gpiomon"
    bus = header()
    lines = bus.lines({"BCM4": "down"}, {"BCM22": False, "BCM23": True})
    with pytest.raises(
        HalError
    ) as refused:  # the error in `refused` keeps the half-made object alive
        lines.claim()
    with pytest.raises(HalError, match="BCM4 = J8:7 is not claimed"):
        lines.read()
    assert lgpio.claims() == [
        ("gpiochip_open", 0),
        ("gpio_claim_output", HANDLE, 22, 0),
        ("gpio_claim_output", HANDLE, 23, 1),
        ("gpio_write", HANDLE, 22, 0),
        ("gpio_free", HANDLE, 22),
    ]
    del lgpio.holders[23]
    lines.claim()
    assert (lines.read(), lines.outputs()) == ({"BCM4": False}, {"BCM22": False, "BCM23": True})
    assert str(refused.value)
    bus.close()


def test_claiming_again_after_a_failed_write_goes_through_the_safe_level(lgpio: StandIn) -> None:
    bus = header()
    lines = bus.lines({}, {"BCM22": False})
    lines.claim()
    lgpio.broken.add("gpio_write")
    with pytest.raises(HalError, match=r"^BCM22 = J8:15: broken$"):
        lines.write({"BCM22": True})
    lgpio.broken.clear()
    lgpio.calls.clear()
    lines.claim()
    assert lgpio.claims() == [
        ("gpio_write", HANDLE, 22, 0),
        ("gpio_free", HANDLE, 22),
        ("gpio_claim_output", HANDLE, 22, 0),
    ]
    bus.close()


def test_one_output_that_cannot_be_made_safe_does_not_keep_the_others_on(lgpio: StandIn) -> None:
    bus = header()
    lines = bus.lines({}, {"BCM22": False, "BCM23": False})
    lines.claim()
    lines.write({"BCM22": True, "BCM23": True})
    lgpio.broken.add("gpio_write")
    lgpio.calls.clear()
    lines.close()
    assert lgpio.claims() == [("gpio_write", HANDLE, 22, 0), ("gpio_write", HANDLE, 23, 0)]
    lgpio.broken.clear()
    bus.close()


def test_an_output_that_reads_back_on_after_make_safe_is_an_error(
    lgpio: StandIn, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus = header()
    points = Points([Wire("call", "out", "BCM22", "high"), Wire("hold", "out", "BCM7", "low")], bus)
    points.open()
    points.make_safe()
    monkeypatch.setattr(lgpio, "gpio_read", lambda handle, gpio: 1)
    with pytest.raises(DriverError, match=r"^still on after being switched off: call$"):
        points.make_safe()
    bus.close()


def test_a_failed_read_names_the_pin(lgpio: StandIn) -> None:
    bus = header()
    lines = bus.lines({"BCM4": "down"}, {})
    lines.claim()
    lgpio.broken.add("gpio_read")
    with pytest.raises(HalError, match=r"^BCM4 = J8:7: broken$"):
        lines.read()
    lgpio.broken.clear()
    bus.close()


def dev(tmp_path: Path, *chips: int) -> Path:
    for chip in chips:
        (tmp_path / f"gpiochip{chip}").touch()
    return tmp_path


def test_the_headers_chip_is_found_by_its_label(lgpio: StandIn, tmp_path: Path) -> None:
    lgpio.chips = {0: "gpio-brcmstb@107d508500", 4: "pinctrl-rp1", 10: "pinctrl-late"}
    from drivers.hal.gpio.pins import open_factory

    factory = open_factory(None, dev(tmp_path, 0, 4, 10))
    assert (factory.chip, lgpio.calls) == (
        4,
        [
            ("gpiochip_open", 0),
            ("gpio_get_chip_info", HANDLE),
            ("gpiochip_close", HANDLE),
            ("gpiochip_open", 4),
            ("gpio_get_chip_info", HANDLE + 4),
        ],
    )
    factory.close()


@pytest.mark.parametrize(
    ("chips", "present", "text"),
    [
        (
            {},
            (),
            "no chip has the label of a Raspberry Pi's header (pinctrl-…); chips here: no GPIO"
            " chip at all",
        ),
        (
            {0: "gpio-mockup", 1: "gpio-ich"},
            (0, 1),
            "no chip has the label of a Raspberry Pi's header (pinctrl-…); chips here: gpiochip0,"
            " gpiochip1",
        ),
        ({}, (3,), "{dev}/gpiochip3: can not open gpiochip"),
    ],
)
def test_a_machine_without_a_header_is_reported(
    lgpio: StandIn, tmp_path: Path, chips: dict[int, str], present: tuple[int, ...], text: str
) -> None:
    lgpio.chips = chips
    from drivers.hal.gpio.pins import open_factory

    with pytest.raises(HalError) as refused:
        open_factory(None, dev(tmp_path, *present))
    assert str(refused.value) == text.format(dev=tmp_path)


def test_a_chip_that_may_not_be_opened_asks_for_the_group(
    lgpio: StandIn, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lgpio.chips = {}
    from drivers.hal.gpio import pins

    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(HalError) as refused:
        pins.open_factory(0, dev(tmp_path, 0))
    assert str(refused.value) == (
        f"{tmp_path}/gpiochip0: no permission: the daemon's user must be in the group gpio"
    )


def test_a_chip_that_does_not_exist_is_named(lgpio: StandIn) -> None:
    with pytest.raises(HalError, match=r"^/dev/gpiochip200: there is no such chip$"):
        header(chip=200)


def test_without_lgpio_the_error_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "lgpio", None)
    forget()
    with pytest.raises(HalError) as refused:
        header()
    assert "apt install python3-lgpio" in str(refused.value)
    assert "--simulate" in str(refused.value)


def test_a_working_directory_that_lgpio_cannot_write_in_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lgpio.py").write_text('raise FileNotFoundError(2, "No such file", ".lgd-nfy-3")')
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "lgpio", raising=False)
    forget()
    with pytest.raises(HalError, match=r"^lgpio cannot write in the working directory: .*lgd-nfy"):
        header()
