"""A lift's real node, with stand-ins for RMF's supervisor and RMF's fleet adapters."""

from collections.abc import Callable, Sequence

from bridges.kinds.lift.messages import OWN_REQUESTS
from bridges.messages.definitions import LiftRequest, LiftState, Message
from bridges.messages.topics import ADAPTER_LIFT_REQUESTS, LIFT_REQUESTS, LIFT_STATES, AnyTopic
from tests.kinds.lift.story import WALL, Story
from workbench.rmf_model import Party, Said
from workbench.rmf_model.phases import EndLiftSession, RequestLift
from workbench.rmf_model.robot import RobotContext
from workbench.rmf_model.supervisors import LiftSupervisor

STEP_S = 0.25

REPLAYED = 100
"""The number of old requests that a transient-local publisher sends to a new subscriber."""


class World:
    """The lift's node, and stand-ins for RMF's supervisor and RMF's fleet adapters.

    - `fate` gives the delays (s) with which a LiftRequest reaches the node. With an empty list the
      request is lost, and with two delays it arrives twice.
    - `hears` decides whether the supervisor and the adapters get a LiftState.
    - `adapters_first` says that the adapters get each state before the supervisor gets it.

    By default all messages arrive at once and in order.
    """

    def __init__(self, story: Story, *robots: RobotContext, adapters_first: bool = False) -> None:
        self.story = story
        self.robots = list(robots)
        self.supervisor = LiftSupervisor()
        self.adapters_first = adapters_first
        self.fate: Callable[[LiftRequest], Sequence[float]] = lambda request: (0.0,)
        self.hears: Callable[[LiftState], bool] = lambda state: True
        self.requested: list[LiftRequest] = []
        self._history: dict[str, list[LiftRequest]] = {}
        self._flying: list[tuple[float, LiftRequest]] = []
        story.hear = self._hear

    def run(self, until: float) -> None:
        """Let time pass until the time `until`, and deliver delayed requests."""
        while self.story.now < until:
            self.story.run(min(until, self.story.now + STEP_S))
            arrived = [r for at, r in self._flying if at <= self.story.now]
            self._flying = [(at, r) for at, r in self._flying if at > self.story.now]
            if arrived:
                self.story.request(*arrived)

    def asks(self, robot: RobotContext, floor: str, *, inside: bool = False) -> None:
        """Let a robot's task begin RMF's phase RequestLift."""
        self._say(robot.begin(RequestLift("Lift1", floor, inside=inside), self._now))

    def releases(self, robot: RobotContext) -> None:
        """Let a robot that has left the car begin RMF's phase EndLiftSession."""
        self._say(robot.begin(EndLiftSession("Lift1"), self._now))

    def rides(self, robot: RobotContext, start: str, end: str) -> None:
        """Play a whole ride of one robot, from its request to the release of the lift."""
        self.asks(robot, start)
        self.until_done(robot)
        robot.in_car = True
        self.run(self.story.now + 5.0)
        self.asks(robot, end, inside=True)
        self.until_done(robot)
        self.run(self.story.now + 5.0)
        robot.in_car = False
        self.releases(robot)
        self.until_done(robot)

    def until_done(self, robot: RobotContext, within: float = 60.0) -> None:
        """Run until the robot's phase is complete."""
        end = self.story.now + within
        while not robot.done:
            assert self.story.now < end, f"not within {within} s: {self.story.state}"
            self.run(self.story.now + STEP_S)

    def restart_supervisor(self, first: RobotContext | None = None) -> None:
        """Start a new supervisor, which gets the adapters' retained requests.

        The retained requests of `first` arrive before the requests of the other adapters.
        """
        self.supervisor = LiftSupervisor()
        who = first.requester_id if first else ""
        for _, history in sorted(self._history.items(), key=lambda item: item[0] != who):
            for request in history[-REPLAYED:]:
                self._deliver(self.supervisor.hear(request, self._now))
        self._arrive()

    def finds_again(self, robot: RobotContext, apart_s: float = 0.02) -> None:
        """End the isolation of this robot's adapter. The supervisor then gets the adapter's retained
        requests."""
        for request in self.asked_by(robot):
            self._deliver(self.supervisor.hear(request, self._now))
            self._arrive()
            self.run(self.story.now + apart_s)

    def asked_by(self, robot: RobotContext) -> list[LiftRequest]:
        """Return the requests that the robot's adapter retains for late subscribers."""
        return self._history[robot.requester_id][-REPLAYED:]

    def restart_adapter(self, robot: RobotContext) -> RobotContext:
        """Start a new fleet adapter for the same robot. The new adapter has no task, and does not use a
        lift."""
        fresh = RobotContext(robot.requester_id)
        fresh.on_task = False
        self.robots[self.robots.index(robot)] = fresh
        self._history.pop(robot.requester_id, None)
        return fresh

    @property
    def _now(self) -> float:
        return WALL + self.story.now

    @property
    def _parties(self) -> list[Party]:
        supervisor: list[Party] = [self.supervisor]
        robots: list[Party] = [*self.robots]
        return robots + supervisor if self.adapters_first else supervisor + robots

    def _hear(self, state: LiftState) -> None:
        if self.hears(state):
            self._deliver([(LIFT_STATES, state)])

    def _say(self, said: list[Said]) -> None:
        self._deliver(said)
        self._arrive()

    def _arrive(self) -> None:
        arrived, self.story.incoming = self.story.incoming, []
        self.story.receive(*arrived)

    def _deliver(self, said: list[Said]) -> None:
        left = list(said)
        while left:
            topic, message = left.pop(0)
            self._to_node(topic, message)
            for party in self._parties:
                if topic in party.subscribes:
                    left += party.hear(message, self._now)

    def _to_node(self, topic: AnyTopic, message: Message) -> None:
        if not isinstance(message, LiftRequest):
            return
        if topic == ADAPTER_LIFT_REQUESTS:
            self._history.setdefault(message.session_id, []).append(message)
            self.story.incoming.append((OWN_REQUESTS, message))
        elif topic == LIFT_REQUESTS:
            self.requested.append(message)
            for delay_s in self.fate(message):
                if delay_s:
                    self._flying.append((self.story.now + delay_s, message))
                else:
                    self.story.incoming.append((LIFT_REQUESTS, message))
