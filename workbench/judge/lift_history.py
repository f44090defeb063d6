"""The history of a lift, with its requests, its sessions, and the floors at which its door was open."""

from collections import deque
from dataclasses import dataclass, field
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard, Sender
from bridges.messages.stamps import in_seconds
from bridges.observe.lift import HAZARDS, ObservedLift
from bridges.observe.limits import SLOWEST_S
from workbench.judge.history import NOT_YET, History, keep

GRACE_S: Final = 65.0
"""Time (s) after a session's end in which the same session may get the lift again at once. Its robot
may still be in the car."""
LATE_S: Final = 5.0
"""Maximum time (s) from an END to a late state that shows the ended session for the first time."""
FLOORS: Final = 8
OURS_S: Final = 2.0
"""Time (s) after a session's end in which an END of our own does not count as that session's END. It
came too late to cause the end."""
ASKED_S: Final = 10.0
"""Time (s) without a request for a floor after which the robot counts as not wanting this floor any
more. An adapter repeats a request after each state."""
AT_ONCE_S: Final = 0.3
"""Time (s) that counts as immediately. It is longer than a scan of the inputs plus the transport of a
state and a request."""
REOPENS_WITHIN_S: Final = 1.0
ASKS_S: Final = 6.0
"""Time (s) from a robot's own request, in which a lift may ignore an END from lift_requests. The reason
is that RMF's restarted supervisor also ends the session of a robot that is still in the car."""
ENDS_WITHIN_S: Final = 3.0
"""Maximum time (s) until an END takes effect. It allows one state period of 2 s, and one scan of the
inputs."""
REPEATED_S: Final = 1.0
"""Time (s) for which an END with an old stamp must be repeated before it counts."""
BROKEN_OFF_S: Final = 3.0
"""The longest pause (s) between two such ENDs. RMF repeats an END at each state, which comes each
second."""
END: Final = d.LiftRequestType.REQUEST_END_SESSION


@dataclass
class Ask:
    """The requests of one session after `first_at`. A series of requests ends with an END or a long
    gap.

    - `floors`: floor -> time of the last request.
    - `direct`: whether a request was heard on lift_requests.
    - `direct_at`: time of the latest request on lift_requests.
    - `times`: number of requests on lift_requests in the present series.
    - `since`: the time at which this series began.
    - `human`: whether the session requested HUMAN mode.
    - `stamp`: the newest stamp (s) of a request on lift_requests.
    - `direct_end_at`: time of the last END on lift_requests.
    - `own_at`, `own_end_at`: times of the robot's last request and last END on adapter_lift_requests.
    """

    first_at: float
    since: float
    floors: dict[str, float] = field(default_factory=dict)
    times: int = 0
    human: bool = False
    direct_at: float = NOT_YET
    direct: bool = False
    stamp: float = 0.0
    direct_end_at: float = NOT_YET
    own_at: float = NOT_YET
    own_end_at: float = NOT_YET

    @property
    def floor(self) -> str:
        """The floor of the latest request."""
        return next(reversed(self.floors), "")

    @property
    def disowned(self) -> bool:
        """Whether this session was ended although its robot still wants it. The last message on
        lift_requests (the supervisor's topic) was END. After this END, the robot sent a request on
        adapter_lift_requests (the robots' topic)."""
        return self.own_at > self.direct_end_at > self.direct_at

    def goes_on(self, now: float) -> bool:
        """Return whether the robot still wants the lift. Its last message on adapter_lift_requests must
        be a request, and be younger than ASKS_S."""
        return self.own_at > self.own_end_at and now - self.own_at < ASKS_S


@dataclass
class Ending:
    """Times of the ENDs for the present session on lift_requests.

    - `at`: the first END.
    - `bare_at`: the first END, if it has no floor.
    - `floor_at`: the first END with a floor.
    - `old_at`, `old_again_at`: the first and the last END whose stamp is older than a stamp of the
      session's requests. A lift may take such an END for an END of an earlier ride, until the END is
      repeated for REPEATED_S. After a pause of BROKEN_OFF_S an END is a first END again.

    RMF's supervisor first sends an END without a floor. If the lift still shows the session, the
    supervisor sends an END with a floor.
    """

    at: float = NOT_YET
    bare_at: float = NOT_YET
    floor_at: float = NOT_YET
    old_at: float = NOT_YET
    old_again_at: float = NOT_YET


