"""Tries several steps. If a step fails, the next steps are tried all the same."""

from collections.abc import Iterator
from contextlib import contextmanager

from drivers.hal.points import HalError


class Every:
    """Steps that are all tried. Put `with every.one():` around each step, then call `check`. `failure`:
    the first HalError."""

    def __init__(self) -> None:
        self.failure: HalError | None = None

    @contextmanager
    def one(self) -> Iterator[None]:
        """Run one step. Keep its HalError for `check`."""
        try:
            yield
        except HalError as error:
            self.failure = self.failure or error

    def check(self) -> None:
        """Raise the HalError of the first step that failed."""
        if self.failure is not None:
            raise self.failure
