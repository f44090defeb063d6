"""What `send` can want of a lift, a door or a charger, and how one sees that it has come about.

Requests are those of RMF's fleet adapters, and so are the conditions that they wait for
(rmf_ros2 9dedd0f, phases/RequestLift.cpp, EndLiftSession.cpp, DoorOpen.cpp, DoorClose.cpp).
"""

from typing import Any

from bridges.commands.effects import ByName, Done, Failed, SoFar, described, nearest, nobody_listens
from bridges.rmf import definitions as d
from bridges.rmf import topics, words
from bridges.rmf.stamps import duration
from bridges.rmf.topics import Topic


def _adapter_or_direct(
    adapter: Topic[Any], node: Topic[Any], kind: str, *, direct: bool
) -> tuple[Topic[Any], str]:
    if direct:
        return node, nobody_listens(node, None, f"{kind} daemon")
    return adapter, nobody_listens(adapter, node, f"{kind} supervisor")


# --- lifts -------------------------------------------------------------------------------------

SHUT_OUT = (d.LiftMode.MODE_FIRE, d.LiftMode.MODE_OFFLINE, d.LiftMode.MODE_EMERGENCY)


class LiftRide(ByName):
    """The session, and the car at this floor with its door open, as a fleet adapter asks for it."""

    states: Topic[Any] = topics.LIFT_STATES

    def __init__(
        self, name: str, floor: str, session: str, *, direct: bool, granted_only: bool
    ) -> None:
        self.name, self.floor, self.session = name, floor, session
        self.granted_only = granted_only
        self.topic, self.nobody = _adapter_or_direct(
            topics.ADAPTER_LIFT_REQUESTS, topics.LIFT_REQUESTS, "lift", direct=direct
        )

    def request(self, so_far: SoFar) -> d.LiftRequest:
        """AGV_MODE with DOOR_OPEN, whatever is wanted: fleets send nothing else."""
        return d.LiftRequest(
            lift_name=self.name,
            session_id=self.session,
            request_type=d.LiftRequestType.REQUEST_AGV_MODE,
            destination_floor=self.floor,
            door_state=d.LiftRequestDoor.DOOR_OPEN,
        )

    def outcome(self, so_far: SoFar) -> Done | Failed | None:
        """The four fields that RequestLift waits for; a floor not served fails at once."""
        latest = so_far.latest()
        if latest and latest.available_floors and self.floor not in latest.available_floors:
            floors = ", ".join(latest.available_floors)
            near = nearest(self.floor, latest.available_floors)
            return Failed(words.printable(f"{self.name} serves {floors}: no {self.floor!r}{near}"))
        match so_far.answer():
            case d.LiftState(session_id=self.session) if self.granted_only:
                return Done(f"{self.name} is held by {self.session}{self._until()}")
            case d.LiftState(
                session_id=self.session,
                current_floor=self.floor,
                door_state=d.LiftDoor.DOOR_OPEN,
            ):
                return Done(
                    f"{self.name} is at {self.floor}, open, for {self.session}{self._until()}"
                )
        return None

    def _until(self) -> str:
        return f"; `rmf-bridge send lift {self.name} --end` releases it"

    def reason(self, so_far: SoFar) -> str:
        """Mode, session, or where the car got stuck."""
        state: d.LiftState = so_far.latest()
        mode = words.word(d.LiftMode, state.current_mode)
        if state.session_id not in ("", self.session):
            held = words.printable(state.session_id)
            return f"the session is {held}'s: `rmf-bridge send lift {self.name} --end` releases it"
        if state.current_mode in SHUT_OUT:
            return f"{self.name} is in mode {mode} and serves no robot until that clears"
        if not state.session_id:
            return f"{self.name} did not grant the session: its daemon's log says why"
        if state.current_mode != d.LiftMode.MODE_AGV:
            return f"granted, but the lift is in mode {mode}, not AGV: key switch, or busy?"
        if state.current_floor != self.floor:
            return f"granted, but the car has not come to {self.floor}"
        return f"the car is at {self.floor}, but its door is not seen open"


class LiftEnd(ByName):
    """The session over: `session`, or whoever's the first LiftState shows when it is ""."""

    states: Topic[Any] = topics.LIFT_STATES

    def __init__(self, name: str, session: str, *, direct: bool) -> None:
        self.name, self.session = name, session
        self.topic, self.nobody = _adapter_or_direct(
            topics.ADAPTER_LIFT_REQUESTS, topics.LIFT_REQUESTS, "lift", direct=direct
        )

    def _ending(self, so_far: SoFar) -> str:
        first: str = so_far.states[0].message.session_id if so_far.states else ""
        return self.session or first

    def request(self, so_far: SoFar) -> d.LiftRequest | None:
        """END_SESSION as fleets send it: no floor, door 0."""
        session = self._ending(so_far)
        if not session:
            return None
        return d.LiftRequest(
            lift_name=self.name,
            session_id=session,
            request_type=d.LiftRequestType.REQUEST_END_SESSION,
        )

    def outcome(self, so_far: SoFar) -> Done | None:
        """The state shows another session, or none."""
        session = self._ending(so_far)
        if so_far.states and not session:
            return Done(f"{self.name} has no session: nothing to end")
        answer = so_far.answer()
        if answer is None or answer.session_id == session:
            return None
        return Done(words.printable(f"{self.name} is no longer held by {session}"))

    def reason(self, so_far: SoFar) -> str:
        """Nothing but a supervisor that drops the request stands between."""
        return f"{self.name} still shows the session: does a supervisor drop it? try --direct"


# --- doors -------------------------------------------------------------------------------------


