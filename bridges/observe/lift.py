"""Observation of a lift: its requesters, its session, and the last request that RMF's supervisor sent
to it. It also lists the unmet conditions of RMF's RequestLift."""

from collections.abc import Iterator
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.observe.device import Check, ObservedDevice, Wait
from bridges.observe.limits import REQUESTER_SILENT_S, SILENT_S
from bridges.observe.news import News
from bridges.observe.requesters import DeviceRequester, Fact, Moment

END: Final = d.LiftRequestType.REQUEST_END_SESSION
NOBODY: Final = "nobody"
NO_FLOOR: Final = "no known floor"
OPEN: Final = "open"
HAZARDS: Final = (d.LiftMode.MODE_FIRE, d.LiftMode.MODE_OFFLINE, d.LiftMode.MODE_EMERGENCY)
"""The lift's modes in which no robot may enter."""


def request_lift(session: str, floor: str, door: str, who: str, wants: str) -> tuple[Check, ...]:
    """List the conditions under which RequestLift lets `who` drive into or out of the lift at the floor
    `wants` (rmf_ros2, RequestLift.cpp:322-326). The condition on the lift's name is left out,
    because it is always met."""
    fields = (("session", session, who), ("floor", floor, wants), ("door", door, OPEN))
    return tuple(Check(*field, field[1] == field[2]) for field in fields)


