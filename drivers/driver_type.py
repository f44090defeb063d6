"""The record that describes a driver. Each driver's file ends with such a record, named `DRIVER`.

The YAML's `kind:` and `driver:` name the file `drivers/<kind>/<driver>.py`, so there is no table of
drivers to edit. `bridges/settings/names.py` imports a driver by this name. No other file does so.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Generic, TypeAlias, TypeVar

import msgspec

from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table
from drivers import Driver
from drivers.hal.points import Wire

Settings = TypeVar("Settings", bound=msgspec.Struct)
Sample = TypeVar("Sample")
Outputs = TypeVar("Outputs")


class DriverType(msgspec.Struct, Generic[Settings, Sample, Outputs], frozen=True):
    """One driver.

    - `settings` is a struct with the device's settings and wiring. It is a subclass of the kind's
      settings struct, such as `bridges.kinds.lift.settings.LiftSettings`.
    - `buses` lists the bus types that the driver works on, as names of files in `drivers/hal/`.
    - `create(name, settings, bus)` makes the driver of one device. The driver sends nothing before
      `open`.

    The fields below are optional:

    - `wires(settings)` gives the wiring table that an electrician checks (`drivers/hal/points.py`).
    - `debounce(settings)` gives how long (s) a change must last, for each signal or group of signals.
    - `describe(settings, bus's settings)` gives rows (subject, meaning) for `check` if there are no
      wires.
    - `commands(settings)` gives the names of the outputs that the device has, for a lift's driver
      without wires. With wires, the outputs' signals have these names.
    - `tables(settings)` gives tables of codes, pulses and frames for `check`
      (`bridges/kinds/shared/table.py`).
    - `claims(settings)` gives each register, path or topic that no other device may use, with its path
      in the YAML. The points in the wiring table need not be listed, because they are always claimed.
    - `reads(settings)` gives each register or coil that tells the device's state, with its path in the
      YAML. None of them may be one that a device writes.
    - `warnings(settings)` gives (path, text) for each valid setting that may be a mistake.
    - `notes(settings)` gives (path, text) for each setting that is no mistake, but whose effects the
      site should know.
    - `unwired(settings)` gives the signals without a wire that `accept_unsafe` may name.
    - `fake` names the module that replaces the hardware in `run --simulate` (`hal_fakes/fake.py`). If
      `fake` is empty, the simulation connects the wires to a simulated lift, door or other device of
      the same kind.
    """

    settings: type[Settings]
    buses: tuple[str, ...]
    create: Callable[[str, Settings, Any], Driver[Sample, Outputs]]
    wires: Callable[[Settings], Iterable[Wire]] = lambda settings: ()
    debounce: Callable[[Settings], Mapping[str, float]] = lambda settings: {}
    describe: Callable[[Settings, Any], Iterable[tuple[str, str]]] = lambda settings, bus: ()
    commands: Callable[[Settings], Iterable[str]] = lambda settings: ()
    tables: Callable[[Settings], Iterable[Table]] = lambda settings: ()
    claims: Callable[[Settings], Iterable[tuple[str, tuple[str, ...]]]] = lambda settings: ()
    reads: Callable[[Settings], Iterable[tuple[str, tuple[str, ...]]]] = lambda settings: ()
    warnings: Callable[[Settings], Remarks] = lambda settings: ()
    notes: Callable[[Settings], Remarks] = lambda settings: ()
    unwired: Callable[[Settings], Iterable[str]] = lambda settings: ()
    fake: str = ""


AnyDriver: TypeAlias = DriverType[Any, Any, Any]
"""A driver of any kind. The kind determines the types of settings, sample and outputs."""
