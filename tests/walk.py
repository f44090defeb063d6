"""Every state that something can reach within some steps, and every history of so many moves."""

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

W = TypeVar("W")
M = TypeVar("M")

Seen = Callable[[Any], None]
"""Told of every step on the way."""


def unseen(step: object) -> None:
    """For a walk whose steps nobody looks at."""


def reached(
    roots: Iterable[W],
    depth: int,
    neighbours: Callable[[W], Iterable[W]],
    key: Callable[[W], Hashable] = lambda state: state,
) -> list[W]:
    """Breadth first from the roots: every state within `depth` steps, once.

    `key`: equal for states that cannot behave differently.
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
    """Every history of `depth` moves: where it ends and its moves. `after` changes nothing in place."""
    if depth == 0:
        yield state, ()
        return
    for move in moves:
        for end, rest in histories(after(state, move), moves, depth - 1, after):
            yield end, (move, *rest)


@dataclass(frozen=True)
class Walker(Generic[W, M]):
    """How a world goes on: by a move, in no time, or by waiting (s). Both tell `seen` of each step."""

    moves: Mapping[str, M]
    waits: Sequence[float]
    moved: Callable[[W, M, Seen], W]
    waited: Callable[[W, float, Seen], W]
    key: Callable[[W], Hashable] = lambda state: state

    def path(self, world: W, *steps: str | float, seen: Seen = unseen) -> W:
        """The state that these moves and waits lead to."""
        for step in steps:
            if isinstance(step, str):
                world = self.moved(world, self.moves[step], seen)
            else:
                world = self.waited(world, step, seen)
        return world

    def neighbours(self, world: W, seen: Seen = unseen) -> Iterator[W]:
        """Every state one step away."""
        steps: list[str | float] = [*self.moves, *self.waits]
        for step in steps:
            yield self.path(world, step, seen=seen)

    def walk(self, roots: Iterable[W], depth: int, seen: Seen = unseen) -> list[W]:
        """Every state within `depth` steps of the roots, once."""
        return reached(roots, depth, lambda world: self.neighbours(world, seen), self.key)
