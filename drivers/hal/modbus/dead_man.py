"""Arms and refreshes the watchdogs inside Modbus modules. Their settings are in `watchdog.py`.

- The daemon drives an output only after it has armed the module's watchdog. A watchdog counts as armed
  only after the daemon has read from the module that it is armed.
- Only a finished scan refreshes a watchdog. So the module switches its outputs off when the daemon
  hangs. One round of the loop must be shorter than the module's time, even with failing units.
- The daemon reads whether a watchdog has tripped. Exception 4 of the module shows this too. After a
  trip the state of every output is unknown. The daemon then arms the watchdog again. For each device on
  the unit one reading fails, and the device writes its outputs anew.

After the daemon's end the watchdog stays armed. The daemon has switched the outputs off before its end,
so they stay off.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Final

from drivers.hal import HalError
from drivers.hal.modbus.registers import at
from drivers.hal.modbus.watchdog import Habits, RegisterWrite, Shows, Watchdog

if TYPE_CHECKING:
    from drivers.hal.modbus.bus import ModbusBus

DEVICE_FAILURE: Final = 4
"""The exception code with which a module refuses outputs after its watchdog has tripped."""


class UnitWatchdog:
    """The watchdog of one unit. `trips` counts the trips that the daemon has seen."""

    def __init__(self, bus: "ModbusBus", unit: int, habits: Habits) -> None:
        self._bus = bus
        self._unit = unit
        self._habits = habits
        self._refresh_values = itertools.cycle(habits.refresh.values)
        self._refreshed_at = -math.inf
        self.armed = False
        self.trips = 0

    def arm(self) -> None:
        """Arm the watchdog, and read back that it is armed. Raises HalError."""
        if self.armed:
            return
        habits = self._habits
        if any(self._shows(habits.tripped)):
            self._write_all(habits.rearm)
        if not all(self._shows(habits.armed)):
            self._write_all(habits.arm)
        self._see_that_it_is_armed()
        self.armed = True

    def refresh(self, now: float) -> None:
        """If a refresh is due, refresh the watchdog and check for a trip. Does not raise."""
        if not self.armed or now < self._refreshed_at + self._habits.refresh_s:
            return
        self._refreshed_at = now
        try:
            self._bus.write(at(self._unit, self._habits.refresh.at), next(self._refresh_values))
            self._see_that_it_is_armed()
        except HalError:
            self.tripped()

    def tripped(self) -> None:
        """Record a trip. After a trip the state of the outputs is unknown."""
        if self.armed:
            self.armed = False
            self.trips += 1

    def _see_that_it_is_armed(self) -> None:
        if not all(self._shows(self._habits.armed)):
            raise HalError(
                f"the watchdog of unit {self._unit} does not read back as armed: compare the"
                " module_watchdog of the bus with the module's manual"
            )

    def _shows(self, wanted: Iterable[Shows]) -> list[bool]:
        places = {at(self._unit, shows.at): shows.values for shows in wanted}
        image = self._bus.cells(places)
        return [image[place] in values for place, values in places.items()]

    def _write_all(self, writes: Iterable[RegisterWrite]) -> None:
        for one in writes:
            self._bus.write(at(self._unit, one.at), one.value)


class DeviceWatchdogs:
    """The watchdogs of the units where one device has its outputs."""

    def __init__(self, watchdogs: Iterable[UnitWatchdog]) -> None:
        self._seen = {watchdog: watchdog.trips for watchdog in watchdogs}

    def check(self) -> None:
        """Arm all watchdogs. Raises HalError if this fails. After a trip, also raise HalError once
        although the watchdog is armed again, because the trip has switched outputs off."""
        trips = [watchdog for watchdog, seen in self._seen.items() if watchdog.trips != seen]
        for watchdog in self._seen:
            watchdog.arm()
        for watchdog in trips:
            self._seen[watchdog] = watchdog.trips
        if trips:
            raise HalError(
                "the module's watchdog tripped and switched its outputs off; it is armed again"
            )


class Watchdogs:
    """The watchdogs of one bus, by unit. If the YAML has no watchdog, this is empty."""

    def __init__(
        self, bus: "ModbusBus", settings: Watchdog | None, clock: Callable[[], float]
    ) -> None:
        self._clock = clock
        self._units: Mapping[int, UnitWatchdog] = {}
        if settings is not None:
            habits = settings.chosen()
            self._units = {unit: UnitWatchdog(bus, unit, habits) for unit in settings.units}

    def guard(self, units: Iterable[int]) -> DeviceWatchdogs:
        """Return the watchdogs of these units, where the caller's device has its outputs."""
        return DeviceWatchdogs(
            self._units[unit] for unit in sorted(set(units)) if unit in self._units
        )

    def refused(self, unit: int, code: int) -> None:
        """Record that a unit has answered with this exception code."""
        if code == DEVICE_FAILURE and unit in self._units:
            self._units[unit].tripped()

    def scanned(self) -> None:
        """Refresh the watchdogs after a finished scan."""
        for watchdog in self._units.values():
            watchdog.refresh(self._clock())
