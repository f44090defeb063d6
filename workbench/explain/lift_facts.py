"""Facts about one lift, from its messages, and the story of each ride."""

from dataclasses import dataclass
from typing import Final

from bridges.messages import definitions as d
from bridges.messages.stamps import in_seconds
from bridges.observe.lift import END, NO_FLOOR, NOBODY, ObservedLift
from bridges.observe.news import News
from bridges.observe.requesters import DeviceRequester, Moment
from workbench.explain.device import Device
from workbench.explain.explanation import StoryLine
from workbench.explain.phrases import lasted
from workbench.explain.rows import label

HUMAN: Final = d.LiftRequestType.REQUEST_HUMAN_MODE
DIRECT: Final = "the supervisor, or a person with `send --direct`,"
"""The likely sender of a request on `lift_requests`, if no fleet adapter was heard to send the same
request."""
UNSEEN: Final = "LIFT_SILENT"
"""The fault of our supervisor that hears no state of a lift."""
LINGERS_S: Final = 1.0
"""The time (s) between two reports of our daemons. A report may show a fault that is over."""


@dataclass(slots=True)
class Rides:
    """Facts about all rides: how many have ended, the longest wait for the car, and when the last ride
    began."""

    ended: int = 0
    longest_s: float = 0.0
    longest_who: str = ""
    longest_at: Moment | None = None
    last_from: float = float("-inf")


