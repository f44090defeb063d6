"""Checks the wires of a file against each other. It finds invalid points, points used twice, and unsafe
wires.

The module of the bus type defines how its points are spelt, and which wires are impossible (`canonical`
and `wire_problems` of its `BUS` in `drivers/hal/`).
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Literal

from msgspec import Struct
from yaml import Node

from bridges.kinds.shared.fields import DeviceSettings
from bridges.settings.buses import BusRead
from bridges.settings.plausible import out_of_step
from bridges.yaml.parsing import YamlFile
from bridges.yaml.positions import MappingEntry, Spot, below, is_none, locate
from bridges.yaml.spelling import either, unknown
from bridges.yaml.values import BROKEN, Check
from drivers.hal import AnyBus
from drivers.hal.points import Input, Output, Wire


class Use(Struct, frozen=True):
    """A use of a point of a bus. `point`: the bus's spelling of the point. `written`: the YAML's
    spelling. `claimed`: the point is a place or name that a driver or bus claims, and no wire's
    point."""

    bus: str
    point: str
    written: str
    user: str
    node: Node
    direction: Literal["in", "out"] | None = None
    claimed: bool = False


class WiringCheck:
    """Collects and checks the points of a device. It does this first while the settings are read, and
    again when the driver has made wires from the settings.

    - `bus`: the device's own bus; "" if unknown
    - `buses`: all buses of the file
    - `usable`: the bus types that the device's driver can use
    - `others`: the other buses on which the device has inputs
    - `written`: the points that stay on until the daemon itself switches them off
    - `read`: the points of a device without wires that tell its state
    """

    def __init__(
        self,
        page: YamlFile,
        device: MappingEntry,
        bus: str,
        buses: Mapping[str, BusRead],
        usable: Collection[str],
    ) -> None:
        self._page = page
        self._device = device.name
        self._spot = device.spot()
        self._bus = bus
        self._buses = buses
        self._usable = usable
        self.uses: list[Use] = []
        self.others: set[str] = set()
        self.written: list[str] = []
        self.read: list[Use] = []
        self.checks: dict[str, Check] = {"point": self._point, "other bus": self._other_bus}

    def _hal(self, bus: str) -> AnyBus | None:
        """Return the type of the bus with this name; None if unknown. For the name "", return the type
        of the device's own bus."""
        found = self._buses.get(bus or self._bus)
        return found.hal if found else None

    def _point(self, text: str, spot: Spot) -> str | None:
        path = spot.path[:-1]
        bus = below(locate(self._spot, path).value, "bus")
        named = str(bus.value.value) if bus and not is_none(bus.value) else self._bus
        return self._use(text, path, spot.node, named) if named in self._buses else None

    def _other_bus(self, name: str, spot: Spot) -> str | None:
        """Return the problem with the name after an input's `bus:`; None without a problem."""
        if name not in self._buses:
            return unknown("bus", name, self._buses)
        if name == self._bus:
            return f"'{name}' is the own bus of '{self._device}': leave 'bus' out here"
        self.others.add(name)
        kind = self._buses[name].type
        if kind is None or kind in self._usable:
            return None
        types = either(self._usable)
        return f"the bus '{name}' is '{kind}' and has no contacts: name a bus of type {types}"

    def _use(
        self,
        point: str,
        path: tuple[str, ...],
        node: Node,
        bus: str = "",
        direction: Literal["in", "out"] | None = None,
    ) -> str | None:
        hal = self._hal(bus)
        if hal is None:
            return None
        try:
            name = hal.canonical(point)
        except ValueError as error:
            return f"{error}{self._where(point)}"
        user = f"{self._device} {'.'.join(path)}"
        self.uses.append(Use(bus or self._bus, name, point, user, node, direction))
        return None

    def _where(self, point: str) -> str:
        """Return a hint that names another bus of the file on which this point could be; "" if there is
        no such bus."""
        for name, bus in self._buses.items():
            if name != self._bus and bus.hal and bus.type in self._usable:
                with suppress(ValueError):
                    bus.hal.canonical(point)
                    return f"; or, for an input on the bus '{name}': bus: {name}"
        return ""

    def wires(self, wires: Iterable[Wire], spot: Spot) -> None:
        """Check a driver's wires. Forget the points that were collected while the settings were read,
        because the wires have the same points."""
        self.uses.clear()
        for wire in wires:
            places = [("point", wire.point)]
            if wire.flash is not None:
                places.append(("flash", wire.flash.point))
            stands = [self._stands(wire, key, text, spot) for key, text in places]
            if all(stands):
                self._judge(wire, spot)
                hal = self._hal("")
                if wire.direction == "out" and wire.flash is None and hal:
                    self.written.append(hal.canonical(wire.point))

    def _stands(self, wire: Wire, key: str, text: str, spot: Spot) -> bool:
        """Record that the wire uses this point. If the point is invalid, note a problem and return
        False."""
        entry = locate(spot, wire.path)
        point = below(entry.value, key)
        node = point.value if point else entry.where()
        reason = self._use(text, wire.path or (wire.signal,), node, wire.bus, wire.direction)
        if reason:
            self._page.note(node, reason)
        return reason is None

    def warnings(self, wires: Iterable[Wire], spot: Spot) -> Iterable[tuple[Node, str]]:
        """Yield a warning (node, text) for each valid wire that may be a mistake."""
        for wire in wires:
            hal = self._hal(wire.bus)
            for text in hal.wire_warnings(wire) if hal else ():
                yield locate(spot, wire.path).where(), f"'{wire.signal}': {text}"

    def claims(self, places: Sequence[tuple[str, tuple[str, ...]]], spot: Spot) -> None:
        """Record the things on the bus that only this device may use, such as CAN frames. A device
        without wires has such things in place of points. Each comes with its path in the YAML."""
        self.uses += self._used(places, spot)
        self.written += [text for text, _ in places]

    def reads(self, places: Iterable[tuple[str, tuple[str, ...]]], spot: Spot) -> None:
        """Record the places that tell the state of a device without wires."""
        self.read += self._used(places, spot)

    def _used(self, places: Iterable[tuple[str, tuple[str, ...]]], spot: Spot) -> Iterator[Use]:
        for text, path in places:
            user = f"{self._device} {'.'.join(path)}"
            yield Use(self._bus, text, text, user, locate(spot, path).where(), claimed=True)

    def reach(self) -> None:
        """Note each point that the bus does not have with its present settings."""
        for use in self.uses:
            bus = self._buses.get(use.bus)
            if bus is None or bus.hal is None or bus.settings is BROKEN:
                continue
            reason = bus.hal.unreachable(bus.settings, use.point)
            if not reason and use.direction:
                reason = bus.hal.unfit(bus.settings, use.point, use.direction)
            if reason:
                self._page.note(use.node, reason)

    def pace(self, settings: DeviceSettings, spot: Spot) -> None:
        """Note each limit of the device that its buses cannot meet, because they are read too
        seldom."""
        others = [self._buses[name].settings for name in self.others]
        own = self._buses[self._bus].settings if self._bus else BROKEN
        for path, text in out_of_step(settings, own, others):
            self._page.note(locate(spot, path).where(), text)

    def parts(self, structs: Iterable[tuple[tuple[str, ...], object]], spot: Spot) -> None:
        """Check the inputs and outputs of a device one by one. This is for a device with other invalid
        settings, because such a device has no wiring table."""
        for path, struct in structs:
            if isinstance(struct, Input):
                wire = struct.wire(path[-1], path, struct.debounce_s)
                self._judge(wire, spot)
            elif isinstance(struct, Output):
                wire = Wire(path[-1], "out", struct.point, struct.active, path=path)
                self._judge(wire, spot)

    def _judge(self, wire: Wire, spot: Spot) -> None:
        hal = self._hal(wire.bus)
        for text in hal.wire_problems(wire) if hal else ():
            name = wire.path[-1] if wire.path else wire.signal
            self._page.note(locate(spot, wire.path).key, f"'{name}': {text}")


