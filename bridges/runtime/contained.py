"""Contains a driver's unexpected exceptions, so that they affect no other device.

After such an exception the device's outputs are switched off, and the traceback is logged once. After a
pause the device is opened again. The pause grows from 0.5 s to 30 s.

If the outputs are not verified off within OFF_WITHIN_S, the daemon ends. Then `outputs-off` tries to
switch the outputs off from a new process.
"""

import logging
from collections.abc import Callable, Mapping
from typing import Final, Generic, TypeVar

from bridges.kinds.shared.decision import O, X
from bridges.kinds.shared.durations import AGES_AGO
from bridges.runtime.clock import Clock
from bridges.system.log import pairs
from drivers import Driver, DriverError, OnContacts

log = logging.getLogger(__name__)

OFF_WITHIN_S: Final = 1.0
PAUSE_FIRST_S: Final = 0.5
PAUSE_MOST_S: Final = 30.0

T = TypeVar("T")


class LeftOn(Exception):
    """The error that ends the daemon. A device could not be switched off after a defect of its
    driver."""


class Contained(Generic[X, O]):
    """A device whose driver (`drivers.Driver`) may raise any exception. This class raises only
    DriverError and LeftOn."""

    def __init__(self, name: str, driver: Driver[X, O], clock: Clock) -> None:
        self._name = name
        self._driver = driver
        self.contacts: Callable[[], Mapping[str, bool]] = dict
        """The driver's method `OnContacts.contacts`. For a driver without contacts, this is a function
        that returns an empty mapping."""
        if isinstance(driver, OnContacts):
            self.contacts = driver.contacts
        self._clock = clock
        self._failure = ""
        self._pause_s = 0.0
        self._again_at = AGES_AGO
        self._claims_anew = False
        self._written = False
        self._unsafe_since: float | None = None

    def open(self) -> None:
        """Claim every output at its safe level."""
        self._call(self._driver.open)

    def read(self) -> X:
        """Read every input. If a defect of the driver came before, first claim the device again."""
        return self._call(self._read)

    def write(self, outputs: O) -> None:
        """Set every output to its level. A successful call resets the pause, so that the next defect
        begins with the shortest pause."""
        self._call(lambda: self._write(outputs))
        self._pause_s = 0.0

    def make_safe(self) -> None:
        """Switch every output off."""
        try:
            self._driver.make_safe()
        except DriverError:
            raise
        except Exception as error:
            raise self._broke(error) from error
        self._written, self._unsafe_since = False, None

    def close(self) -> None:
        """Switch the outputs off and release the points."""
        try:
            self._driver.close()
        except Exception as error:  # noqa: BLE001 - logged by _broke
            self._broke(error)

    def _read(self) -> X:
        if self._claims_anew:
            self._driver.open()
            self._claims_anew = False
        return self._driver.read()

    def _write(self, outputs: O) -> None:
        self._written = True
        self._driver.write(outputs)

    def _call(self, call: Callable[[], T]) -> T:
        self._insist_on_off()
        if self._clock.monotonic() < self._again_at:
            raise DriverError(self._failure)
        try:
            return call()
        except DriverError:
            raise
        except Exception as error:  # noqa: BLE001 - logged by _broke
            failure = self._broke(error)
        self._begin_pause()
        self._insist_on_off()
        raise failure

    def _broke(self, error: Exception) -> DriverError:
        """Return a driver's defect as a DriverError. Log only the first defect since the device last
        worked."""
        self._failure = f"a defect of the driver: {type(error).__name__}: {error}"
        if not self._pause_s:
            log.error(pairs("defect", device=self._name, reason=self._failure), exc_info=error)
        return DriverError(self._failure)

    def _begin_pause(self) -> None:
        now = self._clock.monotonic()
        self._pause_s = min(max(2 * self._pause_s, PAUSE_FIRST_S), PAUSE_MOST_S)
        self._again_at = now + self._pause_s
        self._claims_anew = True
        if self._written and self._unsafe_since is None:
            self._unsafe_since = now

    def _insist_on_off(self) -> None:
        """Switch off the outputs that may be on. Raises DriverError if this fails. Raises LeftOn if it
        still fails after OFF_WITHIN_S."""
        if self._unsafe_since is None:
            return
        since = self._unsafe_since
        try:
            self.make_safe()
        except DriverError as error:
            if self._clock.monotonic() >= since + OFF_WITHIN_S:
                raise LeftOn(f"{self._name} cannot be switched off: {error}") from error
            raise
