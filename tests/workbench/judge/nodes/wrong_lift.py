"""Nodes of lifts with one defect each that the field knows: its docstring says which."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from tests.workbench.judge.nodes.right_lift import LOOP_S, RightLift
from workbench.rmf_model import Said


class AnyEndEnds(RightLift):
    """END_SESSION of anybody releases the lift (low_level_lift)."""

    def ended(self, end: d.LiftRequest) -> None:
        self.free()


class EndNeedsAFloor(RightLift):
    """END_SESSION is refused when its floor is not served, as "" never is (lift_adapter_template)."""

    def ended(self, end: d.LiftRequest) -> None:
        if end.destination_floor in self.floors:
            super().ended(end)


class FireBoards(RightLift):
    """The door opens for the robot outside, in a fire as well."""

    def moves(self, age_s: float) -> None:
        super().moves(age_s)
        if self.session and self.door < 1.0:
            self.mode = 3
            self.door = min(1.0, self.door + 0.5)


class FireFrees(RightLift):
    """In a fire the session is cleared, though only END frees the supervisor's slot."""

    def moves(self, age_s: float) -> None:
        if self.mode == 2 and self.door == 1.0:
            self.mode = 3
            self.free()
        super().moves(age_s)


class FireGrants(RightLift):
    """Requests are obeyed during a fire (low_level_lift)."""

    def __init__(self) -> None:
        super().__init__()
        self.mode = 3

    def serves(self, request: d.LiftRequest) -> bool:
        return True


ALARM = replace(topics.FIRE_ALARM_TRIGGER, publish=topics.VOLATILE)


class FireIsVolatile(RightLift):
    """The fire alarm is told once, and volatile: no fleet adapter hears it (low_level_lift)."""

    told = False

    def tick(self, now: float) -> list[Said]:
        said = super().tick(now)
        if self.told:
            return said
        self.told = True
        return [*said, (ALARM, d.Bool(True))]


class FireSaysFalse(RightLift):
    """The fire alarm is told each second, as `false` while there is none (low_level_lift)."""

    def tick(self, now: float) -> list[Said]:
        said = super().tick(now)
        return [*said, (topics.FIRE_ALARM_TRIGGER, d.Bool(False))] if said else said


class FloorByLastCharacter(RightLift):
    """The floor's number is its name's last character: L10 is the floor below L1."""

    floors = ("L9", "L10", "L11")

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, current_floor=f"L{state.current_floor[-1]}")


class FloorFlickers(RightLift):
    """The floor's code is sampled unfiltered: for a moment it is another floor."""

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        told = self._told
        wrong = told is not None and told.door_state == 2 and told.current_floor == "L1"
        return replace(state, current_floor="L2") if self.door == 1.0 and wrong else state


class GoesToTheDefaultFloor(RightLift):
    """A floor that it does not serve is taken for the first one."""

    def requested(self, request: d.LiftRequest) -> None:
        known = request.destination_floor in self.floors
        floor = request.destination_floor if known else self.floors[0]
        super().requested(replace(request, destination_floor=floor))


class HearsAdapters(RightLift):
    """It hears adapter_lift_requests, around the supervisor."""

    subscribes = (topics.ADAPTER_LIFT_REQUESTS,)


class LastOneWins(RightLift):
    """Who asks last gets the lift, whoever is in the car."""

    def requested(self, request: d.LiftRequest) -> None:
        self.free()
        super().requested(request)


class LiftAnswers(RightLift):
    """A state for each request, as most templates' callbacks publish it."""

    def hear(self, message: d.Message, now: float) -> list[Said]:
        super().hear(message, now)
        mine = isinstance(message, d.LiftRequest) and message.lift_name == self.name
        return [(topics.LIFT_STATES, self.state(now))] if mine else []


class LiftBlocks(RightLift):
    """The callback waits for the car: no state comes meanwhile (low_level_lift, up to 60 s)."""

    floor_s = 4.0

    def tick(self, now: float) -> list[Said]:
        said = super().tick(now)
        rides = bool(self.target) and self.floors.index(self.target) != self.car
        return [] if rides else said


