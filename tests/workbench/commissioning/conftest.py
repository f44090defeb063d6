"""A fixture of the daemon tests: the Modbus module, for commands that act on real wires."""

from tests.runtime.conftest import module

__all__ = ["module"]
