"""Buses: each in its own file or folder, the only code that imports vendor libraries, and only on use.

The file or folder is named after the bus `type:` of the YAML and holds a `BUS`. A Bus belongs to one
thread. Every failure is a HalError, raised within the bus's I/O timeout. After a failure the bus backs
off for 0.5 to 30 s, during which calls fail at once. So a dead device costs the others on its bus at
most one timeout per backoff.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Generic, Literal, NamedTuple, TypeAlias, TypeVar

import msgspec

from bridges.kinds.shared.remarks import Remark, Remarks
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
    """Where a bus is in the building: two files with the same `Where` use the same hardware.

    `text`: its name for a person. `local`: it belongs to this machine, as a serial port does.
    `clients`: how many daemons it takes at once; None if that depends on the make.
    """

    text: str
    local: bool
    clients: Literal["one", "many"] | None = "many"


class Needs(NamedTuple):
    """What systemd must permit a daemon for a bus (`bridges/runtime/drop_in.py`).

    `devices`: as its DeviceAllow has them: a path, or a class whose devices may come and go
    (`char-ttyUSB`). `modules`: the kernel modules that bring those classes. `group`: who may open
    them. `family`: an address family beside those of IP. `host`: the one that it reaches over IP.
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
    """What every bus has; the rest depends on its type (`points.PointsBus`, HTTP calls…).

    `calls`: how many calls have ended, with or without success; systemd's watchdog depends on it.
    """

    calls = 0

    def on_edge(self, wake: Callable[[], None]) -> None:
        """Call `wake` (from any thread) when an input may have changed; a polled bus never calls it."""

    def scanned(self) -> None:
        """A scan has finished. A dead-man, where there is one, drops the outputs when scans stop."""

    def insist(self) -> None:
        """Make the next call at once, without waiting for the backoff: outputs are about to go off."""

    def close(self) -> None:
        """Release the bus. Does not raise; may be called twice."""


class BusSettings(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="type"
):
    """What the section of every bus derives from; its `tag` is the YAML's `type:`."""


class BusType(msgspec.Struct, Generic[Settings], frozen=True):
    """One type of bus: a `BUS` at the end of `drivers/hal/<type>`, which needs no vendor library.

    `settings`: the struct below the bus's name in the YAML, with `scan_s` (how often it is read).
    `open_bus(settings)`: makes the bus, which sends nothing yet. Raises HalError.
    `open_to_switch_off(settings)`: the same for a process that only switches off, where that is
    quicker to load; else None.
    `where(settings)`: what it is in the building; None where files never share it.
    `needs(settings)`: what it needs of the machine, beside IP.
    `warnings(settings)`: (path, text) of what is legal but worth a look. `fake`: the module with its
    far side, by its name (`hal_fakes/fake.py`); without one it cannot be simulated. `fake_inside`: it
    cannot leave the daemon's process, as pins cannot.
    `unwatched(settings, places)`: which of these places, which the daemon writes, keep their value when
    its machine or the network dies.

    A bus with points also has
    `canonical(point)`: the one spelling of a point; ValueError says what to write instead;
    `describe(point)`: every spelling, for the table that an electrician reads;
    `wire_problems(wire)`: what cannot be right about this wire on this bus;
    `wire_warnings(wire)`: what is legal about it but worth a look;
    `unreachable(settings, point)`: why no such bus reaches this point, which is in its one spelling.
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
    fake: str = ""
    fake_inside: bool = False
    canonical: Callable[[str], str] = str
    describe: Callable[[str], str] = str
    wire_problems: Callable[[Wire], Iterable[str]] = lambda wire: ()
    wire_warnings: Callable[[Wire], Iterable[str]] = lambda wire: ()
    unreachable: Callable[[Settings, str], str | None] = lambda settings, point: None


AnyBus: TypeAlias = BusType[Any]
"""A bus type found by its name."""
