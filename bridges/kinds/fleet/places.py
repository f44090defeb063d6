"""The navigation graph of a fleet, and a robot's place on it."""

import math
from collections.abc import Iterator, Mapping

from msgspec import Struct, field

from bridges.kinds.fleet.signals import Pose
from bridges.kinds.shared.similarity import Similarity

EVERY_LEVEL = ""
"""The level name of a transform that applies to every level."""


class Vertex(Struct, frozen=True):
    """One waypoint, on RMF's map (m). `name`: "" for a waypoint without a name."""

    level: str
    x: float
    y: float
    name: str = ""
    charger: bool = False
    lift: str = ""

    def pose(self) -> Pose:
        """Return the vertex as a place on RMF's map."""
        return Pose(self.level, self.x, self.y)


class Lane(Struct, frozen=True):
    """A lane from one vertex to another, by their numbers in the graph. `dock`: the name of the dock at
    the lane's end; "" without a dock."""

    start: int
    end: int
    dock: str = ""
    speed_limit: float | None = None


class NavGraph(Struct, frozen=True):
    """RMF's navigation graph: vertices of all levels, and lanes."""

    vertices: tuple[Vertex, ...] = ()
    lanes: tuple[Lane, ...] = ()

    def levels(self) -> list[str]:
        """Return the names of the levels, in the file's order."""
        return list(dict.fromkeys(vertex.level for vertex in self.vertices))

    def called(self, name: str) -> Vertex | None:
        """Return the vertex with this name."""
        return next((vertex for vertex in self.vertices if vertex.name == name), None)

    def nearest(self, at: Pose, within_m: float, chargers: bool = False) -> Vertex | None:
        """Return the nearest named vertex of the level within this distance."""
        on_level = (v for v in self.vertices if v.level == at.map and v.name)
        near = [(_apart(v, at), v) for v in on_level if v.charger or not chargers]
        distance, found = min(near, key=lambda pair: pair[0], default=(math.inf, None))
        return found if distance <= within_m else None

    def off_m(self, at: Pose) -> float:
        """Return the distance from the nearest lane or vertex of the level (m); inf on another map."""
        return min(self._distances(at), default=math.inf)

    def _distances(self, at: Pose) -> Iterator[float]:
        for lane in self.lanes:
            a, b = self.vertices[lane.start], self.vertices[lane.end]
            if a.level == b.level == at.map:
                yield off_line_m(a, b, at)
        yield from (_apart(v, at) for v in self.vertices if v.level == at.map)


def _apart(vertex: Vertex, at: Pose) -> float:
    return math.hypot(vertex.x - at.x, vertex.y - at.y)


def off_line_m(a: Pose | Vertex, b: Pose | Vertex, place: Pose) -> float:
    """Return the distance of `place` from the line between `a` and `b` (m). All three must be on the
    same map."""
    start, at = complex(a.x, a.y), complex(place.x, place.y)
    along = complex(b.x, b.y) - start
    if not along:
        return abs(at - start)
    share = ((at - start) * along.conjugate()).real / abs(along) ** 2
    return abs(at - start - along * min(1.0, max(0.0, share)))


class RobotSite(Struct, frozen=True):
    """The facts about one robot from RMF's two files, the graph and `config.yaml`.

    `transforms` maps a level to the transform from RMF's map to the robot's map. `charger`: the robot's
    charger in `config.yaml`.
    """

    graph: NavGraph = NavGraph()
    transforms: Mapping[str, Similarity] = field(default_factory=dict)
    charger: str = ""

    def on_rmfs_map(self, at: Pose) -> Pose:
        """Convert a place on the robot's map to the same place on RMF's map."""
        found = self._transform(at.map)
        if found is None:
            return at
        x, y = found.back((at.x, at.y))
        return Pose(at.map, x, y, at.yaw - found.rotation)

    def on_robots_map(self, at: Pose) -> Pose:
        """Convert a place on RMF's map to the same place on the robot's map."""
        found = self._transform(at.map)
        if found is None:
            return at
        x, y = found.there((at.x, at.y))
        return Pose(at.map, x, y, at.yaw + found.rotation)

    def metre(self, level: str) -> float:
        """Return the length of one metre of RMF's map in units of the robot's map."""
        found = self._transform(level)
        return 1.0 if found is None else found.scale

    def _transform(self, level: str) -> Similarity | None:
        return self.transforms.get(level, self.transforms.get(EVERY_LEVEL))