def of_bus(name: str, bus: BusRead) -> Iterator[Use]:
    """Yield the places that the bus itself writes, and the names that only one daemon may use."""
    for text, path in bus.hal.claims(bus.settings) if bus.hal and bus.where else ():
        node = locate(bus.entry.spot(), path).where()
        yield Use(name, text, text, f"{name} {'.'.join(path)}", node, claimed=True)


def note_same_places(page: YamlFile, buses: Iterable[BusRead]) -> None:
    """Note each bus that uses the hardware of an earlier bus of the file: the same port, pins or
    gateway.

    Two buses at one HTTP server or MQTT broker are permitted, because they may have different secrets.
    """
    first: dict[str, BusRead] = {}
    for bus in buses:
        where = bus.where
        if where and (where.local or where.clients != "many"):
            other = first.setdefault(where.text, bus)
            if other is not bus:
                line = other.entry.key.start_mark.line + 1
                text = f"'{bus.entry.name}' is {where.text}, as '{other.entry.name}' on line {line}"
                page.note(bus.entry.key, f"{text}: use one bus for all devices there")


def note_conflicts(page: YamlFile, uses: Iterable[Use], buses: Mapping[str, BusRead]) -> None:
    """Note each point that two signals use. The problem is reported at the second use in the file."""
    first: dict[tuple[str, str], Use] = {}
    for use in sorted(uses, key=lambda u: (u.node.start_mark.line, u.node.start_mark.column)):
        other = first.setdefault(_thing(use, buses.get(use.bus)), use)
        if other is not use:
            line = other.node.start_mark.line + 1
            point = use.point if use.written == use.point else f"{use.written} ({use.point})"
            taken = f"{point} is used by {other.user} on line {line}"
            page.note(use.node, f"{taken}: {use.user} needs a point of its own")


def note_echoes(
    page: YamlFile, read: Iterable[Use], uses: Iterable[Use], buses: Mapping[str, BusRead]
) -> None:
    """Note each place that tells a state although a command of the file writes this place. The daemon
    would take its own command for the device's answer."""
    written = {_thing(use, buses.get(use.bus)): use for use in uses}
    for use in read:
        if other := written.get(_thing(use, buses.get(use.bus))):
            line = other.node.start_mark.line + 1
            text = f"{use.point} is written by {other.user} on line {line}"
            page.note(use.node, f"{text}: a state needs a place that the device itself writes")


def _thing(use: Use, bus: BusRead | None) -> tuple[str, str]:
    """Return the place and the name of the thing that is used. Two buses may have the same place."""
    if bus is None or bus.hal is None or bus.where is None:
        return use.bus, use.point
    what = use.point if use.claimed else bus.hal.place(bus.settings, use.point)
    return (bus.where.text, what) if what else (use.bus, use.point)


def note_unknown_signals(
    page: YamlFile, accepted: Iterable[str], signals: list[str], s: Spot
) -> None:
    """Note each name in `accept_unsafe` that is not a signal of the device."""
    for signal in accepted:
        if signal not in signals:
            page.note(locate(s, ("accept_unsafe", signal)).key, unknown("signal", signal, signals))
