"""Lift nodes, each with one defect that occurred in the field. Each docstring names the defect, and
some name in brackets the project in which it occurred."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from tests.workbench.judge.nodes.right_lift import LOOP_S, RightLift
from workbench.rmf_model import Said


class AnyEndEnds(RightLift):
    """The lift accepts END_SESSION from any requester, and releases the session (low_level_lift)."""

    def ended(self, end: d.LiftRequest) -> None:
        self.free()


class EndNeedsAFloor(RightLift):
    """The lift refuses an END_SESSION for a floor that it does not serve. The empty floor "" is such a
    floor (lift_adapter_template)."""

    def ended(self, end: d.LiftRequest) -> None:
        if end.destination_floor in self.floors:
            super().ended(end)


class FireBoards(RightLift):
    """The door opens for a robot outside the car, even during a fire."""

    def moves(self, age_s: float) -> None:
        super().moves(age_s)
        if self.session and self.door < 1.0:
            self.mode = 3
            self.door = min(1.0, self.door + 0.5)


class FireFrees(RightLift):
    """During a fire, the lift clears the session. But the supervisor goes on asking for the robot,
    because the supervisor forgets a robot only after END."""

    def moves(self, age_s: float) -> None:
        if self.mode == 2 and self.door == 1.0:
            self.mode = 3
            self.free()
        super().moves(age_s)


class FireGrants(RightLift):
    """The lift obeys requests during a fire (low_level_lift)."""

    def __init__(self) -> None:
        super().__init__()
        self.mode = 3

    def serves(self, request: d.LiftRequest) -> bool:
        return True


ALARM = replace(topics.FIRE_ALARM_TRIGGER, publish=topics.VOLATILE)


class FireIsVolatile(RightLift):
    """The lift publishes the fire alarm once, as a volatile sample. So no fleet adapter gets the alarm
    (low_level_lift)."""

    told = False

    def tick(self, now: float) -> list[Said]:
        said = super().tick(now)
        if self.told:
            return said
        self.told = True
        return [*said, (ALARM, d.Bool(True))]


class FireSaysFalse(RightLift):
    """Without a fire the lift publishes `false` on the fire alarm each second (low_level_lift)."""

    def tick(self, now: float) -> list[Said]:
        said = super().tick(now)
        return [*said, (topics.FIRE_ALARM_TRIGGER, d.Bool(False))] if said else said


class FloorByLastCharacter(RightLift):
    """The lift takes the last character of a floor's name as the floor's number. So L10 is below L1."""

    floors = ("L9", "L10", "L11")

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, current_floor=f"L{state.current_floor[-1]}")


class FloorFlickers(RightLift):
    """The lift does not filter the floor code. So another floor appears for a moment."""

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        told = self._told
        wrong = told is not None and told.door_state == 2 and told.current_floor == "L1"
        return replace(state, current_floor="L2") if self.door == 1.0 and wrong else state


class GoesToTheDefaultFloor(RightLift):
    """The lift drives to its first floor, if the lift does not serve the requested floor."""

    def requested(self, request: d.LiftRequest) -> None:
        known = request.destination_floor in self.floors
        floor = request.destination_floor if known else self.floors[0]
        super().requested(replace(request, destination_floor=floor))


class HearsAdapters(RightLift):
    """The lift obeys adapter_lift_requests. These requests bypass the supervisor."""

    subscribes = (topics.ADAPTER_LIFT_REQUESTS,)


class LastOneWins(RightLift):
    """The latest request gets the lift, even if another robot is in the car."""

    def requested(self, request: d.LiftRequest) -> None:
        self.free()
        super().requested(request)


class LiftAnswers(RightLift):
    """The lift publishes a state for each request. Most templates (public examples of lift adapters) do
    this in the callback that receives requests."""

    def hear(self, message: d.Message, now: float) -> list[Said]:
        super().hear(message, now)
        mine = isinstance(message, d.LiftRequest) and message.lift_name == self.name
        return [(topics.LIFT_STATES, self.state(now))] if mine else []


class LiftBlocks(RightLift):
    """The node's callback waits for the car. So no state comes for up to 60 s (low_level_lift)."""

    floor_s = 4.0

    def tick(self, now: float) -> list[Said]:
        said = super().tick(now)
        rides = bool(self.target) and self.floors.index(self.target) != self.car
        return [] if rides else said


class LiftFlaps(RightLift):
    """The door's contact is not debounced. So OPEN flickers while the robot drives in."""

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        flickers = int(now / LOOP_S) % 3 == 0
        return replace(state, door_state=1) if self.door == 1.0 and flickers else state


