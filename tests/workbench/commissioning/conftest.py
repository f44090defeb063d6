"""Fixtures of the daemon tests: a Modbus module for commands on real wires."""

from tests.runtime.conftest import module

__all__ = ["module"]