class ObservedLift(ObservedDevice[d.LiftState]):
    """A lift, as observed. END is the request with which a robot gives the lift back.

    - `adapters_heard`: Was a fleet adapter heard?
    - `supervisor`: the session in the supervisor's last request on `lift_requests`, or "" after an END
    - `supervisor_last`: the time of that request
    - `granted_unheard`: Was a session granted before any message on `lift_requests` was heard?
    - `idle_ends`: the number of successive ENDs of one session while the lift showed another session.
      The tuple also has this session and the time of its last END.
    - `hazard`: when the lift's present hazard began; None if there is no hazard
    - `taken_from`: the last session that sent no END, but lost the lift to another session
    """

    kind = "lift"

    def __init__(self, name: str, began: Moment) -> None:
        super().__init__(name, began)
        self.floor = Fact(NO_FLOOR, began)
        self.door = Fact("", began)
        self.motion = Fact("", began)
        self.mode = Fact("", began)
        self.session = Fact(NOBODY, began)
        self.destination = Fact("", began)
        self.adapters_heard = False
        self.supervisor: Fact | None = None
        self.supervisor_last: Moment | None = None
        self.granted_unheard = False
        self.hazard: Moment | None = None
        self.taken_from = ""
        self.idle_ends: tuple[int, str, Moment] = (0, "", began)

    def facts(self, state: d.LiftState) -> dict[str, str]:
        """Return the session, mode, floor, motion, destination and door that the state shows."""
        return {
            "session": self.text(state.session_id) or NOBODY,
            "mode": words.word(d.LiftMode, state.current_mode),
            "floor": self.text(state.current_floor) or NO_FLOOR,
            "motion": words.plain(d.LiftMotion, state.motion_state),
            "destination": self.text(state.destination_floor),
            "door": words.plain(d.LiftDoor, state.door_state),
        }

    def checks(self, one: DeviceRequester) -> tuple[Check, ...]:
        """List the conditions of the requester's RequestLift."""
        wants = one.wants or "no floor"
        return request_lift(self.session.value, self.floor.value, self.door.value, one.who, wants)

    def asking(self, now: Moment) -> list[DeviceRequester]:
        """List the requesters that ask now, the earliest first. While the lift sends no states, nobody
        repeats a request. Therefore every requester that has sent no END then counts as asking."""
        stands = self.last_state is None or self.is_silent(now)
        asks = [
            one
            for one in self.requesters
            if one.ended is None and (one.asks(now) or (stands and not one.gone))
        ]
        return sorted(asks, key=lambda one: one.first.at)

    def waits(self, now: Moment) -> Iterator[Wait]:
        """Yield a `Wait` for each requester to which the lift's states do not yet show what it
        wants."""
        for one in self.asking(now):
            if self.is_silent(now) or not self.is_served(one):
                yield Wait(one.who, one.wants, one.lacks)

    def is_served(self, one: DeviceRequester) -> bool:
        """Return whether the requester has what it wants. A session in HUMAN mode waits for nothing
        more, because people call the lift."""
        return self.matches(one) or (one.human and one.who == self.session.value)

    @property
    def unrecorded(self) -> bool:
        """Return whether `lift_requests` cannot be heard: nothing came on this topic, though a session
        was granted. Such a recording does not contain the topic."""
        return self.granted_unheard and self.supervisor_last is None

    def not_passed_on(self, now: Moment) -> DeviceRequester | None:
        """Return a robot whose requests RMF's supervisor does not forward to the lift. The robot
        repeats a request or an END, but no message comes on `lift_requests`.

        If a robot has the lift, only this robot counts, because RMF's supervisor drops the requests of
        all other robots (lift_supervisor/Node.cpp). If the lift is free, any robot counts.

        Return None if `lift_requests` is unrecorded.
        """
        silent_at, holder = now.at - REQUESTER_SILENT_S, self.session.value
        last = self.supervisor_last
        if self.unrecorded or (last is not None and last.at > silent_at):
            return None
        asks = (
            one
            for one in self.requesters
            if one.own and holder in (NOBODY, one.who) and (one.asks(now) or one.ends(now))
            if (one.ended or one.first).at <= silent_at
        )
        return min(asks, key=lambda one: one.since.at, default=None)

    # ---- requests

    def _hear_other(self, moment: Moment, topic: str, message: d.Message) -> Iterator[News]:
        if not isinstance(message, d.LiftRequest):
            return
        who, ends = self.text(message.session_id), message.request_type == END
        passed_on = topic == "lift_requests"
        if passed_on:
            yield from self._passed_on(moment, "" if ends else who)
        else:
            self.adapters_heard = True
        if ends:
            yield from self._end(moment, who, passed_on)
            return
        if passed_on and self.adapters_heard:
            if found := self.requesters.get(who):
                found.passed_on = moment
            return
        wants, stands = self.text(message.destination_floor), self.is_silent(moment)
        one, new = self.requesters.ask(who, wants, moment, keep=self.session.value, stands=stands)
        one.human = message.request_type == d.LiftRequestType.REQUEST_HUMAN_MODE
        one.own = one.own or not passed_on
        one.passed_on = moment if passed_on else one.passed_on
        one.stamp(moment, message.request_time)
        if new:
            if who == self.session.value:
                one.granted = one.granted or self.session.since
            mode = words.word(d.LiftRequestType, message.request_type).removesuffix("_MODE")
            yield News("asks", moment, who, mode, one)

    def _passed_on(self, moment: Moment, asks: str) -> Iterator[News]:
        self.supervisor_last = moment
        if self.supervisor is None:
            self.supervisor = Fact(asks, moment)
        elif self.supervisor.say(asks, moment):
            yield News("passed on", moment, asks)

    def _end(self, moment: Moment, who: str, passed_on: bool) -> Iterator[News]:
        one, holds = self.requesters.get(who), who == self.session.value
        if not holds and not passed_on and self.state is not None:
            count = self.idle_ends[0] if self.idle_ends[1] == who else 0
            self.idle_ends = count + 1, who, moment
        if one is None and who and (holds or self.state is None):  # its requests were not heard
            one, _ = self.requesters.ask(who, "", moment)
            one.granted, one.ended, one.own = self.session.since, moment, not passed_on
            one.end_last, one.end_passed_on = None if passed_on else moment, passed_on
            yield News("ends", moment, who, passed_on=passed_on)
            return
        if one is None:
            return
        one.own, one.end_passed_on = one.own or not passed_on, one.end_passed_on or passed_on
        one.end_last = one.end_last if passed_on else moment
        if one.ended is not None:
            return
        yield News("ends", moment, who, requester=one, passed_on=passed_on)
        if passed_on and one.own and not holds:
            return  # the robot itself sent no END, so it may still wait
        one.ended = moment
        if not holds:
            yield self._over(moment, one)

    # ---- states

    def _settle(self, moment: Moment) -> Iterator[News]:
        if self.before is None:
            self.session.since = moment
        if "session" in self.changed or self.before is None:
            yield from self._changed_hands(moment)
        if self.changed and self.before is not None:
            yield News("changed", moment)
        hazardous = self.state is not None and self.state.current_mode in HAZARDS
        self.hazard = (self.hazard or moment) if hazardous else None
        for one in self.requesters:
            if one.ended is None and self.matches(one):
                one.lacks = moment
                if one.met is None:
                    one.met, one.reached = moment, one.wants
                    if one.boarded is None:
                        one.boarded, one.boarded_at = moment, one.wants
                    yield News("met", moment, one.who, requester=one)
            elif one.ended is None:
                one.met = None
            silent = moment.at - one.last.at > REQUESTER_SILENT_S
            if silent and one.ended is None and not one.gone:
                one.gone = True
                yield News("gone", moment, one.who, requester=one)
            elif silent and one.who != self.session.value:
                self.requesters.drop(one.who)

    def _changed_hands(self, moment: Moment) -> Iterator[News]:
        first, holder = self.before is None, self.session.value
        before = self.changed.get("session", NOBODY)
        old, new = self.requesters.get(before), self.requesters.get(holder)
        if NOBODY not in (before, holder) and not first and self.gap_s <= SILENT_S:
            unended = old is not None and old.ended is None and not old.end_passed_on
            self.taken_from = before if unended else ""
        if before != NOBODY and not first:
            yield News("lost", moment, before, requester=old)
            if old is not None:
                yield self._over(moment, old)
        if holder != NOBODY and not first:
            self.granted_unheard |= self.supervisor_last is None
            yield News("has", moment, holder, requester=new)
        if new is not None and holder != NOBODY:
            new.granted = moment

    def _over(self, moment: Moment, one: DeviceRequester) -> News:
        if one.ended is not None:
            self.requesters.drop(one.who)
        return News("over", moment, one.who, requester=one)
