"""Fleet adapters. Some keep RMF's rules, and the others have one defect each."""

from collections.abc import Iterator, Sequence

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import in_seconds, stamp
from tests.workbench.judge.nodes.right_lift import RightLift
from workbench.judge.played_nodes import Step, Traveller
from workbench.rmf_model import NEVER, Party, Said
from workbench.rmf_model.phases import DoorClose, DoorOpen, EndLiftSession, RequestLift
from workbench.rmf_model.robot import RobotContext

DRIVES_S = 7.0
RESTS_S = 5.0


def journey(robot: RobotContext) -> Iterator[Step]:
    """Yield the steps of an endless journey: pass the door, ride up, pass the door, ride down."""
    yield RESTS_S
    while True:
        for here, there in (("L1", "L3"), ("L3", "L1")):
            yield DoorOpen("ward")
            yield DRIVES_S
            yield DoorClose("ward")
            yield RequestLift("Lift1", here, inside=False)
            robot.in_car = True
            yield DRIVES_S
            yield RequestLift("Lift1", there, inside=True)
            yield DRIVES_S
            robot.in_car = False
            yield EndLiftSession("Lift1")
            yield RESTS_S


class RightAdapter(Party):
    """A fleet adapter that lets its robots travel, and publishes the fleet's state at 1 Hz."""

    subscribes: Sequence[topics.AnyTopic] = RobotContext.subscribes
    fleet = "fleet"
    jazzy = False

    def __init__(self, *robots: str) -> None:
        self.robots = robots or ("red",)
        self.travellers = [
            Traveller(f"{self.fleet}/{self.called(robot)}", self.way) for robot in self.robots
        ]
        for traveller in self.travellers:
            traveller.robot.jazzy = self.jazzy
        self._told_at = 0.0

    def called(self, robot: str) -> str:
        return robot

    def way(self, robot: RobotContext) -> Iterator[Step]:
        return journey(robot)

    def hear(self, message: d.Message, now: float) -> list[Said]:
        said = [one for t in self.travellers for one in t.robot.hear(message, now)]
        return self._out(said + self._go_on(now), now)

    def tick(self, now: float) -> list[Said]:
        said = self._go_on(now)
        for traveller in self.travellers:
            if now >= traveller.robot.wake_at():
                said += traveller.robot.tick(now)
        said = self._out(said + self._go_on(now), now)
        if now < self._told_at + 1.0:
            return said
        self._told_at = now
        states = tuple(d.RobotState(name=robot, task_id="day") for robot in self.robots)
        return [*said, (topics.FLEET_STATES, d.FleetState(self.fleet, states))]

    def wake_at(self) -> float:
        return min([self._told_at + 1.0, *(t.wake_at() for t in self.travellers)], default=NEVER)

    def _go_on(self, now: float) -> list[Said]:
        return [one for t in self.travellers for one in t.go_on(now)]

    def _out(self, said: list[Said], now: float) -> list[Said]:
        return [(topic, out) for topic, one in said for out in self.says(one, now)]

    def says(self, message: d.Message, now: float) -> list[d.Message]:
        """Return the messages that replace this message. Adapters with a defect override this
        method."""
        return [message]


class JazzyAdapter(RightAdapter):
    jazzy = True


class OtherFleet(RightAdapter):
    fleet = "other"


class LateToEnd(RightLift):
    """The lift keeps a session for 12 s after the first END."""

    def __init__(self) -> None:
        super().__init__()
        self._until = NEVER

    def ended(self, end: d.LiftRequest) -> None:
        if end.session_id == self.session and self._until == NEVER:
            self._until = in_seconds(end.request_time) + 12.0

    def tick(self, now: float) -> list[Said]:
        if now > self._until:
            self._until = NEVER
            self.free()
        return super().tick(now)


# ---- adapters with a defect


def is_end(message: d.Message) -> bool:
    return isinstance(message, d.LiftRequest) and message.request_type == 0


class EndsNever(RightAdapter):
    def says(self, message: d.Message, now: float) -> list[d.Message]:
        return [] if is_end(message) else [message]


class EndsOnce(RightAdapter):
    ended = False

    def says(self, message: d.Message, now: float) -> list[d.Message]:
        again = is_end(message) and self.ended
        self.ended = is_end(message) if isinstance(message, d.LiftRequest) else self.ended
        return [] if again else [message]


