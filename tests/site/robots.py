"""Robots that move all day. Each has its own fleet adapter by RMF's rules (`workbench.rmf_model`).

A robot passes a door, rides a lift to another floor, and passes another door, again and again.
Sometimes it goes to a charger or rests. Sometimes RMF cancels its task during a wait. A restarted
adapter has forgotten the task, and knows only the place of its robot. So the robot first leaves that
place.
"""

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, field
from random import Random
from typing import Any, Protocol

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import duration
from bridges.transports.transport import Transport
from tests.site.charging import FLEET, Charge
from tests.site.network import Heeded
from tests.site.timeline import EPOCH, NEVER, Alarm, Timeline
from workbench.rmf_model.phases import DoorClose, DoorOpen, EndLiftSession, RequestLift
from workbench.rmf_model.robot import Phase, RobotContext

FRESH_S = 2.5
"""The age (s) above which a charger's state does not permit a robot to drive onto the pad."""
PAD_S = 2.0
"""The time (s) for the drive from the pad's edge onto the pad, or back."""
CHARGER_PATIENCE_S = 8.0
CHARGER = "a charger"
"""What a robot waits for from the begin of its charge to the end."""


@dataclass(frozen=True)
class Places:
    """The floors, lifts, doors and chargers that the robots visit, with RMF's names."""

    floors: list[str]
    lifts: list[str]
    doors: list[str]
    chargers: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Within:
    """A phase with a time limit (s). RMF cancels the phase after that time."""

    phase: Phase
    patience_s: float = NEVER


Want = Within | float
Day = Generator[Want, bool, None]
"""A generator that yields what a robot waits for next: a phase, or a number of seconds. The value sent
back tells whether the phase succeeded."""


class Ground(Protocol):
    """The true places of the robots, and the building's reactions to the robots."""

    def may_enter_lift(self, robot: "Resident", lift: str, floor: str) -> bool:
        """Return whether the robot sees an open car at this floor."""

    def boards(self, robot: "Resident", lift: str, floor: str) -> None:
        """Let the robot cross the threshold of the car inwards."""

    def leaves(self, robot: "Resident", lift: str, floor: str) -> None:
        """Let the robot cross the threshold of the car outwards."""

    def crossed(self, robot: "Resident") -> None:
        """Note that the robot has crossed the car's threshold or the doorway."""

    def is_out(self, robot: "Resident", lift: str) -> None:
        """Note that the robot is out of the car."""

    def may_enter_door(self, robot: "Resident", door: str) -> bool:
        """Return whether the robot sees an open door."""

    def in_doorway(self, robot: "Resident", door: str) -> None:
        """Let the robot stand in the doorway."""

    def may_enter_pad(self, charger: str) -> bool:
        """Return whether a robot sees that no robot stands on the pad."""

    def on_pad(self, robot: "Resident", charger: str) -> None:
        """Note the robot's arrival on the pad."""

    def off_pad(self, robot: "Resident", charger: str) -> None:
        """Note that the robot has left the pad."""

    def charged(self, charger: str) -> bool:
        """Return whether the battery on this charger is full."""


