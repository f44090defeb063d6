"""Fixtures that close modules and buses after each test."""

from collections.abc import Iterator

import pytest

from tests.drivers.hal.modbus.line import SerialModule
from tests.drivers.hal.modbus.module import Module, opened


@pytest.fixture
def module() -> Iterator[Module]:
    """Yield a module that answers according to the Modbus specification."""
    started = Module()
    yield started
    started.close()


@pytest.fixture(params=[Module, SerialModule], ids=["tcp", "rtu"])
def either(request: pytest.FixtureRequest) -> Iterator[Module]:
    """Yield a module. Each test runs twice, once on TCP and once on a serial line."""
    started: Module = request.param()
    yield started
    started.close()


@pytest.fixture
def line() -> Iterator[SerialModule]:
    """Yield a module on a serial line."""
    started = SerialModule()
    yield started
    started.close()


@pytest.fixture(autouse=True)
def hang_up() -> Iterator[None]:
    """Close every bus after the test."""
    yield
    while opened:
        opened.pop().close()
