"""The laws of a fleet adapter, for all lifts and doors that the adapter uses.

No message tells where the robot is. Therefore a request for another floor counts as the robot's entry,
and END counts as the robot's exit. The judge expects the adapter to know only what published states
have shown.
"""

from collections.abc import Callable
from typing import Final

from bridges.messages import definitions as d
from bridges.observe.lift import ObservedLift
from bridges.observe.limits import REQUESTER_SILENT_S, SLOWEST_S
from workbench.judge.adapter_history import (
    AGAIN,
    IGNORED,
    SLOW_S,
    SPAM,
    AdapterHistory,
    Wish,
)
from workbench.judge.history import NOT_YET, OFTEN_S
from workbench.judge.law import KEPT, Doubt, Finding, Law, shown

CONTEXT: Final = "rmf_ros2 agv/RobotContext.cpp:1700-1735"
REQUEST_LIFT: Final = "rmf_ros2 phases/RequestLift.cpp:322-326"
DOOR_OPEN: Final = "rmf_ros2 phases/DoorOpen.cpp"
NEVER_ENDS_S: Final = 60.0
"""Time (s) of silence after which a robot can no longer be on its way out of a car."""
FOR_EVER_S: Final = 60.0
SPAM_S: Final = 10.0
"""The longest time (s) for SPAM needless ENDs at the pace of the states. A person's presses of a button
are slower."""
LISTS: Final = 5
SLOW: Final = 4
SLOW_PART: Final = 0.75
OVERSTAYS: Final = 2
TASKS_S: Final = 3.0
"""Maximum delay (s) from a new task to the fleet state that shows the task."""
GOES: Final = (d.LiftRequestType.REQUEST_END_SESSION, d.LiftRequestType.REQUEST_AGV_MODE)


def _numbers(history: AdapterHistory) -> Finding:
    match history.wish and history.news:
        case d.LiftRequest() as request:
            if request.request_type not in GOES:
                return f"request_type {request.request_type}: AGV_MODE is 1, END_SESSION 0"
            if request.request_type and request.door_state != d.LiftRequestDoor.DOOR_OPEN:
                return f"door_state {request.door_state} in a request: DOOR_OPEN is 2"
        case d.DoorRequest() as request:
            if request.requested_mode.value not in (0, 2):
                return f"requested_mode {request.requested_mode.value}: OPEN is 2, CLOSED 0"
        case _:
            return None
    return KEPT


def _one_id(history: AdapterHistory) -> Finding:
    if history.wish is None or history.lists < LISTS or history.wish.ended:
        return None
    who = history.wish.who
    if who in history.listed:
        return KEPT
    text = f"{shown(who)} is no robot in fleet_states"
    return Doubt(text, lambda: who in history.listed, TASKS_S)


def _stamps(history: AdapterHistory) -> Finding:
    if history.wish is None or history.was is None or not history.stamped:
        return None
    if not history.stepped:
        return KEPT
    again = history.often(history.back)
    return f"its stamps went back {AGAIN} times within {OFTEN_S:.0f} s" if again else None


def _floors(history: AdapterHistory) -> Finding:
    wish, lift = history.wish, history.device
    if wish is None or wish.ended or not isinstance(lift, ObservedLift) or lift.state is None:
        return None
    served = lift.state.available_floors
    if wish.wants in served:
        return KEPT
    return f"asks for {shown(wish.wants)}, a floor not served" if served else None


def _repeats(kind: str) -> Callable[[AdapterHistory], Finding]:
    """Return a check that the adapter repeats its requests during a wait. `kind` is lift or door."""

    def check(history: AdapterHistory) -> Finding:
        wish = history.wish
        for one in [wish] if wish else history.stated:
            if one.device is None or one.device.kind != kind:
                continue
            waits = f"{shown(one.who)} waits for {shown(one.wants)}"
            if one.proven and (one.ignored or wish) and history.lapses.get(one.visits, 0) >= AGAIN:
                return (
                    f"{waits}, but it sent no request for {IGNORED} states or more, again and again"
                )
            waited_s = history.now - one.since.at
            if wish and one.slow >= SLOW and one.slow_s > SLOW_PART * waited_s:
                return f"{waits}, with {one.slow} gaps of more than {SLOW_S} s between its requests"
        met = [one for one in history.met if one.device is not None and one.device.kind == kind]
        return KEPT if any(one.repeated for one in met) else None

    return check


REPEATS: Final = (
    "three requests in a wait that is then fulfilled, four long gaps between the requests of a wait, or"
    " two waits with 5 states without a request while fleet_states come"
)


