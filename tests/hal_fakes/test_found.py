"""Check that each driver and each bus type has a fake, because `--simulate` needs these fakes."""

from importlib import import_module

import pytest

from bridges.kinds import kind_names
from bridges.settings import names as named
from hal_fakes.fake import Fake, Inside, Outside

DRIVERS = [(kind, name) for kind in kind_names() for name in named.driver_names(kind)]


@pytest.mark.parametrize(("kind", "driver"), DRIVERS)
def test_every_driver_has_a_fake(kind: str, driver: str) -> None:
    name = named.driver_called(kind, driver).fake or f"hal_fakes.plants.{kind}"
    assert isinstance(import_module(name).FAKE, Fake)


@pytest.mark.parametrize("bus", named.bus_types())
def test_every_bus_has_a_far_side(bus: str) -> None:
    assert isinstance(import_module(named.bus_called(bus).fake).FAKE, Inside | Outside)
