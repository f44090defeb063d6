"""Turns a device YAML into a Config. If the YAML has problems, it raises a SettingsError with each
problem, its line and column.

    kind: lift              a folder of bridges/kinds/ that holds a KIND
    driver: dry_contact     a file of drivers/<kind>/; a device may name another driver with `driver:`
    rmf: {...}              bridges.kinds.shared.rmf_section.Rmf
    buses: {name: {type: a file of drivers/hal/, ...}}
    recording: {...}        bridges.kinds.shared.recording_section.RecordingSettings
    lifts: {name: {...}}    the kind's own key; each device has the driver's `settings`
    fleet: {...}            a section that the devices share, if the kind has one

A kind without hardware has only `kind`, `rmf`, `recording` and one section of its own.

Structs define the content of each section, and `bridges/yaml/values.py` reads them. This module and
`wiring.py` check the sections against each other. The daemon uses only the Config, and repeats no
check.
"""

from functools import partial
from itertools import chain
from pathlib import Path
from typing import Final

import msgspec
from yaml import MappingNode, Node, ScalarNode

from bridges.kinds import kind_called, kind_names
from bridges.kinds.shared.fields import DeviceSettings, Name
from bridges.kinds.shared.graph_kind import AnyGraphKind, AnyKind, GraphKind
from bridges.kinds.shared.recording_section import RecordingSettings
from bridges.kinds.shared.rmf_section import Rmf
from bridges.kinds.shared.rmf_section import warnings as rmf_warnings
from bridges.messages import topics
from bridges.settings import names as named
from bridges.settings.alarms import note_alarms
from bridges.settings.buses import BusRead, read_bus
from bridges.settings.config import Config
from bridges.settings.plausible import late_inputs, long_calls, milliseconds
from bridges.settings.renamed_keys import read_as_renamed
from bridges.settings.top import MAPPING, keys_below, owner, top_keys, word
from bridges.settings.wiring import (
    Use,
    WiringCheck,
    note_conflicts,
    note_echoes,
    note_same_places,
    note_unknown_signals,
    of_bus,
)
from bridges.yaml.parsing import Problem, SettingsError, YamlFile, compose, read
from bridges.yaml.positions import MappingEntry, Spot, below, is_none, locate
from bridges.yaml.spelling import either, unknown
from bridges.yaml.values import BROKEN, Broken, Values, field_names
from drivers.driver_type import AnyDriver
from drivers.hal.points import Wire

__all__ = ["Config", "Problem", "SettingsError", "load", "load_rmf"]

TOPICS = [topic.name for topic in topics.every()]
OF_RMF: Final = {
    "rmf_fleet": ("a fleet adapter's configuration", "--fleet-config"),
    "levels": ("RMF's building map or navigation graph", "--building-map"),
}
"""For the first key of an RMF file: the sort of the file, and the option of `check` for this sort."""


def load(path: Path | str) -> Config:
    """Read a device YAML. Raises SettingsError with every problem found."""
    return understood(path, read(str(path)))


def understood(path: Path | str, text: bytes) -> Config:
    """Return the Config of a device YAML's text. `path`: the file of the text. Raises SettingsError."""
    page = YamlFile(str(path))
    root = compose(page, text)
    _note_rmfs(page, root)
    old = read_as_renamed(page, root)
    reading = _DeviceReading(page, root)
    reading.all()
    page.check()
    return reading.config(Path(path), text, old)


def load_rmf(path: Path | str) -> Rmf:
    """Return the section `rmf` of a file for a command that only joins the graph. The file is a device
    YAML, or has only this section. Raises SettingsError."""
    text = read(str(path))
    page = YamlFile(str(path))
    root = compose(page, text)
    if [key.value for key, _ in root.value] != ["rmf"]:
        return understood(path, text).rmf
    rmf = _DeviceReading(page, root).rmf_alone()
    page.check()
    return rmf


def _note_rmfs(page: YamlFile, root: MappingNode) -> None:
    """Note one problem if the file is one of RMF's files. Otherwise each of its keys would be a
    problem."""
    for key, (what, option) in OF_RMF.items():
        entry = below(root, key)
        if entry and not below(root, "kind"):
            says = f"this is {what}, and no device YAML: rmf-bridge check DEVICE.yaml {option} FILE"
            page.note(entry.key, says)
            page.check()