def _changes(history: AdapterHistory) -> Wish | None:
    """If this request is for another floor than before, return a copy of the visit from before the
    request. Otherwise return None."""
    wish, was = history.wish, history.was
    if wish is None or was is None or wish.ended or not isinstance(history.device, ObservedLift):
        return None
    goes_on = wish.first is was.first and was.wants
    return was if goes_on and wish.wants != was.wants else None


def _explained(history: AdapterHistory, was: Wish, text: str) -> Finding:
    """Return a possible breach. A late message (a state, an alarm or a new task) may still excuse it.
    Then the judge drops the breach."""
    lift = history.device
    assert lift is not None
    return Doubt(text, lambda: lift.matches(was) or history.excused(was), TASKS_S)


def _enters(history: AdapterHistory) -> Finding:
    was = _changes(history)
    if was is None or history.wish is None or was.inside or not was.whole:
        return None
    if was.met:
        return KEPT
    text = (
        f"{shown(was.who)} requests {shown(history.wish.wants)} before a state showed its session"
        f" OPEN at {shown(was.wants)} (a defect of RMF: rmf_ros2#389, or Jazzy's replan)"
    )
    return _explained(history, was, text)


def _rides(history: AdapterHistory) -> Finding:
    for one in history.stated:
        if one.inside and one.met and one.met.at == history.now:
            return KEPT
    was, wish = _changes(history), history.wish
    if was is None or wish is None or not was.inside or was.met:
        return None
    text = f"{shown(was.who)} asks for {shown(wish.wants)} on its ride to {shown(was.wants)}"
    known = ", where the robot came from (a defect of RMF: rmf_ros2#555)"
    return _explained(history, was, text + (known if wish.wants == was.came_from else ""))


def _ends(history: AdapterHistory) -> Finding:
    wish, was = history.wish, history.was
    if wish is not None and isinstance(history.device, ObservedLift):
        holds = history.device.session.value == wish.who
        first = wish.ended is not None and (was is None or was.ended is None)
        return KEPT if first and holds else None
    for one in _holders(history):
        silent_s = one.ignored_s(history.now)
        if silent_s > NEVER_ENDS_S and not one.ended and (one.met or not one.wants):
            return f"{shown(one.who)} has the lift, but sent no request and no END for {silent_s:.0f} s"
    return None


def _ends_again(history: AdapterHistory) -> Finding:
    wish, was = history.wish, history.was
    if wish is not None and isinstance(history.device, ObservedLift):
        again = was is not None and was.ended is not None and wish.ended is was.ended
        return KEPT if again and len(wish.spare) == 1 else None
    for one in _holders(history):
        silent_s = one.ignored_s(history.now)
        limit_s = SLOWEST_S if one.named else NEVER_ENDS_S  # perhaps an END of another node
        if one.ended and silent_s > limit_s:
            return f"{shown(one.who)} still has the lift, {silent_s:.1f} s after its last END"
    return None


def _holders(history: AdapterHistory) -> list[Wish]:
    """Return a list with the visit of the lift's present holder. Return [] if the holder is none of the
    judged robots."""
    news = history.news
    holder = news.session_id if isinstance(news, d.LiftState) else None
    return [one for one in history.stated if one.who == holder]


def _stops_ending(history: AdapterHistory) -> Finding:
    wish = history.wish
    if wish is not None and wish.ended and isinstance(history.device, ObservedLift):
        late_s = history.now - max(wish.ended.at, wish.held_at)
        spare_s = history.now - wish.spare[0] if len(wish.spare) == SPAM else SPAM_S
        if spare_s >= SPAM_S or late_s < SLOWEST_S or history.device.state is None:
            return None
        return (
            f"{SPAM} ENDs within {spare_s:.1f} s, after its session had ended (a defect of RMF:"
            " rmf_ros2#382, #415)"
        )
    for one in history.stated:
        silent = history.now - one.last.at > REQUESTER_SILENT_S
        if silent and one.ended and one.held_at > NOT_YET and one not in _holders(history):
            return KEPT
    return None


def _closes(history: AdapterHistory) -> Finding:
    wish, was = history.wish, history.was
    if wish is None or not isinstance(history.news, d.DoorRequest):
        return None
    if wish.ended:
        return KEPT if was is not None and was.met and not was.ended else None
    passages = history.unclosed.get(wish.who, 0)
    begins = wish.times == 1 and passages >= AGAIN
    return (
        f"it sends OPEN, but sent no CLOSE after its last {passages} passages" if begins else None
    )


