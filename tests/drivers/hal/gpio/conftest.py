"""A stand-in for lgpio. The tests use it to run the pin factory for real hardware."""

import sys
from collections.abc import Iterator

import pytest

import drivers.hal.gpio
from tests.drivers.hal.gpio.lgpio_stand_in import StandIn


@pytest.fixture
def lgpio(monkeypatch: pytest.MonkeyPatch) -> Iterator[StandIn]:
    """Yield a stand-in for lgpio. The pin factory for real hardware imports the stand-in."""
    stand_in = StandIn()
    monkeypatch.setitem(sys.modules, "lgpio", stand_in)
    forget()
    yield stand_in
    forget()


def forget() -> None:
    """Remove every module that imports lgpio from `sys.modules`."""
    sys.modules.pop("gpiozero.pins.lgpio", None)
    for name in ("pins", "bare", "chip"):
        sys.modules.pop(f"drivers.hal.gpio.{name}", None)
        vars(drivers.hal.gpio).pop(name, None)