class _DeviceReading:
    """Reads one file section by section, and notes problems on its page."""

    def __init__(self, page: YamlFile, root: MappingNode) -> None:
        self._page = page
        self._top = Spot(root, root, "the file")
        self._values = Values(page)
        self._kind: AnyKind | None = None
        self._section: object = None
        self._kind_name = ""
        self._driver: AnyDriver | None = None
        self._driver_name = ""
        self._own_drivers: dict[str, AnyDriver | None] = {}
        self._rmf = Rmf()
        self._recording = RecordingSettings()
        self._buses: dict[str, BusRead] = {}
        self._devices: dict[str, DeviceSettings] = {}
        self._uses: list[Use] = []
        self._read: list[Use] = []
        self._on: dict[str, set[str | None]] = {}
        self._written: dict[str, list[str]] = {}
        self._warnings: list[Problem] = []
        self._notes: list[Problem] = []

    def config(self, path: Path, text: bytes, old: list[Problem]) -> Config:
        """Return the Config of the sections that `all` has read. `old`: the warnings about the file's
        old keys."""
        return Config(
            path=path,
            text=text,
            kind=self._kind_name,
            driver=self._driver_name,
            rmf=self._rmf,
            buses={name: bus.settings for name, bus in self._buses.items()},
            devices=self._devices,
            bus_types={name: bus.type or "" for name, bus in self._buses.items()},
            warnings=tuple(sorted([*self._warnings, *old])),
            old_keys=tuple(old),
            notes=tuple(sorted(self._notes)),
            section=self._section,
            recording=self._recording,
        )

    def rmf_alone(self) -> Rmf:
        """Read the section `rmf` of a file that has no other section."""
        for entry in self._values.entries(self._top):
            self._read_rmf(entry.spot())
        return self._rmf

    def all(self) -> None:
        """Read every section. A section is skipped if its meaning depends on an earlier section that is
        wrong."""
        entries = self._values.entries(self._top)
        self._read_kind(below(self._top.node, "kind"))
        if not isinstance(self._kind, GraphKind):
            self._read_driver(below(self._top.node, "driver"))
        sections = self._values.known(
            entries, self._top, top_keys(self._kind), keys_below(self._kind, self._driver)
        )
        if self._kind and self._kind.devices_key in sections:
            self._read_own_drivers(sections[self._kind.devices_key].value)
        if "rmf" in sections:
            self._read_rmf(sections["rmf"].spot())
        if "recording" in sections:
            read = self._values.make(RecordingSettings, sections["recording"].spot())
            self._recording = self._recording if read is BROKEN else read
        if "buses" in sections:
            self._read_buses(sections["buses"].spot())
        if isinstance(self._kind, GraphKind):
            self._read_section(sections.get(self._kind.devices_key), self._kind)
        elif self._kind and self._kind.devices_key in sections:
            if self._kind.section and self._kind.section[0] in sections:
                key, struct = self._kind.section
                self._section = self._values.make(struct, sections[key].spot())
            spot = sections[self._kind.devices_key].spot()
            self._read_devices(spot)
            of_rmf = sections["rmf"].spot() if "rmf" in sections else None
            note_alarms(self._page, self._devices, self._rmf, spot, of_rmf)
        note_same_places(self._page, self._buses.values())
        note_conflicts(self._page, self._uses, self._buses)
        note_echoes(self._page, self._read, self._uses, self._buses)
        self._collect_bus_remarks()

    def _read_kind(self, entry: MappingEntry | None) -> None:
        name = word(self._values, entry, kind_names())
        if name:
            self._kind_name = name
            self._kind = kind_called(name)

    def _read_driver(self, entry: MappingEntry | None) -> None:
        if self._kind is None:
            return
        name = word(self._values, entry, named.driver_names(self._kind_name))
        if name:
            self._driver_name = name
            self._driver = named.driver_called(self._kind_name, name)

    def _read_own_drivers(self, devices: Node) -> None:
        """Read the driver of each device that names its own driver. If the driver does not exist, note
        None for it."""
        for key, value in devices.value if isinstance(devices, MappingNode) else ():
            own = below(value, "driver")
            if own and isinstance(key, ScalarNode) and not is_none(own.value):
                name = word(self._values, own, named.driver_names(self._kind_name))
                driver = named.driver_called(self._kind_name, name) if name else None
                self._own_drivers[key.value] = driver

    def _driver_of(self, device: str) -> AnyDriver | None:
        return self._own_drivers.get(device, self._driver)

    def _read_rmf(self, spot: Spot) -> None:
        rmf = self._values.make(Rmf, spot)
        if rmf is BROKEN:
            return
        self._rmf = rmf
        for name in rmf.topics:
            if name not in TOPICS:
                key = locate(spot, ("topics", name)).key
                self._page.note(key, unknown("topic", name, TOPICS))
        for path, text in rmf_warnings(rmf):
            self._warn(locate(spot, path).where(), text)

    def _read_section(self, entry: MappingEntry | None, kind: AnyGraphKind) -> None:
        """Read the settings of a kind without devices. If all keys are optional, the section may be
        missing."""
        if entry:
            self._section = self._values.make(kind.settings, entry.spot())
            spot = Spot(entry.value, entry.key, entry.spot().label)
            found = kind.warnings(self._section) if kind.warnings and not self._broken() else ()
            for path, text in found:
                self._warn(locate(spot, path).where(), text)
        elif any(field.required for field in msgspec.structs.fields(kind.settings)):
            self._page.note(self._top.at, f"the file needs '{kind.devices_key}': {MAPPING}")
        else:
            self._section = kind.settings()

    def _broken(self) -> bool:
        return self._section is BROKEN or bool(self._page.problems)

    def _names(self, spot: Spot, of: str) -> list[MappingEntry]:
        """Return the entries of a section, and check their keys as names."""
        entries = self._values.entries(spot)
        if isinstance(spot.node, MappingNode) and not spot.node.value:
            self._page.note(spot.at, f"{spot.label} is empty: it needs at least one {of}")
        for entry in entries:
            self._values.make(Name, Spot(entry.key, entry.key, "this name"))
        return entries

    def _read_buses(self, spot: Spot) -> None:
        allowed = self._allowed_types()
        for entry in self._names(spot, "bus"):
            bus = read_bus(entry, allowed, self._driver_name, self._values, self._page)
            self._buses[entry.name] = bus
            self._uses += of_bus(entry.name, bus)
            for path, text in bus.remarks():
                self._warn(locate(entry.spot(), path).where(), f"bus '{entry.name}': {text}")

    def _allowed_types(self) -> list[str]:
        """Return the bus types that at least one driver of the file can use. If a driver is unknown,
        return every type."""
        types, drivers = named.bus_types(), [self._driver, *self._own_drivers.values()]
        return [t for t in types if not all(d and t not in d.buses for d in drivers)]

    def _read_devices(self, spot: Spot) -> None:
        entries = self._names(spot, (self._kind.name if self._kind else ""))
        entries = self._without_sections(entries)
        buses = [self._bus_name(entry) for entry in entries]
        self._on = {entry.name: {bus} for entry, bus in zip(entries, buses, strict=True)}
        for entry, bus in zip(entries, buses, strict=True):
            driver = self._driver_of(entry.name)
            if driver and self._can_stand(entry, bus, driver):
                settings = self._device(entry, bus, driver)
                if settings is not BROKEN:
                    self._devices[entry.name] = settings
        for name in self._buses:
            if entries and name not in chain(*self._on.values()) and None not in buses:
                text = (
                    f"no device uses the bus '{name}': delete it, or name it in a device's 'bus:'"
                )
                self._page.note(self._buses[name].entry.key, text)

    def _without_sections(self, entries: list[MappingEntry]) -> list[MappingEntry]:
        """Return the entries of the section that are devices. Note a problem for each key of a device
        that is not indented below the device."""
        keys = field_names(self._driver.settings) if self._driver else set()
        devices = [entry for entry in entries if entry.name not in keys]
        for entry in entries if devices else ():
            if entry.name in keys:
                text = f"'{entry.name}' stands beside '{devices[0].name}': indent it below"
                self._page.note(entry.key, f"{text} '{devices[0].name}'")
        if entries and not devices:
            one = f"'{entries[0].name}' belongs to one {self._kind_name}"
            text = f"{one}: write the {self._kind_name}'s name in a line above, and indent its keys"
            self._page.note(entries[0].key, text)
        return devices

    def _can_stand(self, device: MappingEntry, bus: str | None, driver: AnyDriver) -> bool:
        """Return whether the device's driver can use the device's bus. This matters only if the device
        names its own driver, because the file's driver was checked before."""
        kind = self._buses[bus].type if bus else None
        if kind is None or kind in driver.buses:
            return True
        on = f"the bus '{bus}' is '{kind}', but the driver of '{device.name}' needs"
        where = below(device.value, "bus") or below(device.value, "driver") or device
        self._page.note(where.where(), f"{on} {either(driver.buses)}")
        return False

    def _bus_name(self, device: MappingEntry) -> str | None:
        """Return the name of a device's bus; None if the name is missing or wrong."""
        entry = below(device.value, "bus")
        if entry is None or is_none(entry.value):
            if len(self._buses) > 1 and isinstance(device.value, MappingNode):
                self._page.note(device.key, f"'{device.name}' needs 'bus': {either(self._buses)}")
            return next(iter(self._buses)) if len(self._buses) == 1 else None
        name = entry.value.value
        if isinstance(entry.value, ScalarNode) and name and self._buses:
            if name in self._buses:
                return str(name)
            self._page.note(entry.value, unknown("bus", name, self._buses))
        return None

    def _device(
        self, entry: MappingEntry, bus: str | None, driver: AnyDriver
    ) -> DeviceSettings | Broken:
        """Read a device's settings, and check its wires."""
        spot = Spot(entry.value, entry.key, entry.spot().label)
        wiring = WiringCheck(self._page, entry, bus or "", self._buses, driver.buses)
        values = Values(self._page, wiring.checks, partial(owner, self._kind_name))
        before = len(self._page.problems)
        settings = values.make(driver.settings, spot)
        self._on[entry.name] |= wiring.others
        if settings is BROKEN:
            wiring.parts(values.structs, spot)
        else:
            wires = list(driver.wires(settings))
            self._check_signals(settings, wires, spot, wiring, driver)
            wiring.pace(settings, spot)
            wiring.reach()
            self._written.setdefault(bus or "", []).extend(wiring.written)
            if len(self._page.problems) == before:
                self._collect_warnings(settings, spot, driver)
                for node, text in wiring.warnings(wires, spot):
                    self._warn(node, f"{spot.label}: {text}")
                for path, text in milliseconds(values.structs):
                    self._warn(locate(spot, path).where(), f"{spot.label}: {text}")
        self._uses += wiring.uses
        self._read += wiring.read
        return settings

    def _check_signals(
        self,
        settings: DeviceSettings,
        wires: list[Wire],
        spot: Spot,
        wiring: WiringCheck,
        driver: AnyDriver,
    ) -> None:
        """Check the wires of a device whose settings are complete and valid."""
        wiring.wires(wires, spot)
        wiring.claims([*driver.claims(settings)], spot)
        wiring.reads(driver.reads(settings), spot)
        signals = [*(wire.signal for wire in wires), *driver.unwired(settings)]
        note_unknown_signals(self._page, settings.accept_unsafe, signals, spot)
        for path, text in late_inputs(settings, driver.debounce(settings)):
            self._page.note(locate(spot, path).where(), text)

    def _collect_warnings(self, settings: DeviceSettings, spot: Spot, driver: AnyDriver) -> None:
        """Collect the warnings about a valid device."""
        for signal, reason in settings.accept_unsafe.items():
            key = locate(spot, ("accept_unsafe", signal)).key
            self._warn(key, f"{spot.label}: unsafe wiring of '{signal}' is accepted: {reason}")
        for path, text in driver.warnings(settings):
            self._warn(locate(spot, path).where(), f"{spot.label}: {text}")
        for path, text in driver.notes(settings):
            node = locate(spot, path).where()
            self._notes.append(self._page.problem(node, f"note: {spot.label}: {text}"))

    def _collect_bus_remarks(self) -> None:
        """Collect remarks about each bus. One remark is about outputs that stay on when this machine
        fails. Others are about a bus that is read too slowly, or that waits too long for an answer."""
        for name, bus in () if self._page.problems else self._buses.items():
            assert bus.hal
            unwatched = bus.hal.unwatched(bus.settings, self._written.get(name, ()))
            devices = [one for device, one in self._devices.items() if name in self._on[device]]
            points = [use.point for use in self._uses if use.bus == name]
            paced = bus.hal.paced(bus.settings, devices, points)
            late = long_calls(bus.settings, devices)
            for path, text in (*unwatched.warnings, *paced, *late):
                self._warn(locate(bus.entry.spot(), path).where(), f"bus '{name}': {text}")
            for path, text in unwatched.notes:
                node = locate(bus.entry.spot(), path).where()
                self._notes.append(self._page.problem(node, f"note: bus '{name}': {text}"))

    def _warn(self, node: Node, text: str) -> None:
        self._warnings.append(self._page.problem(node, f"warning: {text}"))
