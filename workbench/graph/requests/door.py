"""Hold a door open, and release the door, as DoorOpen.cpp and DoorClose.cpp do."""

from collections.abc import Iterable
from dataclasses import dataclass

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.topics import AnyTopic
from workbench.graph.requests import Fulfilled, Obstacle, Request, RequestProgress


@dataclass(frozen=True, slots=True)
class DoorMove(Request):
    """A request to open or close the door.

    Without `direct`, the request also waits for the supervisor's heartbeat, as a fleet adapter does.
    The heartbeat must list our requester while we hold the door. After the release, the heartbeat must
    no longer list our requester.
    """

    opened: bool
    requester: str

    kind = "door"
    states, own = topics.DOOR_STATES, topics.DOOR_REQUESTS
    adapter = topics.ADAPTER_DOOR_REQUESTS
    answers = (topics.DOOR_SUPERVISOR_HEARTBEAT,)

    @property
    def supervisor(self) -> AnyTopic | None:
        """The heartbeat, which only supervisors publish. A door's daemon may subscribe to the fleet
        adapters' topic too, for its recordings."""
        return None if self.direct else topics.DOOR_SUPERVISOR_HEARTBEAT

    @property
    def mode(self) -> d.DoorModeValue:
        """The requested mode."""
        return d.DoorModeValue.MODE_OPEN if self.opened else d.DoorModeValue.MODE_CLOSED

    def message(self, seen: RequestProgress) -> d.DoorRequest:
        """Return the request for `mode`."""
        return d.DoorRequest(
            requester_id=self.requester,
            door_name=self.name,
            requested_mode=d.DoorMode(int(self.mode)),
        )

    def outcome(self, seen: RequestProgress) -> Fulfilled | None:
        """Return Fulfilled after the door shows the mode. Without `direct`, the heartbeat must also
        list our requester after OPEN, and no longer list it after CLOSE."""
        answer = seen.answer(d.DoorState)
        if answer is None or answer.current_mode.value != self.mode:
            return None
        if not self.direct and not self._heartbeat_agrees(seen):
            return None
        return Fulfilled(f"{self.name} is {'open' if self.opened else 'closed'}")

    def _heartbeat_agrees(self, seen: RequestProgress) -> bool:
        requesters = seen.requesters(self.name)
        return requesters is not None and (self.requester in requesters) == self.opened

    def obstacles(self, seen: RequestProgress) -> Iterable[Obstacle]:
        """Return the obstacles, which depend on the door's present mode and on other requesters."""
        mode, name = seen.states_of(d.DoorState)[-1].current_mode.value, self.name
        others = ", ".join(r for r in seen.requesters(name) or [] if r != self.requester)
        return (
            Obstacle(
                mode == d.DoorModeValue.MODE_OFFLINE,
                f"the daemon cannot reach the controller of {name}",
            ),
            Obstacle(
                mode == d.DoorModeValue.MODE_UNKNOWN,
                f"the contacts of {name} contradict each other, or the door took too long",
            ),
            Obstacle(
                mode == self.mode,
                f"{name} is {'open' if self.opened else 'closed'}, but no heartbeat of a door"
                " supervisor confirms it",
            ),
            Obstacle(self.opened, f"{name} did not open"),
            Obstacle(bool(others), f"{name} is held open by {others}"),
            Obstacle(True, f"{name} was released, but something keeps it open"),
        )
