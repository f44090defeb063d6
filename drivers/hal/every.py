"""Several things of which each is tried, whatever becomes of the others."""

from collections.abc import Iterator
from contextlib import contextmanager

from drivers.hal.points import HalError


class Every:
    """`with every.one(): …` for each; then `check`. `failure`: the first."""

    def __init__(self) -> None:
        self.failure: HalError | None = None

    @contextmanager
    def one(self) -> Iterator[None]:
        """One of them, whose HalError waits."""
        try:
            yield
        except HalError as error:
            self.failure = self.failure or error

    def check(self) -> None:
        """Raises the first failure, if there was one."""
        if self.failure is not None:
            raise self.failure
