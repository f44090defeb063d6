"""Runs several steps. If a step fails, the later steps still run."""

from collections.abc import Iterator
from contextlib import contextmanager

from drivers import DriverError


class Every:
    """Steps that all run, even after a failure. Put `with every.one():` around each step, then call
    `check`. `failure` is the first DriverError."""

    def __init__(self) -> None:
        self.failure: DriverError | None = None

    @contextmanager
    def one(self) -> Iterator[None]:
        """Run one step. If the step raises a DriverError, keep the error for `check`."""
        try:
            yield
        except DriverError as error:
            self.failure = self.failure or error

    def check(self) -> None:
        """Raise the DriverError of the first step that failed."""
        if self.failure is not None:
            raise self.failure