class Resident:
    """One robot. Since the time `since` it waits for `waits_for`.

    `join(name)` gives the robot's adapter a place on the graph. `pace` is the length of the robot's
    pauses relative to a real robot. `disturbed_at` is the time at which the adapter last died. After
    that time a request in the robot's name may come from a supervisor, and not from the robot. `heeds`
    gets the topics and devices whose states can change anything for the robot. With `tells` the adapter
    publishes the state of a fleet that has only its robot.
    """

    def __init__(
        self,
        timeline: Timeline,
        join: Callable[[str], Transport],
        ground: Ground,
        name: str,
        random: Random,
        places: Places,
        pace: float = 1.0,
        jazzy: bool = False,
        charge: Charge | None = None,
        tells: bool = True,
    ) -> None:
        self.name = name
        self.floor = random.choice(places.floors)
        self.alive = False
        self.homing = False
        self.waits_for = ""
        self.since = 0.0
        self.disturbed_at = -NEVER
        self.skew = random.uniform(-3.0, 3.0)
        self.done = {"doors": 0, "rides": 0, "charges": 0, "cancelled": 0}
        self.in_car: tuple[str, str, str] | None = None
        self.doorway = ""
        self.pad = ""
        self.robot: RobotContext
        self.heeds: Callable[[frozenset[Heeded]], None] = lambda heeded: None
        self._timeline = timeline
        self._join = join
        self._ground = ground
        self._random = random
        self._places = places
        self._pace = pace
        self._jazzy = jazzy
        self._task = charge
        self._tells = tells
        self._beat = Alarm(timeline, self._tell)
        self._alarm = Alarm(timeline, self._tick)
        self._until = NEVER
        self._awaits: Phase | None = None
        self._day: Day
        self._place: Transport
        self._publishers: dict[str, Any] = {}
        self._stations: dict[str, tuple[float, d.ChargerState]] = {}
        self._request = 0

    # ---- the adapter

    def start(self) -> None:
        """Start a new fleet adapter, which knows only the place of its robot."""
        self.alive = True
        self.robot = RobotContext(self.name, self._jazzy)
        self.robot.in_car = self.in_car is not None
        self._place = self._join(self.name)
        published = (
            topics.ADAPTER_LIFT_REQUESTS,
            topics.ADAPTER_DOOR_REQUESTS,
            topics.CHARGER_REQUESTS,
            topics.CHARGER_CANCELS,
            topics.FLEET_STATES,
        )
        self._publishers = {t.name: self._place.publisher(t) for t in published}
        heard = (*self.robot.subscribes, topics.CHARGER_STATES, topics.CHARGING_ASSIGNMENTS)
        for topic in heard:
            self._place.subscribe(topic, self._hear)
        self._tell()
        self._begin_day()

    def kill(self) -> None:
        """Kill the adapter. The robot stays at its place."""
        self.alive = False
        self.disturbed_at = self._timeline.now
        self._alarm.set(NEVER)
        self._beat.set(NEVER)
        self._until, self._awaits, self.waits_for = NEVER, None, ""
        self._place.close()
        self._day.close()

    def goes_out(self) -> None:
        """Begin a new shift, at the place of the rest."""
        self.homing = False
        self._begin_day()

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without the day, which has ended when the robot is saved at rest."""
        return {key: value for key, value in vars(self).items() if key != "_day"}

    @property
    def at_rest(self) -> bool:
        """Return whether the robot has nothing more to do."""
        return self.homing and not (self.waits_for or self.in_car or self.doorway or self.pad)

    @property
    def _wall(self) -> float:
        return EPOCH + self._timeline.now + self.skew

    def _hear(self, message: Any) -> None:
        if isinstance(message, d.ChargerState):
            self._stations[message.charger_name] = (self._timeline.now, message)
            return
        if isinstance(message, d.ChargingAssignments):
            if self._task:
                self._task.hear(message)
            return
        self._say(self.robot.hear(message, self._wall))
        self._look()

    def reported(self) -> d.RobotState | None:
        """Return the robot's state for the fleet's state; None if no coordinator needs it."""
        return self._task.state() if self._task else None

    def _tell(self) -> None:
        """Publish the fleet's state, each second. This adapter knows only its own robot."""
        robot = self.reported()
        if robot and self._tells and self.alive:
            self._say([(topics.FLEET_STATES, d.FleetState(FLEET, (robot,)))])
            self._beat.set(self._timeline.now + 1.0)

    def _tick(self) -> None:
        if self._wall >= self.robot.wake_at() - 1e-6:
            self._say(self.robot.tick(self._wall + 1e-6))
        self._look()

    def _look(self) -> None:
        """Go on with the day if the event for which the robot waits has come."""
        if self._awaits is not None and self._awaits.done:
            self._go_on(True)
        elif self._timeline.now >= self._until:
            self._go_on(False)
        else:
            self._set_alarm()

    def _begin_day(self) -> None:
        self._day = self._live()
        self._go_on(True, first=True)

    def _go_on(self, done: bool, first: bool = False) -> None:
        """Begin the next item of the day."""
        if self._awaits is not None and not done:
            self.robot.phase = None
            self.done["cancelled"] += 1
        want = next(self._day) if first else self._day.send(done)
        now = self._timeline.now
        if isinstance(want, Within):
            self._awaits, self._until = want.phase, now + want.patience_s
            self.waits_for, self.since = _words(want.phase), now
            self._say(self.robot.begin(want.phase, self._wall))
        else:
            self._awaits, self._until = None, now + want
        self._look() if self._awaits is not None and self._awaits.done else self._set_alarm()

    def _set_alarm(self) -> None:
        wake_at = self.robot.wake_at() - EPOCH - self.skew
        self._alarm.set(min(self._until, wake_at))
        self.heeds(frozenset(self._heeded()))

    def _heeded(self) -> Iterator[Heeded]:
        """Yield the topics and devices whose states can change anything for the robot. Jazzy's adapter
        repeats its request at each state of every lift."""
        robot, phase = self.robot, self.robot.phase
        if isinstance(phase, DoorOpen):
            yield topics.DOOR_STATES.name, phase.door
        if robot.destination is not None:
            yield topics.LIFT_STATES.name, "" if self._jazzy else robot.destination.lift
        if isinstance(phase, EndLiftSession):
            yield topics.LIFT_STATES.name, phase.lift
        if self.waits_for == CHARGER:
            yield topics.CHARGER_STATES.name, ""

    def _say(self, said: Any) -> None:
        for topic, message in said:
            self._publishers[topic.name].publish(message)

    # ---- the day

    def _live(self) -> Day:
        yield from self._get_clear()
        while not self.homing:
            self.robot.on_task = True
            yield from self._through_door(self._random.choice(self._places.doors))
            yield from self._ride()
            yield from self._through_door(self._random.choice(self._places.doors))
            if self._places.chargers and self._random.random() < 0.3:
                yield from self._charge_as_told() if self._task else self._charge()
            self.robot.on_task = False
            yield self._pause(1.0, 30.0)
        self.waits_for = ""
        while True:
            yield 60.0

    def _pause(self, least_s: float, most_s: float) -> float:
        """Return the duration of a drive or a rest (s)."""
        self.waits_for = ""
        return self._pace * self._random.uniform(least_s, most_s)

    def _patience(self) -> float:
        """Return the time limit of a phase (s). A short limit is rare, and makes RMF cancel the
        task."""
        return self._random.uniform(0.5, 20.0) if self._random.random() < 0.04 else NEVER

    def _get_clear(self) -> Day:
        """Leave the place where the adapter's death has left the robot."""
        if self.doorway:
            yield self._pause(1.0, 5.0)
            self.doorway = ""
            self._ground.crossed(self)
        if self.pad:
            yield from self._off_pad()
        if self._task:
            self._task.ends()
        if self.in_car:
            lift, _, target = self.in_car
            # Half of the time wait, so that RMF may see and end our session.
            if self._random.random() < 0.5:
                yield self._pause(1.0, 4.0)
            yield from self._ride_on(lift, target)
        yield self._pause(0.1, 3.0)

    def _through_door(self, door: str) -> Day:
        opened = yield Within(DoorOpen(door), self._patience())
        if opened:
            while not self._ground.may_enter_door(self, door):
                yield 0.5
            self.doorway = door
            self._ground.in_doorway(self, door)
            yield self._pause(3.0, 12.0)
            self.doorway = ""
            self._ground.crossed(self)
            self.done["doors"] += 1
        yield Within(DoorClose(door))
        yield self._pause(2.0, 10.0)

    def _ride(self) -> Day:
        lift = self._random.choice(self._places.lifts)
        target = self._random.choice([f for f in self._places.floors if f != self.floor])
        came = yield Within(RequestLift(lift, self.floor, inside=False), self._patience())
        if not came:
            return  # begin a new task; the adapter ends the lift's session later
        while not self._ground.may_enter_lift(self, lift, self.floor):
            yield 0.5
        self.in_car = (lift, self.floor, target)
        self._ground.boards(self, lift, self.floor)
        yield self._pause(3.0, 7.0)
        self.robot.in_car = True
        self._ground.crossed(self)
        yield from self._ride_on(lift, target)

    def _ride_on(self, lift: str, target: str) -> Day:
        yield Within(RequestLift(lift, target, inside=True))
        while not self._ground.may_enter_lift(self, lift, target):
            yield 0.5
        self.in_car = (lift, target, target)
        self._ground.leaves(self, lift, target)
        yield self._pause(3.0, 7.0)
        self.robot.in_car, self.in_car, self.floor = False, None, target
        self._ground.crossed(self)
        self._ground.is_out(self, lift)
        yield Within(EndLiftSession(lift))
        self.done["rides"] += 1
        yield self._pause(2.0, 10.0)

    # ---- charging by RMF's own task, with our coordinator

    def _charge_as_told(self) -> Day:
        """Drive to the dedicated place until the robot has charged. The dedicated place may change
        meanwhile."""
        assert self._task is not None
        self.waits_for, self.since = CHARGER, self._timeline.now
        self._task.begins()
        while not self.homing:
            where = self._task.dedicated
            yield self._random.uniform(4.0, 12.0)  # the drive to the station
            if where in self._places.chargers:
                if self._is_kept(where) and (yield from self._charge_on(where)):
                    break
            else:
                self._task.place = where
            while self._task.dedicated == where and not (self._is_kept(where) or self.homing):
                yield 1.0
            self._task.place = ""
        self._task.ends()

    def _is_kept(self, charger: str) -> bool:
        """Return whether the station is assigned to this robot."""
        state = self._station(charger)
        assigned = state is not None and state.state == d.ChargerStateValue.CHARGER_ASSIGNED
        return assigned and state is not None and f"fleet/{state.robot_name}" == self.name

    def _charge_on(self, charger: str) -> Generator[Want, bool, bool]:
        """Charge until the battery is full, or until a random time limit has passed. Return True if
        current has flowed."""
        assert self._task is not None
        yield PAD_S
        if not self._is_kept(charger):
            return False
        self.pad = self._task.place = charger
        self._ground.on_pad(self, charger)
        leave_at, flowed = self._timeline.now + self._random.uniform(15.0, 60.0), False
        while self._timeline.now < leave_at and not self._ground.charged(charger):
            state = self._station(charger)
            flowed |= state is not None and state.state == d.ChargerStateValue.CHARGER_CHARGING
            yield 0.5
        if flowed:
            self._task.battery = 100.0
            yield self._random.uniform(1.0, 10.0)
        yield from self._off_pad()
        self._task.place = ""
        self.done["charges"] += flowed
        return flowed

    # ---- charging without a coordinator: the robot sends its requests, because RMF sends none

    def _charge(self) -> Day:
        """Try the stations until a station grants the request. Drive there, charge, and leave."""
        self.waits_for, self.since = CHARGER, self._timeline.now
        while not self.homing:
            for charger in self._random.sample(self._places.chargers, len(self._places.chargers)):
                state = self._station(charger)
                blindly = self._random.random() < 0.5
                if not blindly and (
                    state is None or state.state != d.ChargerStateValue.CHARGER_IDLE
                ):
                    continue
                request_id = self._new_request()
                if (yield from self._is_assigned(charger, request_id)):
                    yield self._random.uniform(4.0, 12.0)  # the drive to the station
                    if (yield from self._charge_at(charger, request_id)):
                        return
                yield from self._cancel(charger, request_id)
            yield 1.0

    def _is_assigned(self, charger: str, request_id: str) -> Generator[Want, bool, bool]:
        give_up_at = self._timeline.now + CHARGER_PATIENCE_S
        while self._timeline.now < give_up_at:
            fleet, robot = self.name.split("/")
            wish = d.ChargerRequest(charger, fleet, robot, duration(60), request_id)
            self._say([(topics.CHARGER_REQUESTS, wish)])
            yield 1.0
            if self._is_ours(charger, request_id):
                return True
        return False

    def _charge_at(self, charger: str, request_id: str) -> Generator[Want, bool, bool]:
        """Charge on the pad while the station shows our request. Return True if current has flowed.

        Without a coordinator only the robot itself can see that a robot with a dead adapter stands on
        the pad: these stations cannot tell, and show IDLE after a full charge.
        """
        if not self._is_ours(charger, request_id) or not self._ground.may_enter_pad(charger):
            return False
        yield PAD_S
        self.pad = charger
        self._ground.on_pad(self, charger)
        leave_at = self._timeline.now + self._random.uniform(15.0, 60.0)
        flowed = False
        while self._timeline.now < leave_at and not self._ground.charged(charger):
            state = self._station(charger)
            flowed |= state is not None and state.state == d.ChargerStateValue.CHARGER_CHARGING
            yield 0.5
        yield from self._off_pad()
        self.done["charges"] += flowed
        return flowed

    def _off_pad(self) -> Day:
        yield PAD_S
        charger, self.pad = self.pad, ""
        self._ground.off_pad(self, charger)

    def _cancel(self, charger: str, request_id: str) -> Day:
        """Repeat the cancel message until the station no longer shows the request."""
        for _ in range(5):
            self._say([(topics.CHARGER_CANCELS, d.ChargerCancel(charger, request_id))])
            yield 1.0
            state = self._station(charger)
            if state is not None and state.request_id != request_id:
                return

    def _is_ours(self, charger: str, request_id: str) -> bool:
        state = self._station(charger)
        assigned = state is not None and state.state == d.ChargerStateValue.CHARGER_ASSIGNED
        return assigned and state is not None and state.request_id == request_id

    def _station(self, charger: str) -> d.ChargerState | None:
        """Return the station's latest state, or None if the state is too old."""
        at, state = self._stations.get(charger, (-NEVER, None))
        return state if self._timeline.now - at <= FRESH_S else None

    def _new_request(self) -> str:
        self._request += 1
        return f"{self.name}/{self._request}"


def _words(phase: Phase) -> str:
    """Return in words what a phase waits for."""
    match phase:
        case RequestLift():
            inside = " from inside" if phase.wanted.inside else ""
            return f"{phase.wanted.lift} at {phase.wanted.floor}{inside}"
        case EndLiftSession():
            return f"{phase.lift} to be released"
        case DoorOpen():
            return f"{phase.door} open"
        case DoorClose():
            return f"{phase.door} let go"
    return type(phase).__name__
