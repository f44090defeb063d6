"""The demo's events in the order of time. Each event has one readable line."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

from bridges.messages import words
from bridges.messages.words import Requested, Stated
from bridges.system.columns import hanging
from hal_fakes.plants.plant import Edge

What = Literal["robot", "request", "relay", "sensor", "state", "place", "alert", "demo"]
SETTLES_S = 0.15
"""The time (s) for which a line waits, so that the journal can sort the lines. Events arrive in several
ways, and each source stamps its own events."""
COLOURS = {
    "request": 36,
    "relay": 33,
    "sensor": 35,
    "state": 32,
    "robot": 1,
    "place": 34,
    "alert": 31,
}


@dataclass(frozen=True, slots=True)
class JournalLine:
    """One printed line. `at` is in monotonic seconds."""

    at: float
    what: What
    device: str
    text: str

    def render(self, began_at: float, *, colour: bool, columns: int = 0) -> str:
        """Return a line such as `   1.234 s  state    Lift1       car at L1, door open, mode AGV`.
        `columns` is the terminal's width. The width 0 allows a line of any length."""
        start = f"{self.at - began_at:8.3f} s  "
        body = f"{self.what:<7}  {self.device:<10}  {self.text}"
        if columns:
            body = ("\n" + " " * len(start)).join(hanging(body, columns - len(start)))
        code = COLOURS.get(self.what)
        return f"{start}\x1b[{code}m{body}\x1b[0m" if colour and code else start + body


class Journal:
    """All events. The journal counts an event that repeats the last, but does not print it."""

    def __init__(
        self,
        began_at: float,
        write: Callable[[str], object],
        *,
        colour: bool,
        columns: Callable[[], int] = lambda: 0,
    ) -> None:
        self.began_at = began_at
        self.edges: list[Edge] = []
        self.states: list[Stated] = []
        self.requests: list[Requested] = []
        self.legs: dict[str, float] = {}
        self._write = write
        self._colour = colour
        self._columns = columns
        self._waiting: list[JournalLine] = []
        self._told: dict[tuple[str, str], str] = {}

    def edge(self, edge: Edge) -> None:
        """Record a change of a daemon's relay or of a plant's contact."""
        self.edges.append(edge)
        value = ("off", "on")[edge.value] if isinstance(edge.value, bool) else edge.value
        self._add(JournalLine(edge.at, edge.what, edge.device, f"{edge.signal} {value}"))

    def request(self, message: Requested, at: float) -> None:
        """Record a request to a node."""
        self.requests.append(message)
        self._once(JournalLine(at, "request", words.device(message), words.request(message)))

    def state(self, message: Stated, at: float) -> None:
        """Record a node's state."""
        self.states.append(message)
        self._once(JournalLine(at, "state", words.device(message), words.described(message)))

    def note(self, what: What, text: str, at: float, device: str = "") -> None:
        """Record a robot's action or destination, an alert to a person, or a step of the demo."""
        self._add(JournalLine(at, what, device, text))

    def forget(self) -> None:
        """Drop all events except each device's latest state. An endless demo needs this."""
        latest = {words.device(state): state for state in self.states}
        self.states[:] = latest.values()
        self.edges.clear()
        self.requests.clear()

    def flush(self, until: float) -> None:
        """Print the events before `until` (monotonic s)."""
        due = sorted((line for line in self._waiting if line.at <= until), key=lambda x: x.at)
        self._waiting = [line for line in self._waiting if line.at > until]
        for line in due:
            shown = line.render(self.began_at, colour=self._colour, columns=self._columns())
            self._write(shown + "\n")

    def begin_day(self) -> None:
        """Start the counts at 0. Drop all states except each device's last."""
        self.states = [*{words.device(state): state for state in self.states}.values()]
        self.edges, self.requests = [], []

    def latest(self, device: str) -> Stated | None:
        """Return the last state of a device."""
        return next((s for s in reversed(self.states) if words.device(s) == device), None)

    def relays_on(self) -> list[str]:
        """Return a text such as `Lift1 door_open` for each energised relay."""
        last = {(e.device, e.signal): e.value for e in self.edges if e.what == "relay"}
        return [f"{device} {signal}" for (device, signal), value in last.items() if value]

    def counts(self) -> Counter[str]:
        """Count requests, states, relay edges and sensor edges."""
        counts = Counter(f"{edge.what} edges" for edge in self.edges)
        counts["requests"] = len(self.requests)
        counts["states"] = len(self.states)
        return counts

    def _once(self, line: JournalLine) -> None:
        """Add a line if it differs from the device's last line of this sort."""
        key = (line.what, line.device)
        if self._told.get(key) != line.text:
            self._told[key] = line.text
            self._add(line)

    def _add(self, line: JournalLine) -> None:
        self._waiting.append(replace(line, text=words.printable(line.text)))
