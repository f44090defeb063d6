"""A lift, robots that ride it, and a lift supervisor, in virtual time.

The supervisor is our supervisor as in its daemon, or a stand-in for RMF's supervisor. The lift's node
is our `Node` as in its daemon, with a simulated lift. The fleet adapters follow RMF's rules.
"""

from typing import Any

from bridges.kinds.lift import KIND as LIFT
from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.lift_supervisor import KIND as SUPERVISOR
from bridges.kinds.lift_supervisor.settings import LiftSupervisorSettings
from bridges.messages.definitions import Message
from bridges.messages.topics import LIFT_REQUESTS, LIFT_STATES, Topic
from bridges.runtime.clock import Clock
from bridges.runtime.device import Node
from tests.accepted import accepted
from tests.kinds.lift.story import Controller
from tests.kinds.lift_supervisor.alone import words
from tests.runtime.virtual_graph import EPOCH, NEVER, Served, StandIn, World, say
from workbench.rmf_model.phases import EndLiftSession, RequestLift
from workbench.rmf_model.robot import Phase, RobotContext
from workbench.rmf_model.supervisors import LiftSupervisor

FLOORS = ["L1", "L2", "L3"]


def requests(world: World) -> list[tuple[float, str]]:
    """Return the messages to the lift's node as (s, words)."""
    return [(at, words(message)) for at, _, message in world.said_on(LIFT_REQUESTS)]


def sessions(world: World) -> list[tuple[float, str]]:
    """Return the sessions that the lift has shown: (s, session) for each change."""
    shown = [(0.0, "")]
    for at, _, state in world.said_on(LIFT_STATES):
        if state.session_id != shown[-1][1]:
            shown.append((at, state.session_id))
    return shown[1:]


class OurSupervisor(Served):
    """The supervisor of this repository."""

    def __init__(
        self,
        world: World,
        settings: LiftSupervisorSettings | None = None,
        name: str = "supervisor",
        wall_skew: float = 0.0,
    ) -> None:
        super().__init__(world, SUPERVISOR, settings or LiftSupervisorSettings(), name, wall_skew)


class RmfsSupervisor(StandIn):
    """A stand-in for RMF's own supervisor."""

    def __init__(self, world: World) -> None:
        super().__init__(world, LiftSupervisor, "rmf_supervisor", LIFT_REQUESTS)


class LiftNode:
    """Our lift's node, which scans a simulated lift."""

    SCAN_S = 0.25

    def __init__(self, world: World, name: str = "Lift1") -> None:
        self.name = name
        self.world = world
        self.lift = Controller(FLOORS)
        self.settings = LiftSettings(floors=FLOORS)
        world.add(self, LIFT_REQUESTS)
        self.restart()

    def restart(self) -> None:
        """Start a new daemon. Its outputs are off, and it remembers nothing."""
        clock = Clock(lambda: self.world.now, lambda: EPOCH + self.world.now)
        limits = LIFT.limits(self.settings, {})
        self.lift.advance(self.world.now)
        self.lift.make_safe()
        self.node = Node(self.name, LIFT, self.settings, limits, self.lift, self._say, clock)
        self._scan_at = self.world.now
        self.wake()

    def _say(self, topic: Topic[Any], message: Message) -> None:
        self.world.send(self.name, topic, message)

    def hear(self, topic: Topic[Any], message: Any) -> None:
        if message.lift_name == self.name:
            self._scan(*accepted(self.node, LIFT, self.settings, (topic, message)))

    def wake_at(self) -> float:
        return self._scan_at

    def wake(self) -> None:
        self._scan()

    def _scan(self, *events: Any) -> None:
        self.lift.advance(self.world.now)
        self.node.scan(events)
        next_at = min(self.node.wake_at, self.world.now + self.SCAN_S)
        self._scan_at = max(next_at, self.world.now + 0.001)


class Rider:
    """A robot with its fleet adapter. The robot makes its trips one after the other.

    `skew` is the time (s) by which the adapter's clock is ahead of ours. `rode` has (s, trip) for each
    complete ride.
    """

    ENTER_S = 3.0
    REST_S = 3.0

    def __init__(
        self,
        world: World,
        name: str,
        *trips: tuple[str, str],
        starts_at: float = 5.0,
        skew: float = 0.0,
    ) -> None:
        self.name = name
        self.world = world
        self.skew = skew
        self.trips = list(trips)
        self.rode: list[tuple[float, tuple[str, str]]] = []
        self.robot = RobotContext(name)
        self._step = 0
        self._next_at = starts_at
        world.add(self, LIFT_STATES)

    @property
    def done(self) -> bool:
        return not self.trips

    def restart(self) -> None:
        """Start a new fleet adapter for the robot. The robot begins its present trip again."""
        self.world.retained.pop(self.name, None)
        self.robot = RobotContext(self.name)
        self._step = 0
        self._next_at = NEVER if self.done else self.world.now + 2.0

    def die(self) -> None:
        """Kill the adapter. It sends nothing more, and its retained messages are gone."""
        self.world.retained.pop(self.name, None)
        self.world.hearers[LIFT_STATES.name].discard(self.name)
        self._next_at = NEVER

    def hear(self, topic: Topic[Any], message: Any) -> None:
        running = not self.robot.done
        say(self.world, self.name, self.robot.hear(message, self._clock))
        if running and self.robot.done:
            self._step += 1
            self._next_at = self.world.now + self.ENTER_S

    def wake_at(self) -> float:
        return self._next_at

    def wake(self) -> None:
        self._next_at = NEVER
        if self._step == 3:
            self.rode.append((round(self.world.now, 3), self.trips.pop(0)))
            self._step = 0
            self._next_at = NEVER if self.done else self.world.now + self.REST_S
            return
        self.robot.in_car = self._step == 1
        say(self.world, self.name, self.robot.begin(self._phase(), self._clock))

    @property
    def _clock(self) -> float:
        return EPOCH + self.world.now + self.skew

    def _phase(self) -> Phase:
        pickup, target = self.trips[0]
        return [
            RequestLift("Lift1", pickup, inside=False),
            RequestLift("Lift1", target, inside=True),
            EndLiftSession("Lift1"),
        ][self._step]