class LiftModeMixed(RightLift):
    """The lift's state shows AGV mode with the number 1, which is AGV's number in a request. In a
    state, the number 1 means HUMAN."""

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, current_mode={2: 1, 1: 2}[state.current_mode])


class LiftNumbersMixed(RightLift):
    """The maker gave the request types new numbers: END 1, AGV 2, HUMAN 3 (QuikSync). So AGV ends a
    session, and END does nothing."""

    def hear(self, message: d.Message, now: float) -> list[Said]:
        if isinstance(message, d.LiftRequest) and message.lift_name == self.name:
            if message.request_type == 1:
                self.ended(message)
            elif message.request_type == 2:
                self.requested(message)
        return []


class LiftStaleOpen(RightLift):
    """The controller fails while the door is open, and the lift publishes its last reading for ever."""

    read: d.LiftState | None = None

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        if self.read is None and self.door == 1.0:
            self.read = state
        last = self.read or state
        return replace(last, session_id=state.session_id, destination_floor=state.destination_floor)


class LiftVendorCodes(RightLift):
    """The lift publishes 3 (locked) in place of a closed door. 3 is the vendor's own code."""

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, door_state=3) if state.door_state == 0 else state


class LiftWithoutStamps(RightLift):
    """The lift never fills lift_time."""

    def state(self, now: float) -> d.LiftState:
        return replace(super().state(now), lift_time=d.Time())


class OpenNowhere(RightLift):
    """The lift shows OPEN without a floor, because it reads the floor code later than the door."""

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        first = self.door == 1.0 and self._told is not None and self._told.door_state != 2
        return replace(state, current_floor="") if first else state


class OpenWhileMoving(RightLift):
    """The lift shows OPEN while the car moves, because the car passes a contact on its way."""

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, door_state=2) if state.motion_state else state


class OtherLiftsRequest(RightLift):
    """The lift obeys a request before it compares the lift's name in the request. So the lift obeys
    requests for other lifts (sharp-rmf/low_level_lift)."""

    def hear(self, message: d.Message, now: float) -> list[Said]:
        if isinstance(message, d.LiftRequest):
            super().hear(replace(message, lift_name=self.name), now)
        return []


class OwnSessionName(RightLift):
    """The lift puts the vendor's booking number into session_id, in place of the requester's id."""

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, session_id="booking-4711") if state.session_id else state


class SessionTimesOut(RightLift):
    """A watchdog frees the lift when the door has been open for 2 s, although no END has come."""

    opened = 0

    def moves(self, age_s: float) -> None:
        super().moves(age_s)
        self.opened = self.opened + 1 if self.door == 1.0 else 0
        if self.opened * LOOP_S > 2.0:
            self.free()


class ShowsWhatItWasAsked(RightLift):
    """The lift repeats the requested floor in destination_floor, even a floor that the lift does not
    serve."""

    asked = ""

    def requested(self, request: d.LiftRequest) -> None:
        self.asked = request.destination_floor
        self.session = self.session or request.session_id
        super().requested(request)

    def state(self, now: float) -> d.LiftState:
        return replace(super().state(now), destination_floor=self.asked)


class LiftOnlyOnChange(RightLift):
    """The lift publishes only when its state has changed."""

    period_s = 1e6


class LeavesWithoutSession(RightLift):
    """The lift ends the session when the car leaves for the robot's floor."""

    def moves(self, age_s: float) -> None:
        super().moves(age_s)
        if self.car != int(self.car):
            self.session = ""


class LiftReadsDoorOnce(RightLift):
    """The door's module fails while the door is open, so the lift shows OPEN for ever. The lift still
    reads its floor, and stamps each state with the time of publishing."""

    read = 0

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        self.read = max(self.read, state.door_state)
        return replace(state, door_state=self.read)


class LiftListsOtherFloors(RightLift):
    """The lift lists the controller's numbers in available_floors. But current_floor has the map's
    names."""

    def serves(self, request: d.LiftRequest) -> bool:
        return True

    def state(self, now: float) -> d.LiftState:
        return replace(super().state(now), available_floors=("1", "2", "3"))


class HearsBothTopics(RightLift):
    """The lift obeys the supervisor and also the fleet adapters, whose requests bypass the
    supervisor."""

    subscribes = (topics.LIFT_REQUESTS, topics.ADAPTER_LIFT_REQUESTS)
