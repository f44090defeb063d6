"""Buses, each in its own file or folder. Only this code imports vendor libraries, and only on use.

The file or folder is named after the bus `type:` of the YAML and holds a `BUS`. A Bus belongs to one
thread. Every failure is a HalError, raised within the bus's I/O timeout. After a failure the bus backs
off for 0.5 to 30 s, during which calls fail at once. So a dead device costs the other devices on its
bus at most one timeout per backoff.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Generic, Literal, NamedTuple, TypeAlias, TypeVar

import msgspec

from bridges.kinds.shared.fields import DeviceSettings
from bridges.kinds.shared.remarks import Remark, Remarks
from bridges.kinds.shared.table import Table
from drivers.hal.points import HalError, Wire

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
    """The place of a bus in the building: two files with the same `Where` use the same hardware.

    `text`: its name for a person. `local`: it belongs to this machine, as a serial port does.
    `clients`: the maximum number of daemons at once; None if the number depends on the make.
    """

    text: str
    local: bool
    clients: Literal["one", "many"] | None = "many"


class Needs(NamedTuple):
    """The permissions that a daemon needs from systemd for a bus (`bridges/runtime/drop_in.py`).

    `devices`: in the form of DeviceAllow: a path, or a class whose devices may come and go
    (`char-ttyUSB`). `modules`: the kernel modules of those classes. `group`: the group with access to
    the devices. `family`: an address family besides IP's. `host`: the host reached over IP.
    """

    devices: tuple[str, ...] = ()
    modules: tuple[str, ...] = ()
    group: str = ""
    family: str = ""
    host: str = ""


class UnwatchedOutputs(NamedTuple):
    """Remarks on outputs that keep their value when the daemon's machine or the network dies."""

    warnings: Sequence[Remark] = ()
    notes: Sequence[Remark] = ()


class Bus:
    """The base of every bus; each type adds its own (`points.PointsBus`, HTTP calls…).

    `calls`: the number of ended calls, successful or not; systemd's watchdog depends on it.
    """

    calls = 0

    def on_edge(self, wake: Callable[[], None]) -> None:
        """Call `wake` (from any thread) when an input may have changed; a polled bus never calls it."""

    def scanned(self) -> None:
        """Report a finished scan. A dead-man, if there is one, drops the outputs when scans stop."""

    def insist(self) -> None:
        """Make the next call at once, without waiting for the backoff: outputs are about to go off."""

    def close(self) -> None:
        """Release the bus. Does not raise; may be called twice."""


class BusSettings(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="type"
):
    """The base of the section of every bus; its `tag` is the YAML's `type:`."""


class BusType(msgspec.Struct, Generic[Settings], frozen=True):
    """One type of bus: a `BUS` at the end of `drivers/hal/<type>`, which needs no vendor library.

    `settings`: the struct below the bus's name in the YAML, with `scan_s` (the period of readings).
    `open_bus(settings)`: makes the bus, which sends nothing yet. Raises HalError.
    `open_to_switch_off(settings)`: makes a bus that is quicker to load, for a process that only
    switches off; None without such a bus.
    `where(settings)`: its place in the building; None if files never share such a bus.
    `needs(settings)`: its needs of the machine, beside IP.
    `warnings(settings)`: (path, text) of legal settings that are worth a look. `fake`: the name of the
    module with the far side (`hal_fakes/fake.py`); without a name there is no simulation.
    `fake_inside`: the fake must run in the daemon's process, as for pins.
    `unwatched(settings, places)`: remarks on outputs at `places` that keep their value when the
    daemon's machine or the network dies. The daemon writes all of `places`.
    `tables(settings)`: further facts for `check`, such as the values that are written to a watchdog.
    `paced(settings, devices, points)`: remarks on settings that are too slow for these devices on the
    bus, and for its canonical points in use.

    A bus with points also has
    `canonical(point)`: the canonical spelling of a point; the text of its ValueError has the fix;
    `describe(point)`: every spelling, for the electrician's table;
    `wire_problems(wire)`: the errors in this wire on this bus;
    `wire_warnings(wire)`: legal properties of the wire that are worth a look;
    `unreachable(settings, point)`: why a bus with these settings cannot reach this canonical point;
    `unfit(settings, point, direction)`: why the point cannot be an input, or an output;
    `place(settings, point)`: the thing at this canonical point that no other file may use; None if
    every file may use it.
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
"""Any bus type."""
