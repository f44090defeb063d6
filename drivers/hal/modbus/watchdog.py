"""`module_watchdog:` of a Modbus bus: the module's own dead-man switch for its outputs.

A module that is not written to in time drops its outputs by itself. Which registers arm, refresh and
show that is the module's habit, so it is data: in the YAML, or a profile.

- Armed before the first output is touched, and believed only when read back.
- Refreshed when the loop has finished a scan, and by nothing else: a daemon that hangs loses its
  outputs. The loop's whole round, failing units included, has to fit into the module's time.
- A trip (read back, or exception 4) makes every output unknown: it is armed again, each device on the
  unit fails one reading, and its outputs are written anew.

On stopping it is left armed: the outputs were switched off before, and stay so.
"""

import itertools
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Final

import msgspec

from bridges.core.fields import Name, Period
from drivers.hal import HalError
from drivers.hal.modbus.registers import (
    TABLES,
    WRITABLE,
    Place,
    Unit,
    Word,
    at,
    misplaced,
    read,
    write,
)
from drivers.profiles import Profile, profile_problems

if TYPE_CHECKING:
    from drivers.hal.modbus import ModbusBus

DEVICE_FAILURE: Final = 4
"""The exception by which modules refuse outputs after their watchdog has tripped."""

Problems = Iterator[tuple[tuple[str, ...], str]]


class Write(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One write.

    `at`: `holding register N` or `coil N`.
    `value`: what is written.
    """

    at: Place
    value: Word

    def problems(self) -> Problems:
        """A place that cannot be written."""
        yield from _place_problems(self.at, WRITABLE)


class Refresh(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What keeps the watchdog from tripping.

    `at`: `holding register N` or `coil N`.
    `values`: written in turn: some modules only count a value that differs from the last.
    """

    at: Place
    values: Annotated[list[Word], msgspec.Meta(min_length=1)]

    def problems(self) -> Problems:
        """A place that cannot be written."""
        yield from _place_problems(self.at, WRITABLE)


class Shows(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A place with the values that mean something.

    `at`: `holding register N`, `input register N`, `coil N` or `discrete input N`.
    `values`: any of these.
    """

    at: Place
    values: Annotated[list[Word], msgspec.Meta(min_length=1)]

    def problems(self) -> Problems:
        """A place that there cannot be."""
        yield from _place_problems(self.at, tuple(TABLES))


class Habits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How a make's watchdog is used.

    `time_s`: the time that `arm` gives the module.
    `arm`: the writes that start it, in order.
    `armed`: reads like this while it is armed: all of them.
    `refresh`: what keeps it from tripping.
    `refresh_s`: how often; at most half of `time_s`.
    `tripped`: reads like this after a trip: any of them.
    `rearm`: the writes that end a trip, before `arm`.
    """

    time_s: Period
    arm: Annotated[list[Write], msgspec.Meta(min_length=1)]
    armed: Annotated[list[Shows], msgspec.Meta(min_length=1)]
    refresh: Refresh
    refresh_s: Period
    tripped: list[Shows] = msgspec.field(default_factory=list)
    rearm: list[Write] = msgspec.field(default_factory=list)

    def problems(self) -> Problems:
        """A refresh that comes too late."""
        if self.refresh_s > self.time_s / 2:
            text = (
                f"one late scan would drop the outputs: at most {self.time_s / 2:g}, half of time_s"
            )
            yield ("refresh_s",), text


class Watchdog(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The modules' own watchdogs.

    `units`: the units that have one.
    `profile`: a file of drivers/profiles/ that says how it is used.
    `habits`: the same, written here.
    """

    units: Annotated[list[Unit], msgspec.Meta(min_length=1)]
    profile: Name | None = None
    habits: Habits | None = None

    def problems(self) -> Problems:
        """Neither or both of profile and habits; a profile that is not right."""
        if len(set(self.units)) < len(self.units):
            yield ("units",), "a unit stands here twice"
        yield from profile_problems(PROFILE, self.profile, self.habits)

    def warnings(self) -> Problems:
        """A profile that nobody has tried."""
        if any(profile_problems(PROFILE, self.profile, self.habits)):
            return
        if self.profile and PROFILE.untried(self.profile):
            text = (
                f"nobody has tried the profile {self.profile} on hardware: pull the network cable,"
            )
            yield ("profile",), f"{text} and see that the relays drop"


PROFILE: Final = Profile("module_watchdog", "habits", Habits)


def _place_problems(text: str, tables: Collection[str]) -> Problems:
    if reason := misplaced(text, tables):
        yield ("at",), reason


class UnitWatchdog:
    """The watchdog of one unit. `trips` counts what was noticed."""

    def __init__(self, bus: "ModbusBus", unit: int, habits: Habits) -> None:
        self._bus = bus
        self._unit = unit
        self._habits = habits
        self._refresh_values = itertools.cycle(habits.refresh.values)
        self._refreshed_at = -math.inf
        self.armed = False
        self.trips = 0

    def arm(self) -> None:
        """Have it armed, as it says itself. Raises HalError."""
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
        """Keep it from tripping, when it is time, and see that it has not. Does not raise."""
        if not self.armed or now < self._refreshed_at + self._habits.refresh_s:
            return
        self._refreshed_at = now
        try:
            place = at(self._unit, self._habits.refresh.at)
            write(self._bus, place, next(self._refresh_values))
            self._see_that_it_is_armed()
        except HalError:
            self.tripped()

    def tripped(self) -> None:
        """Nothing is known of the outputs any longer."""
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
        image = read(self._bus, places) if places else {}
        return [image[place] in values for place, values in places.items()]

    def _write_all(self, writes: Iterable[Write]) -> None:
        for one in writes:
            write(self._bus, at(self._unit, one.at), one.value)


class Guard:
    """One device's view of its units' watchdogs."""

    def __init__(self, watchdogs: Iterable[UnitWatchdog]) -> None:
        self._seen = {watchdog: watchdog.trips for watchdog in watchdogs}

    def check(self) -> None:
        """Have all armed. Raises HalError, and also once after each trip: outputs went off."""
        trips = [watchdog for watchdog, seen in self._seen.items() if watchdog.trips != seen]
        for watchdog in self._seen:
            watchdog.arm()
        for watchdog in trips:
            self._seen[watchdog] = watchdog.trips
        if trips:
            raise HalError("the module's watchdog had tripped: its outputs were off; armed again")


class Watchdogs:
    """Those of one bus, by unit; none where the YAML has none."""

    def __init__(
        self, bus: "ModbusBus", settings: Watchdog | None, clock: Callable[[], float]
    ) -> None:
        self._clock = clock
        self._units: Mapping[int, UnitWatchdog] = {}
        if settings is not None:
            habits = settings.habits or PROFILE.load(settings.profile or "")
            self._units = {unit: UnitWatchdog(bus, unit, habits) for unit in settings.units}

    def guard(self, units: Iterable[int]) -> Guard:
        """For a device with outputs at these units."""
        return Guard(self._units[unit] for unit in sorted(set(units)) if unit in self._units)

    def refused(self, unit: int, code: int) -> None:
        """A unit has answered with this exception."""
        if code == DEVICE_FAILURE and unit in self._units:
            self._units[unit].tripped()

    def scanned(self) -> None:
        """A scan has finished."""
        for watchdog in self._units.values():
            watchdog.refresh(self._clock())
