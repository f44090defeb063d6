"""The protocol of plants: physics driven by commands and time, with recorded edges and failures.

`machine.py` implements all but the physics. A kind's plants are in `<kind>.py`.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Literal, Protocol

FailureMode = Literal["off", "stuck", "slow", "garbage", "wrong"]
FAILURE_MODES: tuple[FailureMode, ...] = ("off", "stuck", "slow", "garbage", "wrong")


@dataclass(frozen=True, slots=True)
class Edge:
    """One change at `at` (monotonic or virtual s): a relay that we drove, a sensor that moved."""

    at: float
    device: str
    what: Literal["relay", "sensor"]
    signal: str
    value: bool | int | str | float


class Plant(Protocol):
    """One lift, door or charger. Signals are logical here (asserted or not); levels are the wire's.

    Not thread-safe: the far side of the wire serialises the calls.
    """

    name: str
    edges: list[Edge]
    on_edge: Callable[[Edge], None] | None

    @property
    def failures(self) -> Mapping[str, FailureMode]:
        """Part -> failure mode. The far side of a bus reads the failures of its parts here."""

    def drive(self, signal: str, asserted: bool, now: float) -> None:
        """Take a change of our relay."""

    def advance(self, now: float) -> None:
        """Let the physics run until `now`."""

    def sense(self, signal: str) -> bool:
        """Is this contact asserted, as the wire shows it (failures included)?"""

    def reading(self) -> object:
        """Return the reading of a controller without contacts; None if it has contacts alone."""

    def next_at(self) -> float:
        """Return the time of the next change without a command (monotonic s), or inf."""

    def add_parts(self, parts: Iterable[str]) -> None:
        """Let the plant fail by these parts of the far side as well."""

    def fail(self, part: str, mode: FailureMode | None) -> None:
        """Make a signal or part fail; None mends it. Raises ValueError with the known parts."""

    def names(self) -> Mapping[str, list[str]]:
        """Return the names for `press` and `fail`."""

    def press(self, signal: str, asserted: bool, now: float) -> None:
        """Act as a person or the building: a fire alarm, a key switch, an obstruction."""
