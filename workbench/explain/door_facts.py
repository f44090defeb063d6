"""What was heard of one door: its state, who holds it by the supervisor's heartbeat, and who asks."""

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.stamps import in_seconds
from workbench.explain.claims import ASKS_WITHIN_S, Claims
from workbench.explain.device import Device, Fact
from workbench.explain.phrases import Moment, lasted
from workbench.explain.rows import label
from workbench.explain.timeline import Kind

OPEN = "open"
CLOSED = "closed"
MOST_HOLDERS = 64
SUPERVISOR = "door_supervisor"
"""The requester_id that RMF's own uses on `door_requests` (door_supervisor/Node.hpp), and ours."""


class DoorFacts(Device):
    """`holders`: who the heartbeat lists, and since when. `asked`: what was asked last on
    `door_requests`, and `sender` by whom.
    """

    kind: Kind = "door"

    def __init__(self, name: str, began: Moment) -> None:
        super().__init__(name, began)
        self.claims = Claims(began)
        self.mode = Fact("", began)
        self.holders: dict[str, Moment] = {}
        self.last_heartbeat: Moment | None = None
        self.asked: Fact | None = None
        self.sender = ""
        self.passages = 0

    def requested(self, moment: Moment, request: d.DoorRequest, *, passed_on: bool) -> None:
        """A request of a fleet adapter or, passed on, of the supervisor."""
        wants = words.plain(d.DoorModeValue, request.requested_mode.value)
        who = label(request.requester_id)
        if passed_on:
            self.sender = "the supervisor" if who == SUPERVISOR else who
            if self.asked is None:
                self.asked = Fact(wants, moment)
            elif self.asked.say(wants, moment):
                self.tell(moment, f"{self.sender} asks for {wants}")
            return
        claim, new = self.claims.ask(who, wants, moment)
        claim.stamped = request.request_time != d.Time()
        claim.stamp_age_s = moment.wall - in_seconds(request.request_time)
        if new and (wants == OPEN or who in self.holders):
            self.tell(moment, f"{who} asks for the door to be {wants}")

    def listed(self, moment: Moment, heartbeat: d.SupervisorHeartbeat) -> None:
        """The supervisor's heartbeat: who holds each door."""
        first = self.last_heartbeat is None
        self.last_heartbeat = moment
        found = [
            label(session.requester_id)
            for sessions in heartbeat.all_sessions
            if sessions.door_name == self.id
            for session in sessions.sessions[:MOST_HOLDERS]
        ]
        seen = not first or moment.at - self.began.at > ASKS_WITHIN_S
        since = Moment(moment.at, moment.wall, seen)
        for who in [who for who in self.holders if who not in found]:
            held_s = moment.at - self.holders.pop(who).at
            self.passages += 1
            self.tell(moment, f"the supervisor no longer lists {who}, after {lasted(held_s)}")
        for who in found:
            if who not in self.holders:
                self.holders[who] = since
                if seen:
                    self.tell(moment, f"the supervisor lists {who} as holding the door")

    def stated(self, moment: Moment, state: d.DoorState) -> None:
        """A state of the door."""
        first = self.last_state is None
        moment = self.state_came(moment, words.stamped_at(state))
        mode = words.plain(d.DoorModeValue, state.current_mode.value)
        before = self.mode.value
        if self.mode.say(mode, moment) and not first:
            self.tell(moment, f"the door {_moves(before, mode)}")
        for claim in list(self.claims):
            met = claim.wants == OPEN and mode == OPEN and claim.who in self.holders
            if met and claim.met is None:
                claim.met = moment
                self.tell(
                    moment, f"RMF sees what {claim.who} waits for: the door open, and its hold"
                )
            if not claim.asks(moment) and claim.who not in self.holders:
                self.claims.drop(claim.who)


def _moves(before: str, mode: str) -> str:
    if mode != "moving":
        return f"is {mode}"
    return {CLOSED: "opens", OPEN: "closes"}.get(before, "moves")
