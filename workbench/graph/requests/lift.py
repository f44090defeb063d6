"""Request a lift, as RequestLift.cpp does. End a session, as EndLiftSession.cpp does."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import topics, words
from bridges.messages.topics import AnyTopic
from bridges.observe.lift import HAZARDS, request_lift
from workbench.graph.requests import Failed, Fulfilled, Obstacle, Request, RequestProgress, nearest

OBEYS_WITHIN_S: Final = 5.0
"""Maximum time (s) that a supervisor needs to end a session. The supervisor has to hear a few states
first."""
MOVES_WITHIN_S: Final = 5.0
"""Time (s) to watch the lift after an operator's release. A person may stand at the car, and must know
whether the car moves."""


class _Lift(Request):
    __slots__ = ()
    kind = "lift"
    states, own = topics.LIFT_STATES, topics.LIFT_REQUESTS
    adapter = topics.ADAPTER_LIFT_REQUESTS

    @property
    def supervisor(self) -> AnyTopic | None:
        """The topic `lift_requests`, on which only supervisors publish."""
        return None if self.direct else self.own

    @property
    def _release(self) -> str:
        return self.line.other("send", "lift", self.name, "--end")


@dataclass(frozen=True, slots=True)
class LiftRide(_Lift):
    """A request for a session, and for the car at this floor with its door open. A fleet adapter sends
    the same request."""

    floor: str
    session: str
    granted_only: bool = False

    def message(self, seen: RequestProgress) -> d.LiftRequest:
        """Return the request. The request always has AGV_MODE and DOOR_OPEN, because fleets send
        nothing else."""
        return d.LiftRequest(
            lift_name=self.name,
            session_id=self.session,
            request_type=d.LiftRequestType.REQUEST_AGV_MODE,
            destination_floor=self.floor,
            door_state=d.LiftRequestDoor.DOOR_OPEN,
        )

    def outcome(self, seen: RequestProgress) -> Fulfilled | Failed | None:
        """Return Fulfilled after RequestLift's four fields match. Return Failed if the lift does not
        serve the floor."""
        states = seen.states_of(d.LiftState)
        served = states[-1].available_floors if states else ()
        if served and self.floor not in served:
            floors, near = ", ".join(served), nearest(self.floor, served)
            return Failed(f"{self.name} serves {floors}, not '{self.floor}'{near}")
        if not self._fulfilled(seen.answer(d.LiftState)):
            return None
        where = "" if self.granted_only else f" at {self.floor}, door open,"
        return Fulfilled(
            f"{self.name} is{where} held by {self.session}; to end that session: {self._release}"
        )

    def _remedy(self, seen: RequestProgress) -> str:
        if seen.told.get("boarded") != "yes":
            return f"to end that session: {self._release}"
        release = self.line.other("release", self.name, "--car-empty")
        return f"a robot may be in the car; if the car is empty: {release}"

    def _fulfilled(self, state: d.LiftState | None) -> bool:
        if state is None or state.session_id != self.session:
            return False
        door = words.plain(d.LiftDoor, state.door_state)
        checks = request_lift(state.session_id, state.current_floor, door, self.session, self.floor)
        return self.granted_only or all(check.met for check in checks)

    def obstacles(self, seen: RequestProgress) -> Iterable[Obstacle]:
        """Return the obstacles: another session has the lift, the mode is wrong, or the car has not
        reached the floor or opened the door."""
        state = seen.states_of(d.LiftState)[-1]
        name, session, mode = self.name, state.session_id, state.current_mode
        word = words.word(d.LiftMode, mode)
        return (
            Obstacle(
                session not in ("", self.session),
                f"{name} is held by {session}",
                self._remedy(seen),
            ),
            Obstacle(mode in HAZARDS, f"{name} serves no robot while its mode is {word}"),
            Obstacle(not session, f"{name} did not grant the session: see its daemon's log"),
            Obstacle(
                mode != d.LiftMode.MODE_AGV,
                f"{name} granted the session, but its mode is {word}, not AGV"
                " (a key switch, or people still use it)",
            ),
            Obstacle(
                state.current_floor != self.floor,
                f"{name} granted the session, but the car has not come to {self.floor}",
            ),
            Obstacle(True, f"the car is at {self.floor}, but its door is not seen open"),
        )


@dataclass(frozen=True, slots=True)
class LiftEnd(_Lift):
    """A request to end `session`. With "", the request ends the session in the first LiftState heard.

    With `falls_back`, the request may go to the lift's own daemon, if the supervisor does not end the
    session within OBEYS_WITHIN_S. This happens only if no robot is in the car. If a robot may be in the
    car, the operator must first confirm that the car is empty (`car_empty`).
    """

    session: str = ""
    falls_back: bool = False
    car_empty: bool = False

    def _ending(self, seen: RequestProgress) -> str:
        first = (state.session_id for state in seen.states_of(d.LiftState))
        return self.session or next(first, "")

    def message(self, seen: RequestProgress) -> d.LiftRequest | None:
        """Return a request END_SESSION without a floor, as fleets send it.

        Fleets send the `door_state` 0. This request has the `door_state` DOOR_OPEN, by which our lifts
        know that a person ends the session. Then the session ends even if a robot still sends requests
        for it.
        """
        session = self._ending(seen)
        if not session:
            return None
        return d.LiftRequest(
            lift_name=self.name,
            session_id=session,
            request_type=d.LiftRequestType.REQUEST_END_SESSION,
            door_state=d.LiftRequestDoor.DOOR_OPEN,
        )

    def outcome(self, seen: RequestProgress) -> Fulfilled | None:
        """Return Fulfilled after the state shows another session, or no session."""
        session = self._ending(seen)
        if seen.states and not session:
            return Fulfilled(f"{self.name} has no session: nothing to end")
        answer = seen.answer(d.LiftState)
        if answer is None or answer.session_id == session:
            return None
        if any(state.session_id == session for state in seen.states_of(d.LiftState)):
            return Fulfilled(f"{self.name} is no longer held by {session}")
        holder = answer.session_id
        instead = f"; {holder} has it" if holder else ""
        return Fulfilled(f"{self.name} is not held by {session}: nothing to end{instead}")

    @property
    def watched_s(self) -> float:
        """Time (s) to watch the lift after the session's end."""
        return MOVES_WITHIN_S if self.falls_back else 0.0

    def goes_direct(self, seen: RequestProgress, now: float) -> bool:
        """Return whether to ask the lift's own daemon now. OBEYS_WITHIN_S must have passed, so that a
        supervisor had time to end the session. The lift or the operator must have said that the car
        is empty."""
        asked_at = seen.began_at if seen.first_sent_at is None else seen.first_sent_at
        late = now >= asked_at + OBEYS_WITHIN_S
        return self.falls_back and not self.direct and late and self._outside(seen)

    def nobody(self, seen: RequestProgress) -> Obstacle:
        """Return the obstacle that no supervisor is there. If a robot may be in the car, the operator
        must first confirm that the car is empty. Only then is the lift's own daemon asked instead."""
        found = super(LiftEnd, self).nobody(seen)
        if self.direct or not self.falls_back or not seen.states:
            return found
        holder = seen.states_of(d.LiftState)[-1].session_id
        if holder != self._ending(seen):
            text = f"{self.name} is held by {holder or 'nobody'}, not by {self._ending(seen)}"
            there = self.line.other("release", self.name, "--session", holder)
            return Obstacle(True, text, f"to end the present session: {there}" if holder else "")
        if self._outside(seen):
            return found._replace(remedy="the lift's own daemon is asked instead")
        return found._replace(remedy=f"if the car is empty: {self.line.again_with('--car-empty')}")

    def _outside(self, seen: RequestProgress) -> bool:
        return self.car_empty or seen.told.get("boarded") == "no"

    def obstacles(self, seen: RequestProgress) -> Iterable[Obstacle]:
        """Return the only obstacle: the lift still shows the session."""
        if self.falls_back and not self._outside(seen):
            text = (
                f"{self.name} still shows the session, and a robot may be in the car: look inside"
            )
            there = self.line.again_with("--car-empty")
            return (Obstacle(True, text, f"if the car is empty: {there}"),)
        if self.direct or self.falls_back:
            text = f"{self.name} still shows the session: see its daemon's log"
            return (Obstacle(True, text),)
        text = f"{self.name} still shows the session: the supervisor may have dropped the request"
        there = self.line.again_with("--direct")
        return (Obstacle(True, text, f"to ask the lift's own daemon: {there}"),)


def aftermath(states: Sequence[d.LiftState]) -> str:
    """Tell which requester has the lift now, and whether the car or the door moves.

    `states` begins with the state that showed the end of the session.
    """
    last = states[-1]
    who = f"{last.session_id} has it now" if last.session_id else "nobody has it now"
    if len(states) == 1:
        return (
            f"{who}; no state came in {MOVES_WITHIN_S:g} s, so it is unknown whether anything moves"
        )
    stands = d.LiftMotion.MOTION_STOPPED, d.LiftMotion.MOTION_UNKNOWN
    going = {one.motion_state for one in states if one.motion_state not in stands}
    moved = [f"the car goes {words.plain(d.LiftMotion, motion)}" for motion in sorted(going)]
    floors = [
        floor or "no known floor" for floor, _ in groupby(one.current_floor for one in states)
    ]
    doors = [words.plain(d.LiftDoor, door) for door, _ in groupby(one.door_state for one in states)]
    for part, course in (("floor", floors), ("door", doors)):
        moved += [f"{part} {' to '.join(course)}"] if len(course) > 1 else []
    what = "; ".join(moved) or "neither the car nor its door moved"
    return words.printable(f"{who}; in the {MOVES_WITHIN_S:g} s after the release: {what}")
