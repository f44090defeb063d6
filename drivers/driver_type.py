"""The record that describes a driver: the `DRIVER` at the end of its file.

`drivers/<kind>/<driver>.py` is named after the YAML's `kind:` and `driver:`; there is no table of
drivers to edit. Only `bridges/settings/names.py` imports a driver by its name.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeAlias, TypeVar

import msgspec

from bridges.core.table import Table
from drivers import Driver
from drivers.hal import Remark
from drivers.hal.points import Wire

Settings = TypeVar("Settings", bound=msgspec.Struct)
Sample = TypeVar("Sample")
Outputs = TypeVar("Outputs")


@dataclass(frozen=True)
class DriverType(Generic[Settings, Sample, Outputs]):
    """One driver.

    `settings`: a struct that derives from the kind's (`bridges.lift.settings.LiftSettings`…) and adds
    the wiring. `buses`: the bus types that it works on, as the names of files in `drivers/hal/`.
    `create(name, settings, bus)`: one device on its bus; sends nothing before `open`.

    The rest is optional:
    `wires(settings)`: the table that an electrician checks (`drivers/hal/points.py`).
    `debounce(settings)`: how long a change of each signal or group must last (s).
    `describe(settings, bus's settings)`: where there are no wires, rows for `check` (what, meaning).
    `tables(settings)`: codes, pulses and frames, for `check` (`bridges/core/table.py`).
    `claims(settings)`: (place, path) of what no other device of its bus may use, beside the wires'.
    `warnings(settings)`: (path, text) of what is legal but worth a look.
    `notes(settings)`: (path, text) of what a site may well want so, and should know.
    `unwired(settings)`: signals without a wire of which `accept_unsafe` may speak as well.
    `fake`: the module that stands in for the hardware in `run --simulate`, by its name, as nothing real
    imports a fake (`hal_fakes/fake.py`); the plant of its kind, on its wires, where it names none.
    """

    settings: type[Settings]
    buses: tuple[str, ...]
    create: Callable[[str, Settings, Any], Driver[Sample, Outputs]]
    wires: Callable[[Settings], Iterable[Wire]] = lambda settings: ()
    debounce: Callable[[Settings], Mapping[str, float]] = lambda settings: {}
    describe: Callable[[Settings, Any], Iterable[tuple[str, str]]] = lambda settings, bus: ()
    tables: Callable[[Settings], Iterable[Table]] = lambda settings: ()
    claims: Callable[[Settings], Iterable[tuple[str, tuple[str, ...]]]] = lambda settings: ()
    warnings: Callable[[Settings], Iterable[Remark]] = lambda settings: ()
    notes: Callable[[Settings], Iterable[Remark]] = lambda settings: ()
    unwired: Callable[[Settings], Iterable[str]] = lambda settings: ()
    fake: str = ""


AnyDriver: TypeAlias = DriverType[Any, Any, Any]
"""A driver found by its name; its kind determines its settings, sample and outputs."""
