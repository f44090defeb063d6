"""A valid device YAML, as the daemon and `check` use it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from msgspec import Struct, field

from bridges.kinds import kind_called
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.kinds.shared.recording_section import RecordingSettings
from bridges.kinds.shared.rmf_section import Rmf
from bridges.settings import names as named
from bridges.yaml.problems import Problem
from drivers.driver_type import AnyDriver
from drivers.hal import AnyBus, Bus
from drivers.hal.points import Wire


class Config(Struct, frozen=True):
    """A valid file.

    `text`: its bytes as they were read. `buses` and `devices`: name -> settings, of a type that only
    the record of the bus type or driver knows. `bus_types`: name -> `type:`. `warnings`: legal settings
    that may be a mistake. `old_keys`: the warnings of keys with a new name. `notes`: intended settings
    whose effects the user should know. `section`: the settings of a kind without devices
    (`bridges/kinds/shared/graph_kind.py`), which has no driver and no buses; or the section that the
    devices of a kind share.
    """

    path: Path
    text: bytes
    kind: str
    driver: str
    rmf: Rmf
    buses: Mapping[str, Any]
    devices: Mapping[str, Any]
    bus_types: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[Problem, ...] = ()
    old_keys: tuple[Problem, ...] = ()
    notes: tuple[Problem, ...] = ()
    section: Any = None
    recording: RecordingSettings = RecordingSettings()

    @property
    def drives(self) -> bool:
        """Does this file have outputs that must be off when its daemon is dead?"""
        kind = kind_called(self.kind)
        return not isinstance(kind, GraphKind) and kind.drives

    def bus_of(self, device_name: str) -> str:
        """Return the name of the bus that a device is on."""
        named_bus: str | None = self.devices[device_name].bus
        return named_bus or next(iter(self.buses))

    def devices_on(self, bus: str) -> list[str]:
        """Return the names of the devices on this bus."""
        return [name for name in self.devices if self.bus_of(name) == bus]

    def driver_type(self, device_name: str) -> AnyDriver:
        """Return the driver of a device: its own, or the file's."""
        own: str | None = self.devices[device_name].driver
        return named.driver_called(self.kind, own or self.driver)

    def wires(self, device_name: str) -> list[Wire]:
        """Return a device's wiring table; empty if its driver has no wires."""
        return list(self.driver_type(device_name).wires(self.devices[device_name]))

    def bus_type(self, name: str) -> AnyBus:
        """Return the type of the bus with this name."""
        return named.bus_called(self.bus_types[name])

    def open_bus(self, name: str) -> Bus:
        """Open the real bus with this name. Raises HalError."""
        return self.bus_type(name).open_bus(self.buses[name])

    def open_to_switch_off(self, name: str) -> Bus:
        """Open the real bus for a process that only switches outputs off. Raises HalError."""
        hal = self.bus_type(name)
        return (hal.open_to_switch_off or hal.open_bus)(self.buses[name])
