"""Makes the fixture `module` available to the tests in this folder. The fixture is a Modbus I/O module
on a real connection."""

from tests.runtime.conftest import module

__all__ = ["module"]
