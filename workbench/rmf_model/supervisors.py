"""The rules of rmf_lift_supervisor and rmf_door_supervisor.

Source: rmf_ros2 9dedd0f, rmf_fleet_adapter/src/lift_supervisor/Node.cpp and door_supervisor/Node.cpp.
Both supervisors forget everything in a restart. With `jazzy`, the lift supervisor follows Jazzy's where
it differs (branch jazzy, 7eef65a).
"""

from collections.abc import Sequence
from typing import Final

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import stamp
from workbench.rmf_model import Party, Said, door_request


class LiftSupervisor(Party):
    """The node rmf_lift_supervisor. For each lift, it remembers the holder's last request.

    The supervisor repeats this request until the lift's state matches it. Jazzy's supervisor repeats
    the request after every state, even a matching one.

    If a lift has a session, but the supervisor remembers no request, the supervisor sends END. Jazzy's
    supervisor sends END even if the lift has no session.
    """

    subscribes: Sequence[topics.AnyTopic] = (topics.ADAPTER_LIFT_REQUESTS, topics.LIFT_STATES)

    def __init__(self, jazzy: bool = False) -> None:
        self.slots: dict[str, d.LiftRequest] = {}
        self._jazzy = jazzy

    def hear(self, message: d.Message, now: float) -> list[Said]:
        """Take a message. Remember and forward an adapter's request, or drop it silently if another
        session holds the lift. After a state, repeat the holder's request."""
        match message:
            case d.LiftRequest():
                return self._requested(message, now)
            case d.LiftState():
                return self._stated(message, now)
        return []

    def _requested(self, request: d.LiftRequest, now: float) -> list[Said]:
        held = self.slots.get(request.lift_name)
        ends = request.request_type == d.LiftRequestType.REQUEST_END_SESSION
        if held is not None and held.session_id != request.session_id:
            return []
        if ends and held is None and not self._jazzy:
            return []
        if held is not None or not self._jazzy:
            request = replace(request, request_time=stamp(now))
        if ends:
            self.slots.pop(request.lift_name, None)
        else:
            self.slots[request.lift_name] = request
        return [(topics.LIFT_REQUESTS, request)]

    def _stated(self, state: d.LiftState, now: float) -> list[Said]:
        held = self.slots.get(state.lift_name)
        if held is not None:
            if not self._jazzy and _satisfies(state, held):
                return []
            held = self.slots[state.lift_name] = replace(held, request_time=stamp(now))
            return [(topics.LIFT_REQUESTS, held)]
        if not state.session_id and not self._jazzy:
            return []
        end = d.LiftRequest(
            lift_name=state.lift_name,
            request_time=stamp(now),
            session_id=state.session_id,
            request_type=d.LiftRequestType.REQUEST_END_SESSION,
            destination_floor=state.current_floor,
        )
        return [(topics.LIFT_REQUESTS, end)]


def _satisfies(state: d.LiftState, held: d.LiftRequest) -> bool:
    wanted = held.destination_floor
    there = wanted == state.current_floor and not state.destination_floor
    return (
        (wanted == state.destination_floor or there)
        and held.door_state == state.door_state
        and held.session_id == state.session_id
    )


class DoorSupervisor(Party):
    """The node rmf_door_supervisor. It remembers each door's sessions, and the time of each session's
    newest open request.

    The supervisor publishes a heartbeat only when an adapter has sent a request.
    """

    subscribes: Sequence[topics.AnyTopic] = (topics.ADAPTER_DOOR_REQUESTS, topics.DOOR_STATES)
    REQUESTER_ID: Final = "door_supervisor"

    def __init__(self) -> None:
        self.sessions: dict[str, dict[str, d.Time]] = {}

    def hear(self, message: d.Message, now: float) -> list[Said]:
        """Take a message. A request of an adapter begins or ends a session. After a state that does not
        fit the sessions, repeat the order to the door."""
        match message:
            case d.DoorRequest(requested_mode=d.DoorMode(d.DoorModeValue.MODE_OPEN)):
                return self._opened(message, now)
            case d.DoorRequest(requested_mode=d.DoorMode(d.DoorModeValue.MODE_CLOSED)):
                return self._closed(message, now)
            case d.DoorState():
                return self._stated(message, now)
        return []

    def _opened(self, request: d.DoorRequest, now: float) -> list[Said]:
        wants = self.sessions.setdefault(request.door_name, {})
        before = wants.get(request.requester_id, request.request_time)
        wants[request.requester_id] = max(before, request.request_time, key=_when)
        return [
            self._ask(request.door_name, d.DoorModeValue.MODE_OPEN, now),
            self._heartbeat(),
        ]

    def _closed(self, request: d.DoorRequest, now: float) -> list[Said]:
        wants = self.sessions.get(request.door_name, {})
        since = wants.get(request.requester_id)
        if since is None or _when(request.request_time) < _when(since):
            return [self._heartbeat()]
        del wants[request.requester_id]
        if wants:
            return [self._heartbeat()]
        return [
            self._ask(request.door_name, d.DoorModeValue.MODE_CLOSED, now),
            self._heartbeat(),
        ]

    def _stated(self, state: d.DoorState, now: float) -> list[Said]:
        wanted_open = bool(self.sessions.get(state.door_name))
        mode = state.current_mode.value
        moving = mode == d.DoorModeValue.MODE_MOVING
        if wanted_open and (moving or mode == d.DoorModeValue.MODE_CLOSED):
            return [self._ask(state.door_name, d.DoorModeValue.MODE_OPEN, now)]
        if not wanted_open and (moving or mode == d.DoorModeValue.MODE_OPEN):
            return [self._ask(state.door_name, d.DoorModeValue.MODE_CLOSED, now)]
        return []

    def _ask(self, door: str, mode: d.DoorModeValue, now: float) -> Said:
        request = door_request(door, self.REQUESTER_ID, mode, now)
        return topics.DOOR_REQUESTS, request

    def _heartbeat(self) -> Said:
        doors = tuple(
            d.DoorSessions(door, tuple(d.Session(at, who) for who, at in sorted(wants.items())))
            for door, wants in sorted(self.sessions.items())
        )
        return topics.DOOR_SUPERVISOR_HEARTBEAT, d.SupervisorHeartbeat(doors)


def _when(time: d.Time) -> tuple[int, int]:
    return time.sec, time.nanosec
