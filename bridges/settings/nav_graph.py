"""RMF's navigation graph, with its geometry, as the daemon of a fleet needs it.

    levels:
      L1:
        vertices: [[x, y, {name: pantry, is_charger: true, lift: Lift1}], ...]
        lanes: [[0, 1, {dock_name: dock_a, speed_limit: 0.5, door_name: D1}], ...]
    lifts: {Lift1: {...}}
    doors: {D1: {...}}

A lane names its two vertices by their index (from 0) in the list of its level. RMF's adapter ends with
an exception in three cases: a name occurs twice, a lane joins two lifts, or a vertex names a lift that
is missing in `lifts`. Source: open-rmf/rmf_ros2 9dedd0f,
rmf_fleet_adapter/src/rmf_fleet_adapter/agv/parse_graph.cpp.
"""

import math
from collections.abc import Iterator
from typing import Any

import msgspec

from bridges.kinds.fleet.places import Lane, NavGraph, Vertex
from bridges.settings.building_map import MAP
from bridges.settings.fleet_config import Path, converted, plain_values, problem_at
from bridges.yaml.parsing import SettingsError, YamlFile, compose, read

OF_GRAPH = "is this a navigation graph? The traffic editor's *.building.yaml is not one"


class VertexOptions(msgspec.Struct, frozen=True):
    """The options of a vertex."""

    name: str = ""
    is_charger: bool = False
    lift: str = ""


class LaneOptions(msgspec.Struct, frozen=True):
    """The options of a lane."""

    dock_name: str = ""
    door_name: str = ""
    speed_limit: float | None = None
    orientation_constraint: str = ""


class GraphLevel(msgspec.Struct, frozen=True):
    """One level of the graph."""

    vertices: list[tuple[float, float, VertexOptions]] = []
    lanes: list[tuple[int, int, LaneOptions]] = []


class GraphContents(msgspec.Struct, frozen=True):
    """The whole file. `lifts`, `doors`: None in a graph of an older traffic editor."""

    levels: dict[str, GraphLevel]
    lifts: dict[str, Any] | None = None
    doors: dict[str, Any] | None = None


def load_graph(file: str, text: bytes | None = None) -> NavGraph:
    """Read a navigation graph. Raises SettingsError with every problem.

    `text`: the file's bytes, if the caller has them already.
    """
    page = YamlFile(file)
    root = compose(page, read(file, MAP) if text is None else text, MAP)
    page.check()
    contents = converted(file, root, plain_values(page, root), GraphContents, OF_GRAPH)
    problems = [problem_at(file, root, *found) for found in _problems(contents)]
    if problems:
        raise SettingsError(sorted(problems))
    return _graph(contents)


def _graph(contents: GraphContents) -> NavGraph:
    vertices: list[Vertex] = []
    lanes: list[Lane] = []
    for name, level in contents.levels.items():
        first = len(vertices)
        for x, y, has in level.vertices:
            vertices.append(Vertex(name, x, y, has.name, has.is_charger, has.lift))
        for start, end, has_lane in level.lanes:
            ends = first + start, first + end
            lanes.append(Lane(*ends, has_lane.dock_name, has_lane.speed_limit))
    return NavGraph(tuple(vertices), tuple(lanes))


def _problems(contents: GraphContents) -> Iterator[tuple[Path, str]]:
    seen: dict[str, str] = {}
    for name, level in contents.levels.items():
        for i, (x, y, has) in enumerate(level.vertices):
            path = ("levels", name, "vertices", str(i))
            if not (math.isfinite(x) and math.isfinite(y)):
                yield path, "its x or y is no number"
            if has.name and seen.setdefault(has.name, f"{name} {i}") != f"{name} {i}":
                yield (
                    path,
                    f"a second waypoint '{has.name}': RMF's adapter would end with an error",
                )
            if has.lift and contents.lifts is not None and has.lift not in contents.lifts:
                yield (
                    path,
                    f"the lift '{has.lift}' is not below 'lifts': RMF's adapter would end with an"
                    " error",
                )
        yield from _of_lanes(name, level)


def _of_lanes(name: str, level: GraphLevel) -> Iterator[tuple[Path, str]]:
    known = len(level.vertices)
    for i, (start, end, has) in enumerate(level.lanes):
        path = ("levels", name, "lanes", str(i))
        if not (0 <= start < known and 0 <= end < known):
            yield (
                path,
                f"joins vertices {start} and {end}, but '{name}' has {known} vertices, numbered"
                " from 0",
            )
            continue
        lifts = {level.vertices[at][2].lift for at in (start, end)} - {""}
        if len(lifts) > 1:
            yield (
                path,
                f"joins the lifts {' and '.join(sorted(lifts))}: RMF's adapter would end with an"
                " error",
            )
        if has.orientation_constraint not in ("", "forward", "backward"):
            yield (
                path,
                f"orientation_constraint is forward or backward, not {has.orientation_constraint}",
            )
