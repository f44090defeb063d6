"""Tries several steps: if a step fails, the next steps are still tried."""

from collections.abc import Iterator
from contextlib import contextmanager

from drivers.hal.points import HalError


class Every:
    """`with every.one(): …` around each step, then `check`. `failure`: the first HalError."""

    def __init__(self) -> None:
        self.failure: HalError | None = None

    @contextmanager
    def one(self) -> Iterator[None]:
        """Run one step; keep its HalError for `check`."""
        try:
            yield
        except HalError as error:
            self.failure = self.failure or error

    def check(self) -> None:
        """Raise the first failure, if there was one."""
        if self.failure is not None:
            raise self.failure