class LiftFlaps(RightLift):
    """The door's contact is not debounced: OPEN flickers while the robot drives in."""

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        flickers = int(now / LOOP_S) % 3 == 0
        return replace(state, door_state=1) if self.door == 1.0 and flickers else state


class LiftModeMixed(RightLift):
    """The state's mode has the request's numbers: AGV is 1 there, and HUMAN here."""

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, current_mode={2: 1, 1: 2}[state.current_mode])


class LiftNumbersMixed(RightLift):
    """A request's numbers typed anew: END 1, AGV 2, HUMAN 3 (QuikSync). AGV ends, END is nothing."""

    def hear(self, message: d.Message, now: float) -> list[Said]:
        if isinstance(message, d.LiftRequest) and message.lift_name == self.name:
            if message.request_type == 1:
                self.ended(message)
            elif message.request_type == 2:
                self.requested(message)
        return []


class LiftStaleOpen(RightLift):
    """The controller is lost while the door is open; what was read last is said for ever."""

    read: d.LiftState | None = None

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        if self.read is None and self.door == 1.0:
            self.read = state
        last = self.read or state
        return replace(last, session_id=state.session_id, destination_floor=state.destination_floor)


class LiftVendorCodes(RightLift):
    """The door's status word of the vendor, as it came: 3 is locked."""

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, door_state=3) if state.door_state == 0 else state


class LiftWithoutStamps(RightLift):
    """lift_time is never filled."""

    def state(self, now: float) -> d.LiftState:
        return replace(super().state(now), lift_time=d.Time())


class OpenNowhere(RightLift):
    """OPEN with no floor: the floor's code is not read yet."""

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        first = self.door == 1.0 and self._told is not None and self._told.door_state != 2
        return replace(state, current_floor="") if first else state


class OpenWhileMoving(RightLift):
    """OPEN is a contact that is passed on the way."""

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, door_state=2) if state.motion_state else state


class OtherLiftsRequest(RightLift):
    """The name is looked at when it is too late (sharp-rmf/low_level_lift)."""

    def hear(self, message: d.Message, now: float) -> list[Said]:
        if isinstance(message, d.LiftRequest):
            super().hear(replace(message, lift_name=self.name), now)
        return []


class OwnSessionName(RightLift):
    """session_id is the vendor's booking number, not the requester's."""

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, session_id="booking-4711") if state.session_id else state


class SessionTimesOut(RightLift):
    """A watchdog frees the lift after 5 s with an open door, without an END."""

    opened = 0

    def moves(self, age_s: float) -> None:
        super().moves(age_s)
        self.opened = self.opened + 1 if self.door == 1.0 else 0
        if self.opened * LOOP_S > 2.0:
            self.free()


class ShowsWhatItWasAsked(RightLift):
    """destination_floor is whatever was asked, served or not."""

    asked = ""

    def requested(self, request: d.LiftRequest) -> None:
        self.asked = request.destination_floor
        self.session = self.session or request.session_id
        super().requested(request)

    def state(self, now: float) -> d.LiftState:
        return replace(super().state(now), destination_floor=self.asked)


class LiftOnlyOnChange(RightLift):
    """A state comes only when something has changed."""

    period_s = 1e6


class LeavesWithoutSession(RightLift):
    """The session is over for the node when the car leaves for the robot's floor."""

    def moves(self, age_s: float) -> None:
        super().moves(age_s)
        if self.car != int(self.car):
            self.session = ""


class LiftReadsDoorOnce(RightLift):
    """The door's module is lost while the door is open. The stamp is the time of publishing, and the
    floor is read on."""

    read = 0

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        self.read = max(self.read, state.door_state)
        return replace(state, door_state=self.read)


class LiftListsOtherFloors(RightLift):
    """available_floors has the controller's numbers, current_floor the map's names."""

    def serves(self, request: d.LiftRequest) -> bool:
        return True

    def state(self, now: float) -> d.LiftState:
        return replace(super().state(now), available_floors=("1", "2", "3"))


class HearsBothTopics(RightLift):
    """It hears the supervisor and, around it, the fleet adapters."""

    subscribes = (topics.LIFT_REQUESTS, topics.ADAPTER_LIFT_REQUESTS)
