"""A valid device YAML, as the daemon and `check` use it."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from msgspec import Struct, field
from msgspec.structs import replace

from bridges.kinds import kind_called
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.kinds.shared.recording_section import RecordingSettings
from bridges.kinds.shared.rmf_section import Rmf
from bridges.settings import names as named
from bridges.yaml.problems import Problem
from drivers.driver_type import AnyDriver
from drivers.hal import AnyBus, Bus
from drivers.hal.points import Wire

LATE_S: Final = 0.1
"""The extra time (s) for which a reading of another bus stays valid, after the duration of one scan of
that bus."""


class Config(Struct, frozen=True):
    """A valid file.

    - `text`: the file's bytes
    - `buses`, `devices`: map a name to its settings. Only the module of the bus type or of the driver
      knows the type of these settings.
    - `bus_types`: maps the name of a bus to its `type:`
    - `warnings`: remarks on valid settings that may be a mistake
    - `old_keys`: warnings about keys that have a new name
    - `notes`: remarks on intended settings whose effects the user should know
    - `section`: for a kind without devices, its settings (`bridges/kinds/shared/graph_kind.py`); such a
      kind has no driver and no buses. For any other kind, the settings that its devices share, if there
      are any.
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
    def node(self) -> str:
        """The name of the daemon's node. It is made of the file's name, because a ROS name has only
        ASCII letters, digits and underscores."""
        return re.sub(r"\W", "_", f"rmf_bridge_{self.path.stem}", flags=re.ASCII)

    @property
    def drives(self) -> bool:
        """Return whether this file has outputs that must be switched off after the daemon's death."""
        kind = kind_called(self.kind)
        return not isinstance(kind, GraphKind) and kind.drives

    def bus_of(self, device_name: str) -> str:
        """Return the name of the bus that a device is on."""
        named_bus: str | None = self.devices[device_name].bus
        return named_bus or next(iter(self.buses))

    def devices_on(self, bus: str) -> list[str]:
        """Return the names of the devices on this bus."""
        return [name for name in self.devices if self.bus_of(name) == bus]

    def devices_at(self, bus: str) -> list[str]:
        """Return the names of the devices on this bus, and of devices that have inputs on it."""
        guests = [name for name in self.devices if bus in self.other_buses(name)]
        return [*self.devices_on(bus), *guests]

    def driver_type(self, device_name: str) -> AnyDriver:
        """Return the driver of a device: its own driver if it has one, else the file's driver."""
        own: str | None = self.devices[device_name].driver
        return named.driver_called(self.kind, own or self.driver)

    def wires(self, device_name: str) -> list[Wire]:
        """Return a device's wiring table. The table is empty if the device's driver has no wires."""
        return list(self.driver_type(device_name).wires(self.devices[device_name]))

    def outputs(self, device_name: str) -> set[str]:
        """Return the names of a device's outputs: the signals of its output wires, and the commands
        that a lift's driver without wires has. Other drivers without wires name no outputs."""
        commands = self.driver_type(device_name).commands(self.devices[device_name])
        return {w.signal for w in self.wires(device_name) if w.direction == "out"} | {*commands}

    def wires_on(self, bus: str, device_name: str) -> list[Wire]:
        """Return the rows of a device's wiring table that are on this bus. In the returned rows `bus`
        is ""."""
        wires = ((wire, wire.bus or self.bus_of(device_name)) for wire in self.wires(device_name))
        return [replace(wire, bus="") for wire, name in wires if name == bus]

    def other_buses(self, device_name: str) -> list[str]:
        """Return the buses other than the device's own bus on which the device has inputs."""
        return list(dict.fromkeys(wire.bus for wire in self.wires(device_name) if wire.bus))

    def lasts_s(self, bus: str) -> float:
        """Return the age (s) up to which a reading of this bus is valid for a device on another bus."""
        scan_s: float = self.buses[bus].scan_s
        return scan_s + LATE_S

    def debounce(self, device_name: str) -> dict[str, float]:
        """Return a mapping from each signal or group to the time (s) that a change must last.

        If a device has inputs on another bus, a reading of that bus may be older by `lasts_s`. Two
        scans of the device may then use the same reading. Therefore the debounce of every input is
        longer by that age, so that no single reading counts as two.
        """
        late_s = max(map(self.lasts_s, self.other_buses(device_name)), default=0.0)
        found = self.driver_type(device_name).debounce(self.devices[device_name])
        return {signal: own_s + late_s for signal, own_s in found.items()}

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
