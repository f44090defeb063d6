"""Ways over a navigation graph, for robots in a simulation. Each vertex is known by its number."""

import heapq
import math

from bridges.kinds.fleet.places import NavGraph, Vertex
from bridges.kinds.fleet.signals import Pose


class Ways:
    """The lanes of a graph, and the rides between the floors of a lift."""

    def __init__(self, graph: NavGraph) -> None:
        self.graph = graph
        self._edges = _edges(graph)

    def nearest(self, at: Pose) -> int:
        """Return the vertex of this level that is nearest to a place."""
        on_level = [(i, v) for i, v in enumerate(self.graph.vertices) if v.level == at.map]
        return min(on_level, key=lambda one: math.hypot(one[1].x - at.x, one[1].y - at.y))[0]

    def goals(self, level: str = "") -> list[int]:
        """Return the named vertices, of one level or of all; chargers only if there are no others."""
        named = [(i, v) for i, v in enumerate(self.graph.vertices) if v.name and not v.lift]
        named = [(i, v) for i, v in named if level in ("", v.level)]
        return [i for i, v in named if not v.charger] or [i for i, _ in named]

    def shortest(self, start: int, goal: int, avoided: set[int]) -> list[int]:
        """Return the vertices of the shortest way; [] if there is none."""
        queue: list[tuple[float, int, list[int]]] = [(0.0, start, [start])]
        seen = set(avoided)
        while queue:
            far, at, way = heapq.heappop(queue)
            if at == goal:
                return way
            if at in seen:
                continue
            seen.add(at)
            for after, length in self._edges.get(at, ()):
                heapq.heappush(queue, (far + length, after, [*way, after]))
        return []


def _edges(graph: NavGraph) -> dict[int, list[tuple[int, float]]]:
    """Return the lanes, and the rides between the floors of a lift."""
    found: dict[int, list[tuple[int, float]]] = {}
    for lane in graph.lanes:
        ends = graph.vertices[lane.start], graph.vertices[lane.end]
        found.setdefault(lane.start, []).append((lane.end, _apart(*ends)))
    for i, one in enumerate(graph.vertices):
        for j, other in enumerate(graph.vertices):
            if one.lift and one.lift == other.lift and one.level != other.level:
                found.setdefault(i, []).append((j, 20.0))
    return found


def _apart(one: Vertex, other: Vertex) -> float:
    return math.hypot(one.x - other.x, one.y - other.y)
