"""The record that describes a driver: the `DRIVER` at the end of its file.

The YAML's `kind:` and `driver:` name the file `drivers/<kind>/<driver>.py`, so there is no table of
drivers to edit. Only `bridges/settings/names.py` imports a driver by its name.
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

    `settings`: a struct that derives from the kind's (`bridges.kinds.lift.settings.LiftSettings`…)
    and adds the wiring. `buses`: the bus types that the driver works on, as names of files in
    `drivers/hal/`. `create(name, settings, bus)` makes the driver of one device. The driver sends
    nothing before `open`.

    The fields below are optional:
    `wires(settings)`: the wiring table that an electrician checks (`drivers/hal/points.py`).
    `debounce(settings)`: signal or group -> how long a change must last (s).
    `describe(settings, bus's settings)`: rows (subject, meaning) for `check` if there are no wires.
    `tables(settings)`: codes, pulses and frames for `check` (`bridges/kinds/shared/table.py`).
    `claims(settings)`: (place, path) of each exclusive place. The wires' points are claimed anyway.
    `warnings(settings)`: (path, text) of valid settings that may be a mistake.
    `notes(settings)`: (path, text) of intended settings whose effects the site should know.
    `unwired(settings)`: signals that have no wire, but that `accept_unsafe` may name.
    `fake`: the name of the module that stands in for the hardware in `run --simulate`
    (`hal_fakes/fake.py`). Without a name, the kind's simulated plant is at the far end of the wires.
    """

    settings: type[Settings]
    buses: tuple[str, ...]
    create: Callable[[str, Settings, Any], Driver[Sample, Outputs]]
    wires: Callable[[Settings], Iterable[Wire]] = lambda settings: ()
    debounce: Callable[[Settings], Mapping[str, float]] = lambda settings: {}
    describe: Callable[[Settings, Any], Iterable[tuple[str, str]]] = lambda settings, bus: ()
    tables: Callable[[Settings], Iterable[Table]] = lambda settings: ()
    claims: Callable[[Settings], Iterable[tuple[str, tuple[str, ...]]]] = lambda settings: ()
    warnings: Callable[[Settings], Remarks] = lambda settings: ()
    notes: Callable[[Settings], Remarks] = lambda settings: ()
    unwired: Callable[[Settings], Iterable[str]] = lambda settings: ()
    fake: str = ""


AnyDriver: TypeAlias = DriverType[Any, Any, Any]
"""A driver of any kind. The kind determines the types of settings, sample and outputs."""
