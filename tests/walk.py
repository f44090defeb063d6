"""Visits all states that can be reached with given steps. Also visits all sequences of given moves."""

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

W = TypeVar("W")
M = TypeVar("M")

Seen = Callable[[Any], None]
"""A function that receives each step of a walk."""


def unseen(step: object) -> None:
    """Ignore the step. This is the default for walks that check no steps."""


def reached(
    roots: Iterable[W],
    depth: int,
    neighbours: Callable[[W], Iterable[W]],
    key: Callable[[W], Hashable] = lambda state: state,
) -> list[W]:
    """Return every state within `depth` steps from the roots. Each state comes once, the nearest first.

    Two states with the same `key` count as one state, so both must behave in the same way.
    """
    found = {key(root): root for root in roots}
    edge = list(found.values())
    for _ in range(depth):
        fresh: list[W] = []
        for state in edge:
            for neighbour in neighbours(state):
                name = key(neighbour)
                if name not in found:
                    found[name] = neighbour
                    fresh.append(neighbour)
        edge = fresh
    return list(found.values())


def histories(
    state: W, moves: Sequence[M], depth: int, after: Callable[[W, M], W]
) -> Iterator[tuple[W, tuple[M, ...]]]:
    """Yield (last state, moves) for each history with `depth` moves. `after` applies a move to a
    state."""
    if depth == 0:
        yield state, ()
        return
    for move in moves:
        for end, rest in histories(after(state, move), moves, depth - 1, after):
            yield end, (move, *rest)


@dataclass(frozen=True)
class Walker(Generic[W, M]):
    """A world whose states a walk visits. A step is a move, which takes no time, or a wait of some
    seconds. `seen` receives each step."""

    moves: Mapping[str, M]
    waits: Sequence[float]
    moved: Callable[[W, M, Seen], W]
    waited: Callable[[W, float, Seen], W]
    key: Callable[[W], Hashable] = lambda state: state

    def path(self, world: W, *steps: str | float, seen: Seen = unseen) -> W:
        """Return the state after these moves and waits."""
        for step in steps:
            if isinstance(step, str):
                world = self.moved(world, self.moves[step], seen)
            else:
                world = self.waited(world, step, seen)
        return world

    def neighbours(self, world: W, seen: Seen = unseen) -> Iterator[W]:
        """Yield every state that is one step away."""
        steps: list[str | float] = [*self.moves, *self.waits]
        for step in steps:
            yield self.path(world, step, seen=seen)

    def walk(self, roots: Iterable[W], depth: int, seen: Seen = unseen) -> list[W]:
        """Return every state within `depth` steps from the roots. Each state comes once."""
        return reached(roots, depth, lambda world: self.neighbours(world, seen), self.key)
