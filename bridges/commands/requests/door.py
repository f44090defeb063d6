"""A door held open, and released, as DoorOpen.cpp and DoorClose.cpp do."""

from collections.abc import Iterable
from dataclasses import dataclass

from bridges.commands.requests import Done, Obstacle, Request, Seen
from bridges.rmf import definitions as d
from bridges.rmf import topics


@dataclass(frozen=True, slots=True)
class DoorMove(Request):
    """The door open, or closed.

    On the adapter topic also what a fleet adapter waits for: the supervisor's heartbeat lists us while
    we want it open, and no longer afterwards.
    """

    opened: bool
    requester: str

    kind = "door"
    states, own = topics.DOOR_STATES, topics.DOOR_REQUESTS
    adapter = topics.ADAPTER_DOOR_REQUESTS

    @property
    def mode(self) -> d.DoorModeValue:
        """The mode that is asked for."""
        return d.DoorModeValue.MODE_OPEN if self.opened else d.DoorModeValue.MODE_CLOSED

    def message(self, seen: Seen) -> d.DoorRequest:
        """OPEN or CLOSED."""
        return d.DoorRequest(
            requester_id=self.requester,
            door_name=self.name,
            requested_mode=d.DoorMode(int(self.mode)),
        )

    def outcome(self, seen: Seen) -> Done | None:
        """The mode, and on the adapter topic the heartbeat."""
        answer = seen.answer()
        if answer is None or answer.current_mode.value != self.mode:
            return None
        if not self.direct and not self._heartbeat_agrees(seen):
            return None
        return Done(f"{self.name} is {'open' if self.opened else 'closed'}")

    def _heartbeat_agrees(self, seen: Seen) -> bool:
        requesters = seen.requesters(self.name)
        return requesters is not None and (self.requester in requesters) == self.opened

    def obstacles(self, seen: Seen) -> Iterable[Obstacle]:
        """By the mode that the door is in."""
        mode, name = seen.latest().current_mode.value, self.name
        others = ", ".join(r for r in seen.requesters(name) or [] if r != self.requester)
        return (
            Obstacle(
                mode == d.DoorModeValue.MODE_OFFLINE,
                f"the daemon does not reach the controller of {name}",
            ),
            Obstacle(
                mode == d.DoorModeValue.MODE_UNKNOWN,
                f"the contacts of {name} contradict each other, or it took too long",
            ),
            Obstacle(
                mode == self.mode,
                f"{name} is there, but no heartbeat of a door supervisor confirms it",
            ),
            Obstacle(self.opened, f"{name} did not open"),
            Obstacle(bool(others), f"{name} is held open by {others}"),
            Obstacle(True, f"{name} was released, but something keeps it open"),
        )