class DoorMove(ByName):
    """The door open, or closed.

    On the adapter topic also what the phases of a fleet adapter wait for: the supervisor's heartbeat
    lists us while we want it open, and lists us no more afterwards.
    """

    states: Topic[Any] = topics.DOOR_STATES

    def __init__(self, name: str, opened: bool, requester: str, *, direct: bool) -> None:
        self.name, self.opened, self.requester, self.direct = name, opened, requester, direct
        self.mode = d.DoorModeValue.MODE_OPEN if opened else d.DoorModeValue.MODE_CLOSED
        self.topic, self.nobody = _adapter_or_direct(
            topics.ADAPTER_DOOR_REQUESTS, topics.DOOR_REQUESTS, "door", direct=direct
        )

    def request(self, so_far: SoFar) -> d.DoorRequest:
        """OPEN or CLOSED."""
        return d.DoorRequest(
            requester_id=self.requester,
            door_name=self.name,
            requested_mode=d.DoorMode(int(self.mode)),
        )

    def outcome(self, so_far: SoFar) -> Done | None:
        """The mode, and on the adapter topic the heartbeat."""
        answer = so_far.answer()
        if answer is None or answer.current_mode.value != self.mode:
            return None
        if not self.direct and not self._listed_as_wanted(so_far):
            return None
        return Done(f"{self.name} is {'open' if self.opened else 'closed'}")

    def _listed_as_wanted(self, so_far: SoFar) -> bool:
        requesters = so_far.requesters(self.name)
        return requesters is not None and (self.requester in requesters) == self.opened

    def reason(self, so_far: SoFar) -> str:
        """By the mode that the door is in."""
        mode = so_far.latest().current_mode.value
        others = [r for r in so_far.requesters(self.name) or [] if r != self.requester]
        if mode == d.DoorModeValue.MODE_OFFLINE:
            return f"the daemon does not reach {self.name}'s controller"
        if mode == d.DoorModeValue.MODE_UNKNOWN:
            return f"{self.name}'s contacts contradict each other, or it took too long"
        if mode == self.mode:
            return f"{self.name} is there, but no heartbeat of a door supervisor agrees"
        if not self.opened and others:
            return f"{self.name} is held open by {words.printable(', '.join(others))}"
        if not self.opened:
            return f"{self.name} was released, but something keeps it open"
        return f"{self.name} did not open"


# --- chargers ----------------------------------------------------------------------------------

SERVING = (
    d.ChargerStateValue.CHARGER_ASSIGNED,
    d.ChargerStateValue.CHARGER_CHARGING,
    d.ChargerStateValue.CHARGER_RELEASED,
)


class Charge(ByName):
    """The charger assigned to a robot under our request id."""

    states: Topic[Any] = topics.CHARGER_STATES
    topic: Topic[Any] = topics.CHARGER_REQUESTS
    nobody = nobody_listens(topics.CHARGER_REQUESTS, None, "charger daemon")

    def __init__(
        self, name: str, fleet: str, robot: str, request_id: str, start_timeout_s: float
    ) -> None:
        self.name, self.request_id = name, request_id
        self._request = d.ChargerRequest(name, fleet, robot, duration(start_timeout_s), request_id)

    def request(self, so_far: SoFar) -> d.ChargerRequest:
        """The same id each time, so that a repeat is no new request."""
        return self._request

    def outcome(self, so_far: SoFar) -> Done | None:
        """A state with our id that is not ERROR."""
        answer = so_far.answer()
        if answer is None or answer.state not in SERVING:
            return None
        if answer.request_id != self.request_id:
            return None
        state = words.word(d.ChargerStateValue, answer.state)
        return Done(f"{self.name} is {state} for {self.request_id}")

    def reason(self, so_far: SoFar) -> str:
        """Error, or another's."""
        state: d.ChargerState = so_far.latest()
        if state.state == d.ChargerStateValue.CHARGER_ERROR:
            return words.printable(f"{self.name} reports: {state.error_message}")
        if state.request_id not in ("", self.request_id):
            return words.printable(
                f"{self.name} serves {state.request_id}: "
                f"`rmf-bridge send charger {self.name} --cancel {state.request_id}` frees it"
            )
        return f"{self.name} did not take the request: its daemon's log says why"


class ChargeCancel(ByName):
    """The charger no longer assigned to that request."""

    states: Topic[Any] = topics.CHARGER_STATES
    topic: Topic[Any] = topics.CHARGER_CANCELS
    nobody = nobody_listens(topics.CHARGER_CANCELS, None, "charger daemon")

    def __init__(self, name: str, request_id: str) -> None:
        self.name, self.request_id = name, request_id

    def request(self, so_far: SoFar) -> d.ChargerCancel:
        """By its id."""
        return d.ChargerCancel(self.name, self.request_id)

    def outcome(self, so_far: SoFar) -> Done | Failed | None:
        """Released, or the id gone; an id that was never there is a mistake worth an error."""
        answer = so_far.answer()
        if answer is None or self._holds(answer):
            return None
        if any(self._holds(heard.message) for heard in so_far.states):
            return Done(words.printable(f"{self.name} no longer serves {self.request_id}"))
        return Failed(
            words.printable(
                f"{self.name} does not serve {self.request_id!r} (state: {described(answer)})"
            )
        )

    def _holds(self, state: d.ChargerState) -> bool:
        released = (d.ChargerStateValue.CHARGER_IDLE, d.ChargerStateValue.CHARGER_RELEASED)
        return state.request_id == self.request_id and state.state not in released

    def reason(self, so_far: SoFar) -> str:
        """It goes on."""
        return f"{self.name} still serves {self.request_id}: its daemon's log says why"