class EndsForEver(RightAdapter):
    def hear(self, message: d.Message, now: float) -> list[Said]:
        said = super().hear(message, now)
        free = isinstance(message, d.LiftState) and not message.session_id
        if free and self.travellers[0].robot.destination is None:
            end = d.LiftRequest("Lift1", stamp(now), "fleet/red", 0)
            said.append((topics.ADAPTER_LIFT_REQUESTS, end))
        return said


class ChangesItsMind(RightAdapter):
    """During a ride the adapter asks once for a floor on the way. Then it asks for the robot's floor
    again."""

    other = "L2"
    rides = 0

    def says(self, message: d.Message, now: float) -> list[d.Message]:
        if isinstance(message, d.LiftRequest):
            rides = message.request_type == 1 and message.destination_floor == "L3"
            self.rides = self.rides + 1 if rides and self.travellers[0].robot.in_car else 0
            if self.rides == 3:
                return [replace(message, destination_floor=self.other)]
        return [message]


class CallsItBack(ChangesItsMind):
    """During a ride the adapter asks once for the floor where the ride began. RMF's adapter does so
    (rmf_ros2#555)."""

    other = "L1"


class TwoIds(RightAdapter):
    def called(self, robot: str) -> str:
        return f"{robot}_in_lifts"


class NeverCloses(RightAdapter):
    def way(self, robot: RobotContext) -> Iterator[Step]:
        return (step for step in journey(robot) if not isinstance(step, DoorClose))

    def says(self, message: d.Message, now: float) -> list[d.Message]:
        closes = isinstance(message, d.DoorRequest) and message.requested_mode.value == 0
        return [] if closes else [message]


class OpensAndOpens(DoorOpen):
    def hear(self, robot: RobotContext, message: d.Message, now: float) -> list[Said]:
        return []


class OpensForEver(RightAdapter):
    def way(self, robot: RobotContext) -> Iterator[Step]:
        yield OpensAndOpens("ward")


class StampsGoBack(RightAdapter):
    count = 0

    def says(self, message: d.Message, now: float) -> list[d.Message]:
        self.count += 1
        if isinstance(message, d.LiftRequest) and self.count % 5 == 0:
            return [replace(message, request_time=stamp(now - 9.0))]
        return [message]


class EntersEarly(RightAdapter):
    """The robot drives in as soon as the lift shows the robot's session. The car may be at any
    floor."""

    def way(self, robot: RobotContext) -> Iterator[Step]:
        for step in journey(robot):
            if isinstance(step, RequestLift) and not step.wanted.inside:
                yield AtSession("Lift1", step.wanted.floor, inside=False)
            else:
                yield step


class AtSession(RequestLift):
    def hear(self, robot: RobotContext, message: d.Message, now: float) -> list[Said]:
        self.done = isinstance(message, d.LiftState) and message.session_id == robot.requester_id
        return []


class AsksOnce(RightAdapter):
    last: d.Message | None = None

    def says(self, message: d.Message, now: float) -> list[d.Message]:
        if not isinstance(message, d.LiftRequest) or is_end(message):
            return [message]
        bare = replace(message, request_time=d.Time())
        again, self.last = bare == self.last, bare
        return [] if again else [message]


class DoorAskedOnce(RightAdapter):
    last = -1

    def says(self, message: d.Message, now: float) -> list[d.Message]:
        if not isinstance(message, d.DoorRequest):
            return [message]
        again, self.last = message.requested_mode.value == self.last, message.requested_mode.value
        return [] if again and self.last == 2 else [message]


class StateNumbers(RightAdapter):
    """The adapter sends the request type 2 for AGV mode. In a lift's state, the number 2 means AGV. But
    in a request, the number for AGV is 1."""

    def says(self, message: d.Message, now: float) -> list[d.Message]:
        if isinstance(message, d.LiftRequest) and message.request_type:
            return [replace(message, request_type=2)]
        return [message]


class OtherFloorNames(RightAdapter):
    def says(self, message: d.Message, now: float) -> list[d.Message]:
        if isinstance(message, d.LiftRequest) and message.request_type:
            return [replace(message, destination_floor=message.destination_floor.lower())]
        return [message]
