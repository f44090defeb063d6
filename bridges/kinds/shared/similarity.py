"""Estimates the similarity transform (rotation, scale, shift) between two maps, from pairs of points.

The fleet adapter template estimates the same least-squares transform with `nudged`, from a fleet
configuration's `reference_coordinates` (open-rmf/fleet_adapter_template, fleet_adapter.py). `nudged`
also gives the same mean squared error. In this file a point is a complex number: x + y·i.
"""

import cmath
from collections.abc import Sequence

from msgspec import Struct

Point = tuple[float, float]


class Similarity(Struct, frozen=True):
    """The transform `to = turn · from + shift`.

    `mse`: the mean squared error of the pairs from which the transform was estimated, in squared units
    of `to`.
    """

    turn: complex
    shift: complex
    mse: float

    @property
    def rotation(self) -> float:
        """The rotation, counterclockwise, in radians."""
        return cmath.phase(self.turn)

    @property
    def scale(self) -> float:
        """The length of one unit of `from`, in units of `to`."""
        return abs(self.turn)

    @property
    def error(self) -> float:
        """The square root of `mse`, in units of `from`."""
        return float(self.mse**0.5 / self.scale)

    def there(self, at: Point) -> Point:
        """Transform a point of `from` to `to`."""
        found = self.turn * complex(*at) + self.shift
        return found.real, found.imag

    def back(self, at: Point) -> Point:
        """Transform a point of `to` back to `from`."""
        found = (complex(*at) - self.shift) / self.turn
        return found.real, found.imag


def estimate(these: Sequence[Point], those: Sequence[Point]) -> Similarity:
    """Estimate the transform from pairs of points: each point of `these`, and the point of `those` at
    the same index. Raises ValueError."""
    if len(these) != len(those):
        raise ValueError(f"{len(these)} points and {len(those)} points do not make pairs")
    if len(these) < 2:
        raise ValueError("two pairs at least are needed, four are better")
    p, q = [complex(*at) for at in these], [complex(*at) for at in those]
    middle_p, middle_q = sum(p) / len(p), sum(q) / len(q)
    spread = sum(abs(a - middle_p) ** 2 for a in p)
    common = sum((a - middle_p).conjugate() * (b - middle_q) for a, b in zip(p, q, strict=True))
    if not spread or not common:
        raise ValueError("the points of one map are all the same, or have nothing in common")
    turn = common / spread
    shift = middle_q - turn * middle_p
    errors = (abs(turn * a + shift - b) ** 2 for a, b in zip(p, q, strict=True))
    return Similarity(turn, shift, sum(errors) / len(p))


def odd_pair(these: Sequence[Point], those: Sequence[Point], most: float) -> str:
    """Return a clause that names the pair without which the others fit, with an error of at most
    `most`. Return "" if there is no such pair, more than one, or too few pairs to tell."""
    if len(these) < 4:
        return ""
    left = [
        [each for n, each in enumerate(zip(these, those, strict=True)) if n != odd]
        for odd in range(len(these))
    ]
    fits = [n for n, pairs in enumerate(left, 1) if _fits(pairs, most)]
    return f"; without pair {fits[0]} the others fit" if len(fits) == 1 else ""


def fits_mirrored(these: Sequence[Point], those: Sequence[Point], most: float) -> bool:
    """Return whether the pairs fit, with an error of at most `most`, if one map is the mirror image of
    the other. Pairs on one line fit both ways."""
    return _fits([(one, (x, -y)) for one, (x, y) in zip(these, those, strict=True)], most)


def _fits(pairs: Sequence[tuple[Point, Point]], most: float) -> bool:
    try:
        return estimate([one for one, _ in pairs], [other for _, other in pairs]).error <= most
    except ValueError:
        return False
