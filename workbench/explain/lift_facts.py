"""What was heard of one lift: its state, who asks, and the story of each ride."""

from dataclasses import dataclass
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.stamps import in_seconds
from workbench.explain.claims import ASKS_WITHIN_S, Claim, Claims
from workbench.explain.device import Device, Fact
from workbench.explain.explanation import Line
from workbench.explain.phrases import Moment, lasted
from workbench.explain.rows import label
from workbench.explain.timeline import Kind

END: Final = d.LiftRequestType.REQUEST_END_SESSION
HUMAN: Final = d.LiftRequestType.REQUEST_HUMAN_MODE
NOBODY: Final = "nobody"
NO_FLOOR: Final = "no known floor"
DIRECT: Final = "the supervisor, or a person with `send --direct`,"
"""Whoever sends on `lift_requests` what no fleet adapter was heard to ask for."""


@dataclass(slots=True)
class Rides:
    """Totals of all rides: how many ended, the longest wait for the car, and when the last one
    began."""

    ended: int = 0
    longest_s: float = 0.0
    longest_who: str = ""
    longest_at: Moment | None = None
    last_from: float = float("-inf")


class LiftFacts(Device):
    """`focus`: a session whose last ride's story is kept whole, even if others ride after it."""

    kind: Kind = "lift"

    def __init__(self, name: str, began: Moment, focus: str = "") -> None:
        super().__init__(name, began)
        self.claims = Claims(began)
        self.rides = Rides()
        self.focus = focus
        self.kept: tuple[Line, ...] = ()
        self.floors: tuple[str, ...] = ()
        self.floor = Fact(NO_FLOOR, began)
        self.door = Fact("", began)
        self.motion = Fact("", began)
        self.mode = Fact("", began)
        self.session = Fact(NOBODY, began)
        self.destination = Fact("", began)
        self.adapters_heard = False
        self.supervisor: Fact | None = None
        self.supervisor_last: Moment | None = None

    # ---- requests

    def requested(self, moment: Moment, request: d.LiftRequest, *, passed_on: bool) -> None:
        """A request of a fleet adapter or, passed on, of the supervisor."""
        who = label(request.session_id)
        if passed_on:
            self._passed_on(moment, who, request)
        else:
            self.adapters_heard = True
        if request.request_type == END:
            self._end(moment, who, passed_on)
            return
        if passed_on and self.adapters_heard:
            claim = self.claims.get(who)
            if claim is not None:
                claim.passed_on = moment
            return
        wants = label(request.destination_floor)
        claim, new = self.claims.ask(who, wants, moment, keep=self.session.value)
        claim.own = claim.own or not passed_on
        claim.passed_on = moment if passed_on else claim.passed_on
        claim.stamped = request.request_time != d.Time()
        claim.stamp_age_s = moment.wall - in_seconds(request.request_time)
        if new:
            self._asks(moment, claim, request)

    def _asks(self, moment: Moment, claim: Claim, request: d.LiftRequest) -> None:
        mode = "HUMAN mode" if request.request_type == HUMAN else "the lift"
        again = claim.times > 1 or self.session.value == claim.who
        if again and self.session.value == claim.who:
            claim.granted = claim.granted or self.session.since
            text = f"{claim.who}, who has the lift, asks for {claim.wants or 'no floor'}"
        elif again:
            text = f"{claim.who} asks for {claim.wants or 'no floor'} instead"
        else:
            text = f"{claim.who} asks for {mode} at {claim.wants or 'no floor'}"
        self.tell(moment, text)

    def _passed_on(self, moment: Moment, who: str, request: d.LiftRequest) -> None:
        ends = request.request_type == END
        asks = "" if ends else who
        self.supervisor_last = moment
        if self.supervisor is None:
            self.supervisor = Fact(asks, moment)
        elif (
            self.supervisor.say(asks, moment) and asks and self.session.value not in (NOBODY, asks)
        ):
            holder = self.session.value
            self.tell(moment, f"{self.sender(asks)} asks for {asks}, though {holder} has the lift")

    def sender(self, who: str) -> str:
        """Who asks for this session on `lift_requests`, as far as that is known."""
        claim = self.claims.get(who)
        passed_on = claim is not None and claim.own
        return "the supervisor" if passed_on else DIRECT

    def _end(self, moment: Moment, who: str, passed_on: bool) -> None:
        claim = self.claims.get(who)
        if claim is not None and passed_on:
            claim.end_passed_on = True
        if claim is None or claim.ended is not None:
            if passed_on and who and who == self.session.value and claim is None:
                claim, _ = self.claims.ask(who, "", moment)
                claim.granted, claim.ended = self.session.since, moment
                self.tell(moment, f"{DIRECT} ends the session of {who}, which nobody asks for")
            return
        if passed_on:
            self.tell(moment, f"{DIRECT} ends the session of {who}")
            if claim.own and who != self.session.value:
                return  # only its fleet adapter knows whether it still waits
        else:
            self.tell(moment, f"{who} ends its session")
        claim.ended = moment
        if self.session.value != who:
            self._over(moment, claim)

    # ---- states

    def stated(self, moment: Moment, state: d.LiftState) -> None:
        """A state of the lift."""
        moment = self.state_came(moment, words.stamped_at(state))
        self.floors = tuple(label(floor) for floor in state.available_floors[:200])
        first = self.first_state is not None and self.first_state.at == moment.at
        self._session(moment, label(state.session_id) or NOBODY, first)
        changes = self._changes(moment, state)
        if changes and not first:
            self.tell(moment, ", ".join(changes))
        self._look_at_claims(moment)

    def _session(self, moment: Moment, holder: str, first: bool) -> None:
        before = self.session.value
        if not self.session.say(holder, moment) and not first:
            return
        if first:
            self.session.since = moment
        old, new = self.claims.get(before), self.claims.get(holder)
        if before != NOBODY and not first:
            unasked = "" if old and old.ended else ", without an END that was heard"
            if holder == NOBODY or unasked:
                self.tell(moment, f"the lift is no longer {before}'s{unasked}")
            if old is not None:
                self._over(moment, old)
        if holder != NOBODY and not first:
            after = f", {lasted(moment.at - new.first.at)} after it asked" if new else ""
            self.tell(moment, f"the lift is given to {holder}{after}")
        if new is not None and holder != NOBODY:
            new.granted = moment

    def _changes(self, moment: Moment, state: d.LiftState) -> list[str]:
        changes = []
        mode = words.word(d.LiftMode, state.current_mode)
        if self.mode.say(mode, moment):
            changes.append(f"the lift is in {mode} mode")
        floor = label(state.current_floor) or NO_FLOOR
        before = self.floor.value
        if self.floor.say(floor, moment):
            changes.append(
                f"the car leaves {before}" if floor == NO_FLOOR else f"the car is at {floor}"
            )
        self.motion.say(words.plain(d.LiftMotion, state.motion_state), moment)
        self.destination.say(label(state.destination_floor), moment)
        door = words.plain(d.LiftDoor, state.door_state)
        before = self.door.value
        if self.door.say(door, moment):
            changes.append(f"the door {_door(before, door)}")
        return changes

    def _look_at_claims(self, moment: Moment) -> None:
        for claim in list(self.claims):
            if claim.ended is None and self.matches(claim):
                if claim.met is None:
                    claim.met = moment
                    self._met(moment, claim)
            elif claim.met is not None and claim.ended is None:
                claim.met = None
            silent = moment.at - claim.last.at > ASKS_WITHIN_S
            if silent and claim.ended is None and not claim.gone:
                claim.gone = True
                self.tell(moment, f"{claim.who} has stopped asking, without END")
            elif silent and claim.who != self.session.value:
                self.claims.drop(claim.who)

    def _met(self, moment: Moment, claim: Claim) -> None:
        waited = moment.at - claim.since.at
        self.tell(
            moment, f"RMF sees what {claim.who} waits for: {claim.wants}, door open, its session"
        )
        if waited > self.rides.longest_s and claim.since.seen:
            self.rides.longest_s, self.rides.longest_who = waited, claim.who
            self.rides.longest_at = moment

    def matches(self, claim: Claim) -> bool:
        """RequestLift's four fields (rmf_ros2, RequestLift.cpp:322-326); the name is the first."""
        return (
            self.session.value == claim.who
            and self.floor.value == claim.wants
            and self.door.value == "open"
        )

    def _over(self, moment: Moment, claim: Claim) -> None:
        """The ride is over, or was given up."""
        if claim.granted is not None:
            self.rides.ended += 1
            self.rides.last_from = claim.first.at
        if claim.who == self.focus:
            self.kept = self.lines_since(claim.first.at)
        if claim.ended is not None:
            self.claims.drop(claim.who)


def _door(before: str, door: str) -> str:
    """`opens`, `closes`, `is open`, `is closed`."""
    if door != "moving":
        return f"is {door}"
    return {"closed": "opens", "open": "closes"}.get(before, "moves")