class LiftFacts(Device, ObservedLift):
    """A lift with its story (a list of its events).

    - `kept`: the story of the last ride of session `focus`
    - `flows`: the time since which the states come without a silence
    - `unended`: the requester that was the last to stop asking without END
    """

    def __init__(self, name: str, began: Moment) -> None:
        super().__init__(name, began)
        self.rides = Rides()
        self.kept: tuple[StoryLine, ...] = ()
        self.flows = began
        self.unended: DeviceRequester | None = None

    @property
    def floors(self) -> tuple[str, ...]:
        """Return the floors that the lift serves."""
        served = self.state.available_floors[:200] if self.state else ()
        return tuple(map(label, served))

    def serves(self, one: DeviceRequester) -> bool:
        """Return whether the lift serves the requester's floor, as far as its states tell."""
        return one.human or not self.floors or one.wants in self.floors

    def unseen(self, now: Moment) -> Moment | None:
        """Return the time since which our supervisor misses the lift's states, although we hear them.
        Return None if it does not miss them."""
        if self.first_state is None or self.is_silent(now):
            return None
        came = max(self.first_state.at, self.flows.at)
        every = ((one.last, one.faults.get(UNSEEN)) for one in self.heard_from(now))
        missed = ((last, fault[1]) for last, fault in every if fault)
        return next((s for last, s in missed if last.at - max(came, s.at) >= LINGERS_S), None)

    def answered(self, now: Moment) -> bool:
        """Return whether a fleet adapter has lately repeated a request or END, as it does after a
        state."""
        return any(
            (one.asks(now) and one.times > 1) or (one.ends(now) and one.end_last != one.ended)
            for one in self.requesters
            if one.own
        )

    def sender(self, who: str) -> str:
        """Name the sender of this session's requests on `lift_requests`. If the sender is unknown, name
        the likely senders."""
        one = self.requesters.get(who)
        return "the supervisor" if one is not None and one.own else DIRECT

    def in_car(self, who: str, now: Moment) -> str:
        """Say whether this robot may be in the car."""
        told, one = self.told("boarded", now), self.requesters.get(who)
        let_in = one is not None and one.boarded is not None  # our daemon tells it a second later
        if told == "no" and not let_in:
            return f"{who} has not been let into the car."
        if told == "yes" or let_in:
            return f"{who} may be in the car."
        return f"Whether {who} is in the car is not known."

    def keeps(self, now: Moment) -> str:
        """Say that the holder keeps its session while the lift serves no robot. Say also whether the
        holder may be in the car."""
        who = self.session.value
        return (
            f"{who} keeps the session meanwhile, because only END from {who} ends the session."
            f" {self.in_car(who, now)}"
        )

    def retain(self, request: d.LiftRequest, now: Moment) -> None:
        """Take a request that the fleet adapter sent before we listened. The request's stamp tells when
        the adapter sent it."""
        wall, who = in_seconds(request.request_time), self.text(request.session_id)
        if request.request_type == END:
            self.requesters.drop(who)
            return
        asked = Moment(now.at - max(0.0, now.wall - wall), min(wall, now.wall), seen=False)
        wants = self.text(request.destination_floor)
        one, _ = self.requesters.ask(who, wants, asked, stands=True)
        one.own, one.human = True, request.request_type == HUMAN
        if one.times > 1 and one.given_up:
            one.boarded = asked  # a robot asks for a second floor only from inside the car

    def says(self, one: News) -> str:
        """Return a line of the story. Return "" if the story leaves the event out."""
        who, by = one.who, one.requester
        match one.what:
            case "asks" if by:
                return self._asks(by, human=one.text == "HUMAN")
            case "passed on" if who and self.session.value not in (NOBODY, who):
                return (
                    f"{self.sender(who)} requests the lift for {who}, though {self.session.value}"
                    " has the lift"
                )
            case "ends" if one.passed_on:
                return (
                    f"{DIRECT} ends the session of {who}"
                    f"{'' if by else ', from whom no request was heard'}"
                )
            case "ends":
                return f"{who} ends its session"
            case "lost":
                unasked = "" if by and by.ended else ", and no END was heard"
                free = self.session.value == NOBODY
                return f"the lift is no longer {who}'s{unasked}" if free or unasked else ""
            case "has":
                after = f", {lasted(one.at.at - by.first.at)} after it asked" if by else ""
                return f"the lift is given to {who}{after}"
            case "changed":
                return ", ".join(self._changes())
            case "met" if by:
                return f"RMF sees what {who} waits for: floor {by.wants}, door open, session {who}"
            case "gone":
                return f"{who} has stopped asking, without END"
        return ""

    def notice(self, one: News) -> None:
        """Count rides and waits."""
        by = one.requester
        if one.what == "states again":
            self.flows = one.at
        elif one.what == "gone":
            self.unended = by
        if one.what == "met" and by and by.since.seen:
            waited = one.at.at - by.since.at
            if waited > self.rides.longest_s:
                self.rides.longest_s, self.rides.longest_who = waited, by.who
                self.rides.longest_at = one.at
        elif one.what == "over" and by:
            if by.granted is not None:
                self.rides.ended += 1
                self.rides.last_from = by.first.at
            if by.who == self.focus:
                self.kept = self.lines_since(by.first.at)

    def _asks(self, one: DeviceRequester, *, human: bool) -> str:
        where = one.wants or "no floor"
        if self.session.value == one.who:
            return f"{one.who}, who has the lift, asks for {where}"
        if one.times > 1:
            return f"{one.who} asks for {where} instead"
        return f"{one.who} asks for {'HUMAN mode' if human else 'the lift'} at {where}"

    def _changes(self) -> list[str]:
        changes = []
        if "mode" in self.changed:
            changes.append(f"the lift is in {self.mode.value} mode")
        if "floor" in self.changed:
            left = self.floor.value == NO_FLOOR
            changes.append(
                f"the car leaves {self.changed['floor']}"
                if left
                else f"the car is at {self.floor.value}"
            )
        if "door" in self.changed:
            changes.append(f"the door {moves(self.changed['door'], self.door.value)}")
        return changes


def moves(before: str, door: str) -> str:
    """Return the door's change in words: `opens`, `closes`, `is open` or `is closed`."""
    if door != "moving":
        return f"is {door}"
    return {"closed": "opens", "open": "closes"}.get(before, "moves")
