"""The protocol of plants. Commands and time drive their physics. Edges and failures are recorded.

`machine.py` implements everything except the physics. A kind's plants are in `<kind>.py`.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Literal, Protocol

FailureMode = Literal["off", "stuck", "slow", "garbage", "wrong"]
FAILURE_MODES: tuple[FailureMode, ...] = ("off", "stuck", "slow", "garbage", "wrong")


@dataclass(frozen=True, slots=True)
class Edge:
    """One change of a relay that the daemon drove, or of a sensor that moved. `at` is its time
    (monotonic or virtual s)."""

    at: float
    device: str
    what: Literal["relay", "sensor"]
    signal: str
    value: bool | int | str | float


class Plant(Protocol):
    """One lift, door or charger. Signals are asserted or not. Only the wire has levels.

    A plant is not thread-safe. The far side of the wire makes one call at a time.
    """

    name: str
    edges: list[Edge]
    on_edge: Callable[[Edge], None] | None

    @property
    def failures(self) -> Mapping[str, FailureMode]:
        """Return the failure mode of each failing part. The far side of a bus looks here for the
        failures of its own parts."""

    def drive(self, signal: str, asserted: bool, now: float) -> None:
        """Apply a change of the daemon's relay or command."""

    def advance(self, now: float) -> None:
        """Let the physics run until `now`."""

    def sense(self, signal: str) -> bool:
        """Is this contact asserted, as its wire shows it? The wire may have a failure."""

    def reading(self) -> object:
        """Return the reading of a controller without contacts. Return None if the plant has only
        contacts."""

    def next_at(self) -> float:
        """Return the time (monotonic s) of the next change that comes without a command, or inf."""

    def add_parts(self, parts: Iterable[str]) -> None:
        """Add parts of the far side that can fail for this plant."""

    def fail(self, part: str, mode: FailureMode | None) -> None:
        """Let a wire or part fail in this mode. The mode None repairs the part. Raises ValueError with
        the known parts."""

    def names(self) -> Mapping[str, list[str]]:
        """Return the names for `press` and `fail`."""

    def press(self, signal: str, asserted: bool, now: float) -> None:
        """Press or release a signal as a person or the building does: a fire alarm, a key switch, an
        obstruction."""
