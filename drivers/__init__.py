"""Drivers: what a controller's signals mean. One file for each way of wiring a device.

A driver file is `drivers/<kind>/<driver>.py`, after the YAML's `kind:` and `driver:`, and ends with a
`DRIVER` (`drivers/driver_type.py`), by which everything else knows it.
"""

from typing import Protocol, TypeVar

Sample = TypeVar("Sample", covariant=True)
Outputs = TypeVar("Outputs", contravariant=True)


class DriverError(Exception):
    """The controller did not answer, or not with a meaning. The text says what to look at."""


class Driver(Protocol[Sample, Outputs]):
    """One device on one bus. Called from the thread that owns the bus, and from no other.

    No call blocks longer than the bus's I/O timeout. Every method may raise DriverError and nothing
    else; the next call tries again, with the HAL's backoff.
    """

    def open(self) -> None:
        """Claim every output at its safe level. Called once; again after a DriverError."""

    def read(self) -> Sample:
        """Read every input once and decode it. Never an old value: it is read, or it raises."""

    def write(self, outputs: Outputs) -> None:
        """Bring every output to this level. Cheap when nothing differs from what was written."""

    def make_safe(self) -> None:
        """Every output off, whatever was known. Returns when done and verified where it can be."""

    def close(self) -> None:
        """Outputs off and let go. Does not raise."""
