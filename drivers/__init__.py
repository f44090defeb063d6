"""Drivers: the meaning of a controller's signals. One file for each way of connecting a device.

A driver is the file `drivers/<kind>/<driver>.py`, named after the YAML's `kind:` and `driver:`. It ends
with a `DRIVER` (`drivers/driver_type.py`); the rest of the code uses nothing else of the file.
"""

from collections.abc import Callable, Mapping
from typing import Protocol, TypeVar, runtime_checkable

Sample = TypeVar("Sample", covariant=True)
Outputs = TypeVar("Outputs", contravariant=True)


class DriverError(Exception):
    """The controller did not answer, or its answer makes no sense. The text says what to check."""


class Driver(Protocol[Sample, Outputs]):
    """One device on one bus. Only the thread that owns the bus calls it.

    No call blocks longer than the bus's I/O timeout. Every method may raise DriverError and nothing
    else; the next call tries again, with the HAL's backoff.
    """

    def open(self) -> None:
        """Claim every output at its safe level. Called once, and again after a DriverError."""

    def read(self) -> Sample:
        """Read and decode every input once. Returns only fresh values. Raises DriverError."""

    def write(self, outputs: Outputs) -> None:
        """Set every output to this level. Cheap when nothing has changed since the last write."""

    def make_safe(self) -> None:
        """Switch every output off, even one believed off, and verify it where possible."""

    def close(self) -> None:
        """Switch every output off and release it. Does not raise."""


@runtime_checkable
class OnContacts(Protocol):
    """A driver on contacts, whose levels a person can check with a meter."""

    def contacts(self) -> Mapping[str, bool]:
        """Return signal -> asserted, as last read or written, for each known signal."""


@runtime_checkable
class TakesInputs(Protocol):
    """A driver that can take inputs from other buses than its own."""

    def take_inputs(self, elsewhere: Callable[[], Mapping[str, bool]]) -> None:
        """Read the inputs on other buses by `elsewhere`, which raises DriverError while they are not
        known."""