def _stops_opening(history: AdapterHistory) -> Finding:
    wish, was = history.wish, history.was
    if wish is None or was is None or not was.met or not isinstance(history.news, d.DoorRequest):
        return None
    times = history.overstays.get(wish.who, 0)
    if wish.ended and times:
        again = times >= OVERSTAYS and not was.ended
        text = f"it repeated OPEN for more than {SLOWEST_S:.0f} s after the door was open for it"
        return f"{text}, {times} times in a row" if again else None
    if wish.ended:
        return KEPT
    open_s = history.now - was.matched.at if was.matched else 0.0
    goes_on = wish.matched is was.matched and open_s > FOR_EVER_S
    return (
        f"still asks for OPEN, {open_s:.0f} s after the door opened for this robot"
        if goes_on
        else None
    )


LAWS: Final[tuple[Law[AdapterHistory], ...]] = (
    Law(
        "T1.numbers",
        "A lift request is AGV_MODE with DOOR_OPEN, or END; a door request is OPEN or CLOSED",
        "a request",
        "Numbers differ between requests and states: AGV is 1 in a request and 2 in a state",
        "LiftRequest.msg, DoorMode.msg",
        _numbers,
    ),
    Law(
        "A7.id",
        "Each robot has one id, fleet/robot, for lifts and doors",
        "a request (not END) after 5 fleet_states of the fleet",
        "A lift knows a robot by its session's name. With a second name, the robot is a stranger",
        "rmf_ros2 agv/RobotContext.cpp:1425",
        _one_id,
    ),
    Law(
        "A7.stamp",
        "No request of a robot has an older stamp than the robot's request before, except after a step"
        " of the clock",
        "two requests with stamps",
        "RMF's door supervisor ignores a CLOSE older than the OPEN. The door stays open",
        "rmf_ros2 door_supervisor/Node.cpp",
        _stamps,
    ),
    Law(
        "A7.floor",
        "The requested floor is one of available_floors",
        "a request to a lift that lists its floors",
        "RMF compares the names letter by letter. With another name the robot would wait for ever",
        "LiftRequest.msg, destination_floor",
        _floors,
    ),
    Law(
        "A7.repeats",
        "While a robot waits for the lift, its adapter repeats the request after each state",
        REPEATS,
        "A request may be lost, and a supervisor forgets requests in a restart",
        CONTEXT,
        _repeats("lift"),
    ),
    Law(
        "A7.enters",
        "A robot requests its next floor only after a state has shown its session, its floor and OPEN",
        "a robot asks for its second floor",
        "The request for the next floor shows that the robot is in the car. If a condition was"
        " missing, the robot has driven against a closed door or into another robot's car",
        REQUEST_LIFT,
        _enters,
    ),
    Law(
        "A7.rides",
        "During the ride, a robot requests no other floor, except in an alarm or for a new task",
        "a complete ride",
        "Otherwise the car would turn round with the robot inside",
        "rmf_ros2#555, PR#556",
        _rides,
    ),
    Law(
        "A7.ends",
        "A robot that has left the car sends END. A robot with a session is never silent for 60 s",
        "END during the session, or 60 s without a request while fleet_states come",
        "A session ends only by END. Without END the lift is lost to everybody else",
        CONTEXT,
        _ends,
    ),
    Law(
        "A7.again",
        "END is repeated until a state no longer shows the session",
        "a state that still shows the session after END",
        "One END may be lost, and nobody else would send another",
        CONTEXT,
        _ends_again,
    ),
    Law(
        "A7.stops",
        "After the session has ended, the adapter stops sending END",
        "3.5 s after the end of its session",
        "A late END would end a person's requests, or the requests for the robot's next ride",
        "rmf_ros2#382, #415",
        _stops_ending,
    ),
    Law(
        "A8.repeats",
        "While a robot waits for the door, OPEN is repeated each second",
        REPEATS,
        "door_requests are not retained, and a supervisor forgets the robot in a restart",
        DOOR_OPEN,
        _repeats("door"),
    ),
    Law(
        "A8.closes",
        "After the passage the adapter sends CLOSE",
        "CLOSE after the door has opened for the robot, or two passages without CLOSE",
        "The supervisor has no timeout. It keeps the door open for a robot that has gone",
        "rmf_ros2 door_supervisor/Node.cpp, phases/DoorClose.cpp",
        _closes,
    ),
    Law(
        "A8.stops",
        "The adapter stops requesting OPEN after the door is open and the heartbeat lists the robot",
        "CLOSE after the door has opened for the robot; or OPEN for 60 s after it has opened, or for 5"
        " s in two passages in a row",
        "RMF's DoorOpen ends at these conditions. Each further OPEN renews the robot's hold",
        DOOR_OPEN,
        _stops_opening,
    ),
)
