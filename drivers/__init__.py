"""Drivers translate between a controller's signals and the values that the daemon uses. There is one
file for each way to connect a device.

A driver is the file `drivers/<kind>/<driver>.py`. The YAML's `kind:` and `driver:` give this path. The
file's last statement defines `DRIVER` (`drivers/driver_type.py`). The rest of the code uses only this
`DRIVER`.
"""

from collections.abc import Callable, Mapping
from typing import Protocol, TypeVar, runtime_checkable

Sample = TypeVar("Sample", covariant=True)
Outputs = TypeVar("Outputs", contravariant=True)


class DriverError(Exception):
    """The error of a controller that does not answer, or whose answer makes no sense. The error's text
    tells the reader which parts to check."""


class Driver(Protocol[Sample, Outputs]):
    """One device on one bus. Only the thread that owns the bus calls the methods.

    No call blocks longer than the bus's I/O timeout. A method may raise DriverError, and raises no
    other error. After an error the next call tries again, except during the bus's backoff.
    """

    def open(self) -> None:
        """Claim every output at its safe level. The loop calls `open` at the start, and again after
        each DriverError."""

    def read(self) -> Sample:
        """Read and decode every input. Do not return values of an earlier call. Raises DriverError."""

    def write(self, outputs: Outputs) -> None:
        """Set every output to its level in `outputs`. The call is cheap if no level has changed."""

    def make_safe(self) -> None:
        """Switch every output off, even if the driver believes that the output is off. Read each output
        back where the hardware allows this."""

    def close(self) -> None:
        """Switch every output off, and release the outputs. Does not raise."""


@runtime_checkable
class OnContacts(Protocol):
    """A driver for a device that is connected by contacts. A person can check the contacts' levels with
    a meter."""

    def contacts(self) -> Mapping[str, bool]:
        """Return whether each signal is asserted, from the last reading or writing. Leave out signals
        that are not known yet."""


@runtime_checkable
class TakesInputs(Protocol):
    """A driver that can take inputs from buses other than its own bus."""

    def take_inputs(self, elsewhere: Callable[[], Mapping[str, bool]]) -> None:
        """Let the driver call `elsewhere` for the inputs on other buses. `elsewhere` raises DriverError
        while these inputs are unknown."""