class LiftHistory(History[d.LiftState]):
    """The history of one lift. The present session is the session that the latest state shows.

    - `asks`: session -> its requests for this lift.
    - `elsewhere`: session -> time of its last request for another lift.
    - `ended`: session -> its last END.
    - `granted_at`: when a state first showed the present session.
    - `held_since`: when a state first showed the previous session.
    - `known`: whether the beginning of the present session was seen.
    - `last`: the last session that has ended.
    - `last_at`: the end of that session.
    - `offered`: whether an earlier state has shown the door OPEN for this session at its destination.
    - `offers`: whether the latest state shows the door OPEN while `offered` was still false.
    - `ending`: the ENDs of the present session.
    - `bare_refused`: number of sessions in a row that did not end after an END without a floor, but
      then ended after an END with a floor.
    - `reopened`: times at which the door opened again immediately, during one stop at a floor.
    - `closings`: times at which the door opened again, after it had left OPEN for no known reason,
      during one stop at a floor.
    - `stayed`: whether the latest state ends a stop in which the door was OPEN in two states in a row,
      and never left OPEN.
    - `recorded`: whether any request on lift_requests was heard. A recording may lack this topic.
    - `open_seen`: floor and time of the last OPEN at another floor.
    - `direct_at`: when another session last sent a request on lift_requests, for any lift.
    - `rival_at`: when another session last sent a request on lift_requests for this lift, while it was
      held.
    - `foreign_end_at`: time of the last END for a session that did not hold the lift.
    - `unserved_at`: time of the last request for a floor that the lift does not serve. The holder sent
      the request, or the lift was free.
    - `travelled`: whether the car has moved in this session.
    - `bare_end`: whether the previous session ended after an END without a floor.
    - `free_since`: since when there has been neither a session nor a hazard.
    - `false_alarms`: times of needless `false` messages on the fire topic.
    - `called_off`: whether the latest message on the fire topic ended an alarm.
    - `volatile`: whether the fire topic's publisher retains nothing; None if unknown.
    """

    seen: ObservedLift
    observes = ObservedLift

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.asks: dict[str, Ask] = {}
        self.elsewhere: dict[str, float] = {}
        self.ended: dict[str, float] = {}
        self.granted_at = self.held_since = self.last_at = NOT_YET
        self.known = False
        self.last = ""
        self.offered = self.offers = False
        self.ending = Ending()
        self.bare_refused = 0
        self.reopened: deque[float] = deque(maxlen=3)
        self.open_seen = ("", NOT_YET)
        self.direct_at = self.rival_at = self.foreign_end_at = self.unserved_at = NOT_YET
        self.travelled = self.bare_end = False
        self.false_alarms: deque[float] = deque(maxlen=3)
        self.alarmed = self.called_off = False
        self.volatile: bool | None = None
        self.free_since = NOT_YET
        self.closings: deque[float] = deque(maxlen=3)
        self.stayed = self.recorded = False
        self._stop: tuple[str, str] = ("", "")
        self._stood = self._left = self._explained = False
        self._open: tuple[str, float] = ("", NOT_YET)
        self._shut_at = NOT_YET

    @property
    def session(self) -> str:
        """The present session."""
        return self.state.session_id if self.state else ""

    @property
    def session_before(self) -> str:
        """The session in the previous state."""
        return self.before.session_id if self.before else ""

    def has_ended(self, session: str, since: float) -> bool:
        """Return whether an END for this session has come after `since`, or at most LATE_S before it.

        If the session has sent a request since that END, the END belongs to an earlier ride, or the
        session has survived it. Then the END counts only for a moment.
        """
        at, ask = self.ended.get(session, NOT_YET), self.asks.get(session)
        goes_on = ask is not None and max(ask.own_at, ask.direct_at) > at
        late = goes_on and self.now - at > ENDS_WITHIN_S + ASKS_S
        return at > since - LATE_S and not late

    def was_asked_to(self, floor: str, within_s: float = float("inf")) -> bool:
        """Return whether the present session requested this floor. Only its last request counts, and
        requests that came less than `within_s` ago."""
        ask = self.asks.get(self.session)
        if ask is None or floor not in ask.floors:
            return False
        return floor == ask.floor or self.now - ask.floors[floor] < within_s

    def take_other(self, heard: Heard) -> bool:
        """Take requests for this lift and for other lifts, and the fire alarm."""
        message = heard.message
        if isinstance(message, d.Bool) and heard.topic == topics.FIRE_ALARM_TRIGGER.name:
            return self._alarm(message.data, heard.sender)
        if not isinstance(message, d.LiftRequest):
            return False
        direct = heard.topic == topics.LIFT_REQUESTS.name
        self.recorded |= direct
        if message.lift_name != self.name:
            if message.request_type != END and direct:
                keep(self.elsewhere, message.session_id, self.now)
                self._hear_direct(message)
            return False
        if direct:
            self.asked()
        if message.request_type == END:
            self._end(message, direct)
        else:
            self._ask(message, direct)
        return True

    def forget(self) -> None:
        """Forget what the judge knows of the present session after a pause, because the node may have
        restarted."""
        self.known = False
        if self.seen.before is not None and self.seen.before.session_id:
            self.last = self.seen.before.session_id
        self.granted_at = self.free_since = self.now
        self.offered = True
        self.ending = Ending()
        self.open_seen = self._open = ("", NOT_YET)

    def settle(self, state: d.LiftState) -> None:
        """Note changes of the session and of the door. Update `offers` and `offered`."""
        if self.before is not None and self.session != self.session_before:
            self._changed_hands(state)
        if self.session or state.current_mode in (*HAZARDS, d.LiftMode.MODE_UNKNOWN):
            self.free_since = self.now
        elsewhere = self.before is not None and self.before.current_floor != state.current_floor
        self.travelled |= moves(state) or elsewhere
        opened = self.claims(state)
        wanted = self._wanted()
        if state.current_mode not in HAZARDS:  # in a hazard the car may go to its recall floor
            wanted = (state.destination_floor, *wanted)
        self.offers = bool(opened and self.session and not self.offered)
        self._look_at_door(state, opened)
        self._look_at_stop(state, opened)
        if self.offers and state.current_floor in wanted:
            self.offered = True

    @staticmethod
    def claims(state: d.LiftState) -> bool:
        """Return whether the state shows the door OPEN. At such a state a robot would drive."""
        return state.door_state == d.LiftDoor.DOOR_OPEN

    def _wanted(self) -> tuple[str, ...]:
        ask = self.asks.get(self.session)
        return (ask.floor,) if ask else ()

    def _changed_hands(self, state: d.LiftState) -> None:
        before, now = self.session_before, self.session
        self._count_bare(before)
        resumed = now == self.last and self.now - self.granted_at <= GRACE_S
        self.offered = self.offered and (resumed or not now)
        if before:
            self.last, self.last_at = before, self.now
        self.held_since, self.granted_at = self.granted_at, self.now
        self.bare_end = self.ending.bare_at > NOT_YET and self.ending.floor_at == NOT_YET
        self.known, self.travelled, self.ending = True, False, Ending()
        self.reopened.clear()

    def _count_bare(self, before: str) -> None:
        """Update `bare_refused` when a session has ended. It counts sessions that ignored an END
        without a floor."""
        ending = self.ending
        if not before or ending.bare_at == NOT_YET:
            return
        if ending.floor_at == NOT_YET:
            self.bare_refused = 0
        elif self.now - ending.floor_at < AT_ONCE_S < ending.floor_at - ending.bare_at:
            self.bare_refused += 1

    def _look_at_door(self, state: d.LiftState, opened: bool) -> None:
        floor, at = self._open
        if opened:
            same = floor == state.current_floor
            if same and at < self._shut_at and self.now - self._shut_at < REOPENS_WITHIN_S:
                self.reopened.append(self.now)
            self.open_seen = self.open_seen if same else self._open
            self._open = self._open if moves(state) else (state.current_floor, self.now)
        elif at > self._shut_at:
            self._shut_at = self.now

    def _look_at_stop(self, state: d.LiftState, opened: bool) -> None:
        """Note whether the door stays OPEN at the floor of the session's latest request. A lift may
        close its door outside AGV mode, after an END, and for a robot that no longer asks."""
        ask, before = self.asks.get(self.session), self.before
        stop = (self.session, ask.floor if ask else "")
        self.stayed = stop != self._stop and self._stood and not self._left
        if stop != self._stop or before is None:
            self._stop, self._stood, self._left = stop, False, False
            self.closings.clear()
        if ask is None or before is None or state.current_floor != ask.floor:
            self._explained = True
            return
        asked_s = self.now - max(ask.own_at, ask.direct_at)
        ended = self.ending.at > NOT_YET or asked_s > ASKED_S
        calm = state.current_mode == d.LiftMode.MODE_AGV and not ended
        was_open = self.claims(before)
        if was_open and not opened:
            self._left, self._explained = True, False
        if opened and not was_open and self._left and calm and not self._explained:
            self.closings.append(self.now)
        self._explained |= not calm
        self._stood |= opened and was_open

    def _end(self, message: d.LiftRequest, direct: bool) -> None:
        if not self.own or self.now - self.last_at > OURS_S:
            keep(self.ended, message.session_id, self.now)
        if direct and message.session_id != self.session:
            self.foreign_end_at = self.now
        ask = self.asks.get(message.session_id)
        if ask is not None:
            ask.times = 0
            if direct:
                ask.direct_end_at = self.now
            else:
                ask.own_end_at = self.now
        if not direct or message.session_id != self.session or not self.session:
            return
        ending, stamp = self.ending, in_seconds(message.request_time)
        if ask is not None and 0.0 < stamp < ask.stamp:
            broken_off = self.now > ending.old_again_at + BROKEN_OFF_S
            ending.old_at = self.now if broken_off else ending.old_at
            ending.old_again_at = self.now
            if self.now - ending.old_at < REPEATED_S:
                return
        ending.at = self.now if ending.at == NOT_YET else ending.at
        if message.destination_floor:
            ending.floor_at = self.now if ending.floor_at == NOT_YET else ending.floor_at
        elif ending.at == self.now:
            ending.bare_at = self.now

    def _ask(self, message: d.LiftRequest, direct: bool) -> None:
        session = message.session_id
        ask = self.asks.get(session) or Ask(self.now, self.now)
        if direct and (not ask.times or self.now - ask.direct_at > SLOWEST_S):
            ask.since = self.now
        if direct:
            ask.direct_at = self.now
            ask.stamp = max(ask.stamp, in_seconds(message.request_time))
        else:
            ask.own_at = self.now
        ask.direct = ask.direct or direct
        ask.times += direct
        ask.human |= message.request_type == d.LiftRequestType.REQUEST_HUMAN_MODE
        moved = message.destination_floor != ask.floor
        keep(ask.floors, message.destination_floor, self.now, FLOORS)
        keep(self.asks, session, ask)
        if direct:
            self._hear_direct(message)
        if session == self.session:
            self.ending = Ending()
        if session == self.session and moved:
            self.reopened.clear()

    def _hear_direct(self, request: d.LiftRequest) -> None:
        """Note a request on lift_requests with which the judge can test the laws. Such a request comes
        from another session, or is for a floor that the lift does not serve."""
        here, holds = request.lift_name == self.name, request.session_id == self.session
        served = self.state.available_floors if self.state else ()
        if not holds:
            self.direct_at = self.now
            self.rival_at = self.now if here and self.session else self.rival_at
        if here and (holds or not self.session) and served:
            unserved = request.destination_floor not in served
            self.unserved_at = self.now if unserved else self.unserved_at

    def _alarm(self, on: bool, sender: Sender | None) -> bool:
        """Take a message on the fire topic, if this lift's node sent it. A message whose sender nobody
        knows may be of a fire panel."""
        if sender is None or sender.node != self.publisher or not sender.node:
            return False
        self.called_off = self.alarmed and not on
        if not on and not self.alarmed:
            self.false_alarms.append(self.now)
        self.alarmed = on
        return True


def moves(state: d.LiftState) -> bool:
    """Return whether the state says that the car moves."""
    return state.motion_state in (d.LiftMotion.MOTION_UP, d.LiftMotion.MOTION_DOWN)
