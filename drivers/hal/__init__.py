"""Buses, each in its own file or folder. Only these files import vendor libraries. They import a
library only when a bus needs it.

The file or folder is named after the bus `type:` of the YAML and defines a `BUS`. A bus belongs to one
thread. Every failure is a HalError, raised within the bus's I/O timeout. After a failure the bus pauses
for 0.5 to 30 s (its backoff). Calls during the backoff fail at once. So a dead device costs the other
devices on its bus at most one timeout per backoff.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import Any, Generic, Literal, NamedTuple, TypeAlias, TypeVar

import msgspec

from bridges.kinds.shared.fields import DeviceSettings
from bridges.kinds.shared.remarks import Remark, Remarks
from bridges.kinds.shared.table import Table
from drivers.hal.points import HalError, Wire
from drivers.hal.unit_calls import UnitCalls

__all__ = [
    "AnyBus",
    "Bus",
    "BusSettings",
    "BusType",
    "HalError",
    "Needs",
    "UnwatchedOutputs",
    "Where",
]

Settings = TypeVar("Settings", bound=msgspec.Struct)


class Where(NamedTuple):
    """The hardware that a bus uses: a port, an address or the header's pins. If two device YAMLs have
    the same `Where`, they use the same hardware.

    `text` names the hardware for a person. `local` is True if it belongs to this machine, as a serial
    port does. `clients` tells whether one or many daemons can use it at the same time. `clients` is
    None if this depends on the make.
    """

    text: str
    local: bool
    clients: Literal["one", "many"] | None = "many"


class Needs(NamedTuple):
    """The permissions that a daemon needs from systemd for a bus (`bridges/runtime/drop_in.py`).

    - `devices` lists paths, or classes whose devices may come and go (`char-ttyUSB`), in the form of
      systemd's DeviceAllow.
    - `modules` lists the kernel modules of these classes.
    - `group` is the group with access to the devices.
    - `family` is an address family that the bus needs in addition to IP.
    - `host` is the host that the bus reaches over IP.
    """

    devices: tuple[str, ...] = ()
    modules: tuple[str, ...] = ()
    group: str = ""
    family: str = ""
    host: str = ""


class UnwatchedOutputs(NamedTuple):
    """The remarks of `check` about outputs that keep their value when the daemon's machine or the
    network dies."""

    warnings: Sequence[Remark] = ()
    notes: Sequence[Remark] = ()


class Bus:
    """The base of every bus. Each type adds its own methods, such as those of `points.PointsBus` or
    HTTP calls.

    `calls` counts the calls that have ended, with or without success. systemd's watchdog depends on
    this number.
    """

    calls = 0

    @cached_property
    def units(self) -> UnitCalls:
        """The counts of calls to each unit. A bus that calls no unit, such as GPIO, has no counts."""
        return UnitCalls()

    def on_edge(self, wake: Callable[[], None]) -> None:
        """Let the bus call `wake`, from any thread, when an input may have changed. A polled bus never
        calls `wake`."""

    def scanned(self) -> None:
        """Report a finished scan. If these reports cease, a bus with a dead-man (a watchdog of the
        loop) switches its outputs off."""

    def insist(self) -> None:
        """Let the next call skip the backoff. The daemon calls this before it switches outputs off for
        the last time."""

    def close(self) -> None:
        """Release the bus. Does not raise. The caller may call `close` twice."""


class BusSettings(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="type"
):
    """The base of the settings of every bus. Its `tag` is the YAML's `type:`."""


class BusType(msgspec.Struct, Generic[Settings], frozen=True):
    """One type of bus. Each file or package `drivers/hal/<type>` defines one as `BUS`, without
    importing a vendor library.

    - `settings` is the struct below the bus's name in the YAML. Its `scan_s` is the period of readings
      (s).
    - `open_bus(settings)` makes the bus. The bus sends nothing before its first call. Raises HalError.
    - `open_to_switch_off(settings)` makes a bus that loads faster, for a process that only switches
      outputs off. It is None if there is no such bus.
    - `where(settings)` gives the hardware that the bus uses (`Where`). It gives None if two device
      YAMLs never share such a bus.
    - `needs(settings)` gives the permissions that the bus needs in addition to IP.
    - `warnings(settings)` gives (path, text) for each valid setting that may be a mistake.
    - `fake` names the module that simulates the devices on the bus (`hal_fakes/fake.py`). If `fake` is
      empty, there is no simulation.
    - `fake_inside` is True if the fake must run inside the daemon's process, as simulated pins must.
    - `unwatched(settings, places)` gives remarks about the outputs that keep their value when the
      daemon's machine or the network dies. `places` are all places that the daemon writes.
    - `tables(settings)` gives further facts for `check`, such as the values that the bus writes to a
      watchdog.
    - `claims(settings)` gives each place that the bus itself writes, and each name that only one daemon
      may use, with its path in the YAML.
    - `paced(settings, devices, points)` gives remarks on settings that are too slow for these devices
      and for the canonical points that the devices use.

    A bus with points also has these functions:

    - `canonical(point)` gives the canonical spelling of a point. For an invalid point it raises
      ValueError with the right spelling.
    - `describe(point)` gives every spelling of the point, for the electrician's table.
    - `wire_problems(wire)` gives the errors of this wire on this bus.
    - `wire_warnings(wire)` gives valid properties of the wire that may be a mistake.
    - `unreachable(settings, point)` gives the reason why a bus with these settings cannot reach this
      canonical point.
    - `unfit(settings, point, direction)` gives the reason why the point cannot be an input (`in`) or an
      output (`out`).
    - `place(settings, point)` names the hardware at this canonical point, which no other device YAML
      may use. It gives None if every device YAML may use the point.
    """

    settings: type[Settings]
    open_bus: Callable[[Settings], Bus]
    open_to_switch_off: Callable[[Settings], Bus] | None = None
    where: Callable[[Settings], Where | None] = lambda settings: None
    needs: Callable[[Settings], Needs] = lambda settings: Needs()
    warnings: Callable[[Settings], Remarks] = lambda settings: ()
    unwatched: Callable[[Settings, Iterable[str]], UnwatchedOutputs] = lambda settings, places: (
        UnwatchedOutputs()
    )
    tables: Callable[[Settings], Iterable[Table]] = lambda settings: ()
    claims: Callable[[Settings], Iterable[tuple[str, tuple[str, ...]]]] = lambda settings: ()
    paced: Callable[[Settings, Sequence[DeviceSettings], Iterable[str]], Remarks] = (
        lambda settings, devices, points: ()
    )
    fake: str = ""
    fake_inside: bool = False
    canonical: Callable[[str], str] = str
    describe: Callable[[str], str] = str
    wire_problems: Callable[[Wire], Iterable[str]] = lambda wire: ()
    wire_warnings: Callable[[Wire], Iterable[str]] = lambda wire: ()
    unreachable: Callable[[Settings, str], str | None] = lambda settings, point: None
    unfit: Callable[[Settings, str, Literal["in", "out"]], str | None] = (
        lambda settings, point, direction: None
    )
    place: Callable[[Settings, str], str | None] = lambda settings, point: point


AnyBus: TypeAlias = BusType[Any]
"""A bus type with any settings."""
