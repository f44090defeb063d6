"""Drivers, which give a controller's signals their meaning. Each way of connecting a device has a file.

A driver is the file `drivers/<kind>/<driver>.py`, named after `kind:` and `driver:` in the YAML. Its
last statement defines `DRIVER` (`drivers/driver_type.py`). The rest of the code uses only this
`DRIVER`.
"""

from collections.abc import Callable, Mapping
from typing import Protocol, TypeVar, runtime_checkable

Sample = TypeVar("Sample", covariant=True)
Outputs = TypeVar("Outputs", contravariant=True)


class DriverError(Exception):
    """The error of a controller that does not answer, or answers nonsense. Its text says what to
    check."""


class Driver(Protocol[Sample, Outputs]):
    """One device on one bus. Only the thread that owns the bus calls the methods.

    No call blocks longer than the bus's I/O timeout. Every method may raise DriverError and nothing
    else. After an error the next call tries again, unless the bus's backoff still runs.
    """

    def open(self) -> None:
        """Claim every output at its safe level. The loop calls `open` at the start and after each
        DriverError."""

    def read(self) -> Sample:
        """Read and decode every input once. Return only values of this reading. Raises DriverError."""

    def write(self, outputs: Outputs) -> None:
        """Set every output to its level in `outputs`. The call is cheap if no level has changed."""

    def make_safe(self) -> None:
        """Switch every output off, even an output that is believed off. Verify each where possible."""

    def close(self) -> None:
        """Switch every output off, and release the outputs. Does not raise."""


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
