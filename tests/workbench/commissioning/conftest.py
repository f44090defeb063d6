"""The module on the wall of the daemon's tests, for commands that act on real wires."""

from tests.runtime.conftest import module

__all__ = ["module"]
