"""The common base of plants: a record of edges, failing wires, failing parts, and a clock.

A kind's plant derives from WiredPlant and adds its physics. The edges are changes as seen at the
terminal block. For a relay, the edge is the change that the daemon made. For a contact, the edge is the
change that its wire showed. So a cut wire can cause an edge too.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from typing import Literal

from drivers.hal.points import Wire
from hal_fakes.plants.contact import Contact
from hal_fakes.plants.plant import FAILURE_MODES, Edge, FailureMode

EDGES_KEPT = 100_000


class WiredPlant(ABC):
    """The common base of all plants (`hal_fakes.plants.plant.Plant`). A derived class adds the physics.

    - `wires` is the driver's wiring table of this device. It is empty if the controller has no
      contacts.
    - `parts` are the parts that can fail besides wires (`car`, `door_operator`). The plant looks up
      their failures in `failures`.
    - `buttons` are the signals that can be pressed. `pressed` tells for each button whether it is
      pressed.

    Wires to an I/O module add the module's parts `unit` and `server` (`hal_fakes/modbus/`). Other far
    sides add their parts with `add_parts`.
    """

    def __init__(
        self,
        name: str,
        wires: Iterable[Wire] = (),
        parts: Iterable[str] = (),
        buttons: Iterable[str] = (),
    ) -> None:
        self.name = name
        self.edges: list[Edge] = []
        self.on_edge: Callable[[Edge], None] | None = None
        self.now = 0.0
        self._settled = False
        self.failures: dict[str, FailureMode] = {}
        self.pressed = dict.fromkeys(buttons, False)
        contacts = [Contact(w, f"{name} {w.signal}") for w in wires]
        at_module = any(c.wire.point.startswith("unit ") for c in contacts)
        self._parts = frozenset((*parts, *(("unit", "server") if at_module else ())))
        self._sensors = {c.wire.signal: c for c in contacts if c.wire.direction == "in"}
        self._relays = {c.wire.signal: c for c in contacts if c.wire.direction == "out"}
        self._broken: list[Contact] = []
        self._sees = dict.fromkeys(self._relays, False)
        self._driven = dict.fromkeys(self._relays, False)
        self._shown: dict[str, bool] = {}

    # ---- methods that a derived class overrides

    @abstractmethod
    def contact(self, signal: str) -> bool:
        """Is this contact asserted at the controller? The contact's wire may show another value."""

    def actuate(self, signal: str, energised: bool) -> None:  # noqa: B027
        """React to a change of the daemon's relay at `self.now`. By default do nothing."""

    @abstractmethod
    def run(self) -> None:
        """Run every event that is due at `self.now`. The caller may call `run` at any time."""

    @abstractmethod
    def event_at(self) -> float:
        """Return the time (s) of the next event, or inf. After `run` at that time the event is over."""

    def act(self, signal: str, asserted: bool) -> None:  # noqa: B027
        """React when a signal is pressed or released. By default do nothing, because a plant may read
        `pressed`."""

    # ---- the Plant protocol

    def drive(self, signal: str, asserted: bool, now: float) -> None:
        """Apply a change of the daemon's relay."""
        self.advance(now)
        if asserted != self._driven[signal]:
            self._driven[signal] = asserted
            self.note("relay", signal, asserted)
            self._settle()

    def advance(self, now: float) -> None:
        """Run every event that is due until `now`, each at its own time. Time never goes back.

        Between two events nothing visible changes.
        """
        while (at := self.next_at()) <= now:
            self.now = max(self.now, at)
            self._settle()
        self.now = max(self.now, now)
        if not self._settled:
            self._settle()

    def sense(self, signal: str) -> bool:
        """Is this contact asserted, as the wire shows it?"""
        return self._sensors[signal].shows

    def reading(self) -> object:
        """Return None, because the plant has only contacts."""
        return None

    def next_at(self) -> float:
        """Return the time (s) of the next change that comes without a command, or inf."""
        return min([self.event_at(), *(contact.next_at() for contact in self._broken)])

    def add_parts(self, parts: Iterable[str]) -> None:
        """Add parts of the far side that can fail for this plant."""
        self._parts |= {*parts}

    def fail(self, part: str, mode: FailureMode | None) -> None:
        """Let a wire or part fail in this mode. The mode None repairs the part. Raises ValueError with
        the known parts."""
        contact = self._sensors.get(part) or self._relays.get(part)
        if contact is None and part not in self._parts:
            known = ", ".join(self.names()["fail"])
            raise ValueError(f"{self.name} has no part {part!r}; there are {known}")
        if mode not in (None, *FAILURE_MODES):
            raise ValueError(f"no failure {mode!r}; there are {', '.join(FAILURE_MODES)}")
        self.failures.pop(part, None)
        if mode is not None:
            self.failures[part] = mode
        self._settle()
        if contact is not None:
            contact.fail(mode, self.now)
            contacts = (*self._sensors.values(), *self._relays.values())
            self._broken = [each for each in contacts if each.mode is not None]
        self._settle()

    def names(self) -> dict[str, list[str]]:
        """Return the names for `press` and `fail`."""
        parts = sorted({*self._parts, *self._sensors, *self._relays})
        return {"press": list(self.pressed), "fail": parts}

    def press(self, signal: str, asserted: bool, now: float) -> None:
        """Press or release a signal, as a person or the building does. Raises ValueError with the known
        signals."""
        if signal not in self.pressed:
            known = ", ".join(self.pressed)
            raise ValueError(f"{self.name} has no {signal!r} to press; there are {known}")
        self.advance(now)
        self.pressed[signal] = asserted
        self.act(signal, asserted)
        self._settle()

    # ---- inside

    def note(
        self, what: Literal["relay", "sensor"], signal: str, value: bool | int | str | float
    ) -> None:
        """Record an edge at `self.now`, and call the listeners."""
        edge = Edge(self.now, self.name, what, signal, value)
        self.edges.append(edge)
        if len(self.edges) > EDGES_KEPT:
            del self.edges[: EDGES_KEPT // 2]
        if self.on_edge is not None:
            self.on_edge(edge)

    def _settle(self) -> None:
        """Pass relays to the controller, run the physics, and pass the contacts to the bus."""
        self._settled = True
        for signal, relay in self._relays.items():
            relay.feed(self._driven[signal], self.now)
            if relay.shows != self._sees[signal]:
                self._sees[signal] = relay.shows
                self.actuate(signal, relay.shows)
        self.run()
        for signal, sensor in self._sensors.items():
            sensor.feed(self.contact(signal), self.now)
            if sensor.shows != self._shown.setdefault(signal, sensor.shows):
                self._shown[signal] = sensor.shows
                self.note("sensor", signal, sensor.shows)
