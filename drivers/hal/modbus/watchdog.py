"""The watchdog that a Modbus module has for its own outputs (`module_watchdog:` in the YAML).

If the daemon's periodic writes cease, the module switches its outputs off by itself. Each make has its
own registers for arming, refreshing and checking the watchdog. So the YAML or a profile gives these
registers. `dead_man.py` uses them.
"""

from collections.abc import Iterator
from typing import Annotated, Final

import msgspec

from bridges.kinds.shared.fields import Name, Period, tells
from bridges.kinds.shared.remarks import Remarks
from drivers.hal.modbus.map_parts import Placed, WrittenPlace
from drivers.hal.modbus.registers import Unit, Word
from drivers.profiles import Profile


class RegisterWrite(WrittenPlace, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One write to a register or coil."""

    value: Annotated[Word, tells("the value to write.")]


class Refresh(WrittenPlace, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The periodic write that keeps the watchdog from tripping."""

    values: Annotated[
        list[Word],
        msgspec.Meta(min_length=1),
        tells(
            """the values, which the daemon writes in turn. Some modules ignore a value that equals
        the last."""
        ),
    ]


class Shows(Placed, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A place that the daemon reads, and the values of this place that count as a match."""

    values: Annotated[list[Word], msgspec.Meta(min_length=1), tells("the readings that match.")]


class Habits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The registers and times of the watchdog in one make of module."""

    time_s: Annotated[Period, tells("the time that `arm` gives the module.")]
    arm: Annotated[
        list[RegisterWrite],
        msgspec.Meta(min_length=1),
        tells("the writes that start the watchdog."),
    ]
    armed: Annotated[
        list[Shows],
        msgspec.Meta(min_length=1),
        tells("the places to read. All of them match while the watchdog is armed."),
    ]
    refresh: Annotated[Refresh, tells("the write that prevents a trip.")]
    refresh_s: Annotated[Period, tells("the period of this write; at most half of `time_s`.")]
    tripped: Annotated[
        list[Shows], tells("the places to read. At least one of them matches after a trip.")
    ] = []
    rearm: Annotated[
        list[RegisterWrite], tells("the writes that end a trip. They come before `arm`.")
    ] = []

    def problems(self) -> Remarks:
        """Yield a problem for a refresh that would come too late."""
        if self.refresh_s > self.time_s / 2:
            text = (
                f"one late scan would switch the outputs off: write at most {self.time_s / 2:g},"
                " half of time_s"
            )
            yield ("refresh_s",), text


class Watchdog(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The modules' own watchdogs."""

    units: Annotated[list[Unit], msgspec.Meta(min_length=1), tells("the units with a watchdog.")]
    profile: Annotated[Name | None, tells("a file of drivers/profiles/ for the watchdog.")] = None
    habits: Annotated[
        Habits | None,
        tells("the registers and times of the watchdog, written here instead of a profile."),
    ] = None

    def problems(self) -> Remarks:
        """Yield a problem if the YAML gives neither profile nor habits, or gives both. Yield the
        problems of the profile."""
        if len(set(self.units)) < len(self.units):
            yield ("units",), "a unit is listed twice"
        yield from PROFILE.problems(self.profile, self.habits)

    def chosen(self) -> Habits:
        """Return the registers and times (`Habits`) from the YAML. If the YAML has none, return those
        of the profile."""
        return PROFILE.chosen(self.profile, self.habits)

    def rows(self) -> Iterator[tuple[str, str, str]]:
        """Yield (when, place, value) for each write, and for each reading that the daemon compares."""
        chosen = self.chosen()
        for write in chosen.arm:
            yield f"starts the watchdog, for {chosen.time_s:g} s", write.at, str(write.value)
        refresh = " and ".join(map(str, chosen.refresh.values))
        yield f"every {chosen.refresh_s:g} s", chosen.refresh.at, f"{refresh}, in turn"
        for write in chosen.rearm:
            yield "after a trip, first", write.at, str(write.value)
        for when, shown in (
            ("reads while the watchdog runs", chosen.armed),
            ("reads after a trip", chosen.tripped),
        ):
            for place in shown:
                yield when, place.at, " or ".join(map(str, place.values))

    def warnings(self) -> Remarks:
        """Yield a warning for a profile that nobody has tried on hardware."""
        if not any(PROFILE.problems(self.profile, self.habits)):
            advice = "pull the network cable, and check that the relays go off"
            yield from PROFILE.warnings(self.profile, advice)


PROFILE: Final = Profile("module_watchdog", "habits", Habits)
