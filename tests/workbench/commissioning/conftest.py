"""The daemon tests' module on the wall, for commands that act on real wires."""

from tests.runtime.conftest import module

__all__ = ["module"]
