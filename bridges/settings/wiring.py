"""Checks the wires of a file against each other: invalid points, points used twice, unsafe wires.

The bus type knows the spelling of its points and the impossible wires (`canonical` and `wire_problems`
of its `BUS` in `drivers/hal/`).
"""

from collections.abc import Iterable
from typing import Literal

from msgspec import Struct
from yaml import Node

from bridges.yaml.parsing import YamlFile
from bridges.yaml.positions import Spot, below, locate
from bridges.yaml.spelling import unknown
from bridges.yaml.values import BROKEN, Check
from drivers.hal import AnyBus
from drivers.hal.points import Input, Output, Wire


class Use(Struct, frozen=True):
    """A point of a bus that a device uses, in its canonical spelling (`point`) and as `written`."""

    bus: str
    point: str
    written: str
    user: str
    node: Node
    direction: Literal["in", "out"] | None = None


class WiringCheck:
    """Collects and checks a device's points, first while its settings are read, and again as wires.

    `written`: the points that the daemon itself must switch off again.
    """

    def __init__(self, page: YamlFile, device: str, bus: str, hal: AnyBus | None) -> None:
        self._page = page
        self._device = device
        self._bus = bus
        self._hal = hal
        self.uses: list[Use] = []
        self.written: list[str] = []
        self.checks: dict[str, Check] = {"point": self._point}

    def _point(self, text: str, spot: Spot) -> str | None:
        return self._use(text, spot.path[:-1], spot.node)

    def _use(
        self,
        point: str,
        path: tuple[str, ...],
        node: Node,
        direction: Literal["in", "out"] | None = None,
    ) -> str | None:
        if self._hal is None:
            return None
        try:
            name = self._hal.canonical(point)
        except ValueError as error:
            return str(error)
        user = f"{self._device} {'.'.join(path)}"
        self.uses.append(Use(self._bus, name, point, user, node, direction))
        return None

    def wires(self, wires: Iterable[Wire], spot: Spot) -> None:
        """Check a driver's wires, which replace the points collected while the settings were read."""
        self.uses.clear()
        for wire in wires:
            places = [("point", wire.point)]
            if wire.flash is not None:
                places.append(("flash", wire.flash.point))
            stands = [self._stands(wire, key, text, spot) for key, text in places]
            if all(stands):
                self._judge(wire, spot)
                if wire.direction == "out" and wire.flash is None and self._hal:
                    self.written.append(self._hal.canonical(wire.point))

    def _stands(self, wire: Wire, key: str, text: str, spot: Spot) -> bool:
        """Record the wire's use of this point; return False if the point is invalid."""
        entry = locate(spot, wire.path)
        point = below(entry.value, key)
        node = point.value if point else entry.where()
        reason = self._use(text, wire.path or (wire.signal,), node, wire.direction)
        if reason:
            self._page.note(node, reason)
        return reason is None

    def warnings(self, wires: Iterable[Wire], spot: Spot) -> Iterable[tuple[Node, str]]:
        """Yield (node, text) for wires that are legal but may be a mistake."""
        for wire in wires:
            for text in self._hal.wire_warnings(wire) if self._hal else ():
                yield locate(spot, wire.path).where(), f"'{wire.signal}': {text}"

    def claims(self, places: Iterable[tuple[str, tuple[str, ...]]], spot: Spot) -> None:
        """Record the exclusive places of a device without wires: (place, path in its YAML)."""
        for text, path in places:
            user = f"{self._device} {'.'.join(path)}"
            self.uses.append(Use(self._bus, text, text, user, locate(spot, path).where()))
            self.written.append(text)

    def reach(self, bus: object) -> None:
        """Note the points that a bus with these settings does not have. `bus`: BROKEN if unknown."""
        for use in self.uses if self._hal and bus is not BROKEN else ():
            assert self._hal
            reason = self._hal.unreachable(bus, use.point)
            if not reason and use.direction:
                reason = self._hal.unfit(bus, use.point, use.direction)
            if reason:
                self._page.note(use.node, reason)

    def parts(self, structs: Iterable[tuple[tuple[str, ...], object]], spot: Spot) -> None:
        """Check the wires of a device whose other settings are invalid, so that it has no wiring
        table."""
        for path, struct in structs:
            if isinstance(struct, Input):
                pull, debounce_s = struct.pull, struct.debounce_s
                wire = Wire(path[-1], "in", struct.point, struct.active, pull, debounce_s, path)
                self._judge(wire, spot)
            elif isinstance(struct, Output):
                wire = Wire(path[-1], "out", struct.point, struct.active, path=path)
                self._judge(wire, spot)

    def _judge(self, wire: Wire, spot: Spot) -> None:
        for text in self._hal.wire_problems(wire) if self._hal else ():
            name = wire.path[-1] if wire.path else wire.signal
            self._page.note(locate(spot, wire.path).key, f"'{name}': {text}")


def note_conflicts(page: YamlFile, uses: Iterable[Use]) -> None:
    """Note each point that two signals use, at the later place in the file."""
    first: dict[tuple[str, str], Use] = {}
    for use in sorted(uses, key=lambda u: (u.node.start_mark.line, u.node.start_mark.column)):
        other = first.setdefault((use.bus, use.point), use)
        if other is not use:
            line = other.node.start_mark.line + 1
            point = use.point if use.written == use.point else f"{use.written} ({use.point})"
            taken = f"{point} is used by {other.user} on line {line}"
            page.note(use.node, f"{taken}: {use.user} needs a point of its own")


def note_unknown_signals(
    page: YamlFile, accepted: Iterable[str], signals: list[str], s: Spot
) -> None:
    """Note names in `accept_unsafe` that are no signals of the device."""
    for signal in accepted:
        if signal not in signals:
            page.note(locate(s, ("accept_unsafe", signal)).key, unknown("signal", signal, signals))
