"""The Modbus module of the daemon tests, for commands that act on real wires."""

from tests.runtime.conftest import module

__all__ = ["module"]
