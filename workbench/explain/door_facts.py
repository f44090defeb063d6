"""Facts about one door, from its messages, and the door's story (a list of its events)."""

from bridges.observe.device import Check
from bridges.observe.diagnosis import Diagnosis
from bridges.observe.door import OPEN, SUPERVISOR, ObservedDoor
from bridges.observe.limits import SILENT_S
from bridges.observe.news import News
from bridges.observe.requesters import DeviceRequester, Moment
from workbench.explain.device import Device
from workbench.explain.lift_facts import moves
from workbench.explain.phrases import lasted


class DoorFacts(Device, ObservedDoor):
    """A door with its story. `passages` is the number of times that a requester has stopped holding the
    door."""

    def __init__(self, name: str, began: Moment) -> None:
        super().__init__(name, began)
        self.passages = 0

    @property
    def asked_by(self) -> str:
        """The name of the last requester on `door_requests`."""
        return "the supervisor" if self.sender == SUPERVISOR else self.sender

    @property
    def hears_lists(self) -> bool:
        """Return whether the listener can hear the supervisor's heartbeat. Without it, the listener
        does not know the holders. A recording by a door's daemon has no heartbeat. Another recording
        lacks the heartbeat if the supervisor's requests are heard and no heartbeat is."""
        unrecorded = self.noted is not None or self.sender == SUPERVISOR
        return self.last_heartbeat is not None or not unrecorded

    def supervisor(self, now: Moment) -> Diagnosis | None:
        """Return the present report of our door supervisor. Return None if there is no such report."""
        return next((one for one in self.heard_from(now) if one.kind == SUPERVISOR), None)

    def has_order(self, now: Moment) -> bool:
        """Return whether the door's own daemon reports that it wants the door open."""
        return self.kind in self.waits_said(now)

    def unheeded(self, now: Moment) -> bool:
        """Return whether the supervisor has answered no request for so long that it must be silent."""
        return self.unanswered is not None and now.at - self.unanswered.at > SILENT_S

    def checks(self, one: DeviceRequester) -> tuple[Check, ...]:
        """Return the conditions for which this requester's DoorOpen or DoorClose waits. If the
        heartbeat cannot be heard, leave out the condition on the heartbeat."""
        found = super().checks(one)
        return tuple(check for check in found if check.name == "door" or self.hears_lists)

    def says(self, one: News) -> str:
        """Return a line of the story. Return "" if the story leaves the event out."""
        who, by = one.who, one.requester
        match one.what:
            case "passed on":
                return f"{self.asked_by} asks for {one.text}"
            case "asks" if by and (by.wants == OPEN or who in self.holders):
                return f"{who} asks for the door to be {by.wants}"
            case "lost" if who in self.forgotten:
                return f"the supervisor has forgotten {who}, from whom no CLOSE was heard"
            case "lost":
                return f"the supervisor no longer lists {who}, after a hold of {lasted(one.gap_s)}"
            case "has":
                return f"the supervisor lists {who} as holding the door"
            case "changed":
                return f"the door {moves(self.changed['mode'], self.mode.value)}"
            case "met":
                hold = f", and the supervisor lists {who}" if self.hears_lists else ""
                return f"RMF sees what {who} waits for: the door is open{hold}"
        return ""

    def notice(self, one: News) -> None:
        """Count how often a requester stops holding the door."""
        self.passages += one.what == "lost"
