"""The names on RMF's map of a building: levels, lifts, doors, waypoints. Our files must use these
names.

Two sorts of file hold the map, and both are accepted. The traffic editor writes `*.building.yaml`. In
this file a parameter is the pair [number of its type, value].

    levels: {L1: {vertices: [[x, y, z, name, {is_charger: [4, true]}]],
                  doors: [[from, to, {name: [1, D1]}]]}}
    lifts: {Lift1: {level_doors: {L1: [door]}}}

RMF generates a navigation graph from that file. Older graphs lack `lifts` and `doors`.

    levels: {L1: {vertices: [[x, y, {name: A, lift: Lift1, is_charger: true}]],
                  lanes: [[from, to, {door_name: D1}]]}}
    lifts: {Lift1: …}
    doors: {D1: …}

Source: open-rmf/rmf_traffic_editor 65437ea, rmf_building_map_tools/building_map (vertex.py, edge.py,
lift.py, building.py), and rmf_ros2's parse_graph.cpp, which reads the graph.
"""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

from msgspec import Struct, field
from yaml import CollectionNode, MappingNode, Node, ScalarNode, SequenceNode

from bridges.kinds.shared.kind import CHARGER, DOOR, FLOOR, LIFT, WAYPOINT
from bridges.yaml.parsing import Sort, YamlFile, compose, read

MAP = Sort("building map or navigation graph", "levels: ...", 1024 * 1024, 100_000)
"""The limits of a map file. Larger files are refused, because even a file of this size takes some
seconds to read."""

Lines = dict[str, int]
"""A mapping from a name to the line on which the name first occurs."""
Place = tuple[str, float, float]
"""A place: its level, x and y."""


class BuildingMap(Struct, frozen=True):
    """The names of one file.

    - `named`: maps a sort of name (such as FLOOR) to the names of this sort and their lines
    - `stops`: maps a lift to its floors
    - `places`: maps a waypoint to its level, x and y (m). Only a navigation graph has them, because the
      traffic editor's file has pixels.
    """

    file: str
    named: Mapping[str, Lines]
    stops: Mapping[str, Lines]
    places: Mapping[str, Place] = field(default_factory=dict)


def load_map(file: str) -> BuildingMap:
    """Read a building map or navigation graph. Raises SettingsError with its problems."""
    page = YamlFile(file)
    root = compose(page, read(file, MAP), MAP)
    page.check()
    reading = _MapReading(page)
    reading.all(root)
    page.check()
    return BuildingMap(file, reading.named, reading.stops, reading.places)


class _MapReading:
    """Collects the names of one file. It notes deviations from RMF's format as problems of the file."""

    def __init__(self, page: YamlFile) -> None:
        self.named: dict[str, Lines] = {w: {} for w in (FLOOR, LIFT, DOOR, CHARGER, WAYPOINT)}
        self.stops: dict[str, Lines] = {}
        self.places: dict[str, Place] = {}
        self._page = page

    def all(self, root: MappingNode) -> None:
        """Read levels, lifts and doors from either sort of file."""
        if _below(root, "levels") is None:
            self._page.note(root, f"this is not a {MAP.name}: it has no 'levels:'")
        for level, node in self._entries(root, "levels"):
            self._add(FLOOR, level)
            for vertex in self._items(node, "vertices", "a vertex"):
                self._vertex(level, vertex)
            for edge in self._items(node, "doors", "a door"):
                self._add(DOOR, _param(edge, "name"))
            for edge in self._items(node, "lanes", "a lane"):
                self._add(DOOR, _param(edge, "door_name"))
        for lift, node in self._entries(root, "lifts"):
            self._add(LIFT, lift)
            for level, doors in self._entries(node, "level_doors"):
                if not isinstance(doors, SequenceNode) or doors.value:
                    self._add_stop(lift, level)
        for door, _ in self._entries(root, "doors"):
            self._add(DOOR, door)

    def _vertex(self, level: ScalarNode, vertex: SequenceNode) -> None:
        name = _param(vertex, "name")
        if name is None and len(vertex.value) > 3 and isinstance(vertex.value[3], ScalarNode):
            name = vertex.value[3]
        self._add(WAYPOINT, name)
        if name is not None and name.value and len(vertex.value) == 3:
            with suppress(ValueError):
                x, y = (float(at.value) for at in vertex.value[:2])
                self.places.setdefault(name.value, (level.value, x, y))
        charger = _param(vertex, "is_charger")
        if charger is not None and charger.value.lower() == "true":
            self._add(CHARGER, name)
        lift = _param(vertex, "lift")
        if lift is not None and lift.value:
            self._add(LIFT, lift)
            self._add_stop(lift, level)

    def _add(self, what: str, name: ScalarNode | None) -> None:
        """Add a name. Leave out the empty name "", which vertices and doors without a name have."""
        if name is not None and name.value:
            self.named[what].setdefault(name.value, _line(name))

    def _add_stop(self, lift: ScalarNode, level: ScalarNode) -> None:
        self.stops.setdefault(lift.value, {}).setdefault(level.value, _line(level))

    def _entries(self, node: Node, key: str) -> Iterator[tuple[ScalarNode, Node]]:
        """Yield the entries of the mapping below `key`; nothing if that mapping is missing or empty."""
        for name, value in self._section(node, key, MappingNode, "a mapping (name: ...)"):
            if isinstance(name, ScalarNode):
                yield name, value
            else:
                self._page.note(name, f"a name in '{key}' must be text")

    def _items(self, node: Node, key: str, what: str) -> Iterator[SequenceNode]:
        """Yield the inner lists of the list below `key`; nothing if the outer list is missing or
        empty."""
        for item in self._section(node, key, SequenceNode, "a list"):
            if isinstance(item, SequenceNode):
                yield item
            else:
                self._page.note(item, f"{what} must be a list ([x, y, ...]), as RMF has it")

    def _section(self, node: Node, key: str, kind: type[CollectionNode], what: str) -> list[Any]:
        """Return the content of the section below `key`; [] if the section is missing or empty."""
        section = _below(node, key)
        if section is None or _is_empty(section):
            return []
        if not isinstance(section, kind):
            self._page.note(section, f"'{key}' must be {what}, as RMF has it")
            return []
        return list(section.value)


def _below(node: Node, key: str) -> Node | None:
    if isinstance(node, MappingNode):
        for name, value in node.value:
            if isinstance(name, ScalarNode) and name.value == key:
                return value  # type: ignore[no-any-return]
    return None


def _param(item: SequenceNode, key: str) -> ScalarNode | None:
    """Return a parameter of a vertex or an edge. The last element of `item` is the mapping of
    parameters. In it, a parameter is written as `V` or `[type, V]`."""
    found = _below(item.value[-1], key) if item.value else None
    if isinstance(found, SequenceNode) and len(found.value) == 2:
        found = found.value[1]
    return found if isinstance(found, ScalarNode) else None


def _is_empty(node: Node) -> bool:
    return isinstance(node, ScalarNode) and node.value in ("", "~", "null")


def _line(node: Node) -> int:
    return int(node.start_mark.line) + 1
