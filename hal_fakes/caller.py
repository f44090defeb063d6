"""A connection to the control socket of a running simulation. `control.py` lists the orders."""

import json
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from hal_fakes.plants.plant import Edge

PATIENCE_S: Final = 120.0


class SimulationRefused(Exception):
    """The error that `order` raises if the simulation refuses an order. The error's text is the
    simulation's answer."""


class Caller:
    """A connection. Raises OSError if nobody listens, or if no answer comes within `patience_s`. If
    `patience_s` is None, the connection waits for ever."""

    def __init__(self, path: Path, patience_s: float | None = PATIENCE_S) -> None:
        self._end = socket.socket(socket.AF_UNIX)
        try:
            self._end.settimeout(patience_s)
            self._end.connect(str(path))
        except OSError:
            self._end.close()
            raise
        self._lines = self._end.makefile("r", encoding="utf-8")

    def __enter__(self) -> "Caller":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def say(self, line: str) -> str:
        """Send a line. Return the next line that the simulation sends."""
        self._end.sendall(line.encode() + b"\n")
        return self.hear()

    def order(self, line: str) -> None:
        """Send an order. Raises SimulationRefused if the plant does not obey."""
        answer = self.say(line)
        if answer != "ok":
            raise SimulationRefused(f"{line}: {answer or 'no answer'}")

    def hear(self) -> str:
        """Return the next line. Return "" after the simulation has closed the connection."""
        return self._lines.readline().rstrip("\n")

    def edges(self) -> Iterator[Edge]:
        """Yield every edge (a change of a relay or contact) until the simulation closes the connection.
        The caller must send the order `follow` first."""
        while line := self.hear():
            yield Edge(**json.loads(line))

    def edge(self, signal: str, value: bool) -> float:
        """Wait for this edge. Return its monotonic time (s). The caller must send the order `follow`
        first."""
        return next(e.at for e in self.edges() if (e.signal, e.value) == (signal, value))

    def close(self) -> None:
        """Close the connection. The caller may call `close` twice."""
        self._lines.close()
        self._end.close()
