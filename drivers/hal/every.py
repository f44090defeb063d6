"""Runs several steps. If a step fails, the later steps still run."""

from collections.abc import Iterator
from contextlib import contextmanager

from drivers.hal.points import HalError


class Every:
    """Steps that all run, even after a failure. Put `with every.one():` around each step, then call
    `check`. `failure` is the first HalError."""

    def __init__(self) -> None:
        self.failure: HalError | None = None

    @contextmanager
    def one(self) -> Iterator[None]:
        """Run one step. If the step raises a HalError, keep the error for `check`."""
        try:
            yield
        except HalError as error:
            self.failure = self.failure or error

    def check(self) -> None:
        """Raise the HalError of the first step that failed."""
        if self.failure is not None:
            raise self.failure
