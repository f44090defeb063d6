"""Runs plants in real time. One lock guards the plants. One thread runs each event when it is due.

The thread sleeps until the next event of any plant, so an idle simulation costs nothing.
"""

import threading
import time
from collections.abc import Callable, Iterable, Mapping

from hal_fakes.plants.plant import Edge, FailureMode, Plant


class RealTime:
    """A running world. Any thread may call its `plants`.

    The world calls each callback of `on_step` after each step, with the lock held. In such a callback,
    GPIO pins take their levels.
    """

    def __init__(self, plants: Mapping[str, Plant]) -> None:
        self.lock = threading.RLock()
        self.plants: dict[str, Plant] = {n: _Serialised(p, self) for n, p in plants.items()}
        self.on_step: list[Callable[[float], None]] = []
        self._plain = list(plants.values())
        self._due = threading.Condition(self.lock)
        self._stirred = True
        self._next_at = float("inf")
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="plants", daemon=True)
        self._thread.start()

    def stir(self) -> None:
        """Compute the time of the next event again, because somebody drove a plant."""
        with self.lock:
            self._stirred = True
            self._due.notify()

    def show(self) -> None:
        """Let the buses see changed contacts at once, in the caller's thread. Wake the world's thread
        if necessary."""
        with self.lock:
            if self._step() < self._next_at:
                self.stir()

    def close(self) -> None:
        """Stop the plants' time. The caller may call `close` twice."""
        with self.lock:
            self._closed = True
            self._due.notify()
        self._thread.join()

    def _run(self) -> None:
        with self.lock:
            while not self._closed:
                self._stirred = False
                self._next_at = self._step()
                if not self._stirred and not self._closed:
                    self._due.wait(_timeout(self._next_at))

    def _step(self) -> float:
        now = time.monotonic()
        for plant in self._plain:
            plant.advance(now)
        for shown in self.on_step:
            shown(now)
        return min((p.next_at() for p in self._plain), default=float("inf"))


def _timeout(next_at: float) -> float | None:
    return None if next_at == float("inf") else max(0.0, next_at - time.monotonic())


class _Serialised:
    """One plant that any thread may call, because each call holds the world's lock. After a drive the
    world computes its next event again."""

    def __init__(self, plant: Plant, world: RealTime) -> None:
        self.name = plant.name
        self._plant = plant
        self._world = world

    @property
    def edges(self) -> list[Edge]:
        with self._world.lock:
            return list(self._plant.edges)

    @edges.setter
    def edges(self, edges: list[Edge]) -> None:
        with self._world.lock:
            self._plant.edges = edges

    @property
    def on_edge(self) -> Callable[[Edge], None] | None:
        return self._plant.on_edge

    @on_edge.setter
    def on_edge(self, listener: Callable[[Edge], None] | None) -> None:
        with self._world.lock:
            self._plant.on_edge = listener

    @property
    def failures(self) -> Mapping[str, FailureMode]:
        with self._world.lock:
            return dict(self._plant.failures)

    def drive(self, signal: str, asserted: bool, now: float) -> None:
        with self._world.lock:
            self._plant.drive(signal, asserted, now)
            self._world.stir()

    def advance(self, now: float) -> None:
        with self._world.lock:
            self._plant.advance(now)

    def sense(self, signal: str) -> bool:
        with self._world.lock:
            return self._plant.sense(signal)

    def reading(self) -> object:
        with self._world.lock:
            return self._plant.reading()

    def names(self) -> Mapping[str, list[str]]:
        return self._plant.names()

    def next_at(self) -> float:
        with self._world.lock:
            return self._plant.next_at()

    def add_parts(self, parts: Iterable[str]) -> None:
        with self._world.lock:
            self._plant.add_parts(parts)

    def fail(self, part: str, mode: FailureMode | None) -> None:
        with self._world.lock:
            self._plant.advance(time.monotonic())
            self._plant.fail(part, mode)
            self._world.stir()

    def press(self, signal: str, asserted: bool, now: float) -> None:
        with self._world.lock:
            self._plant.press(signal, asserted, now)
            self._world.show()
