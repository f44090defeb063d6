"""RMF's side of the demo on a real graph: both supervisors, a fleet adapter, and what was heard.

Requests take RMF's whole way: the fleet adapter publishes on the adapter topics, the supervisor
hears that from the wire and publishes on the node's topic.
"""

import time
from collections.abc import Callable, Iterable
from queue import Empty, SimpleQueue
from typing import Any

from bridges.rmf import definitions as d
from bridges.rmf import topics
from bridges.rmf.topics import Topic
from bridges.rmf.transport import Publisher, Transport
from hal_fakes.demo.daemons import Wrong
from hal_fakes.demo.journal import SETTLES_S, Journal
from hal_fakes.plants.plant import Edge
from hal_fakes.rmf import Party, Said
from hal_fakes.rmf.robot import Phase, Robot
from hal_fakes.rmf.supervisors import DoorSupervisor, LiftSupervisor

PUBLISHED = (
    topics.ADAPTER_LIFT_REQUESTS,
    topics.LIFT_REQUESTS,
    topics.ADAPTER_DOOR_REQUESTS,
    topics.DOOR_REQUESTS,
    topics.DOOR_SUPERVISOR_HEARTBEAT,
    topics.CHARGER_REQUESTS,
)
STATES = (topics.LIFT_STATES, topics.DOOR_STATES, topics.CHARGER_STATES)
TO_NODES = (topics.LIFT_REQUESTS, topics.DOOR_REQUESTS, topics.CHARGER_REQUESTS)
LOOK_EVERY_S = 0.1


class World:
    """One inbox for messages and edges; the day waits in `until`, and meanwhile RMF works."""

    def __init__(
        self, transport: Transport, journal: Journal, robot: Robot, check: Callable[[], None]
    ) -> None:
        """`check` is called all the time, and raises when there is no point in going on."""
        self.journal = journal
        self.robot = robot
        self._parties: list[Party] = [LiftSupervisor(), DoorSupervisor(), robot]
        self._check = check
        self._inbox: SimpleQueue[tuple[float, Topic[Any] | None, Any]] = SimpleQueue()
        self._publishers: dict[str, Publisher[Any]] = {
            topic.name: transport.publisher(topic) for topic in PUBLISHED
        }
        heard = {topic.name: topic for party in self._parties for topic in party.subscribes}
        for topic in {**heard, **{topic.name: topic for topic in STATES}}.values():
            transport.subscribe(topic, self._to_inbox(topic))

    def edge(self, edge: Edge) -> None:
        """A plant's edge; from any thread."""
        self._inbox.put((edge.at, None, edge))

    def nodes_listen(self) -> bool:
        """A node has matched each topic on which we send requests."""
        return all(self._publishers[topic.name].matched() for topic in TO_NODES)

    # ---- what the day calls

    def begin(self, phase: Phase, text: str) -> None:
        """The robot's fleet adapter starts a phase."""
        self.note(text)
        self._say(self.robot.begin(phase, time.time()))

    def say(self, said: Said) -> None:
        """Publish one message."""
        self._say([said])

    def note(self, text: str) -> None:
        """One line about the robot."""
        self.journal.note("robot", text, time.monotonic(), self.robot.requester_id)

    def until(
        self, ready: Callable[[], bool], within_s: float, what: str, repeat: Said | None = None
    ) -> None:
        """Go on until `ready`. `repeat` is published now and every second meanwhile.

        Raises Wrong, with `what`, when it takes longer than `within_s`.
        """
        deadline = time.monotonic() + within_s
        repeat_at = time.monotonic() if repeat else float("inf")
        while not ready():
            if time.monotonic() >= deadline:
                raise Wrong(f"waited {within_s:g} s for {what}")
            if repeat and time.monotonic() >= repeat_at:
                repeat_at += 1.0
                self._say([repeat])
            self._turn(LOOK_EVERY_S)

    def pause(self, seconds: float) -> None:
        """So much time goes by."""
        over_at = time.monotonic() + seconds
        while (left_s := over_at - time.monotonic()) > 0:
            self._turn(min(LOOK_EVERY_S, left_s))

    # ---- inside

    def _turn(self, timeout_s: float) -> None:
        self._check()
        if self.robot.wake_at() <= time.time():
            self._say(self.robot.tick(time.time()))
        try:
            at, topic, what = self._inbox.get(timeout=timeout_s)
        except Empty:
            pass
        else:
            self._take(at, topic, what)
        self.journal.flush(time.monotonic() - SETTLES_S)

    def _take(self, at: float, topic: Topic[Any] | None, what: Any) -> None:
        if topic is None:
            self.journal.edge(what)
            return
        if topic in STATES:
            self.journal.state(what, at)
        for party in self._parties:
            if topic in party.subscribes:
                self._say(party.hear(what, time.time()))

    def _say(self, said: Iterable[Said]) -> None:
        for topic, message in said:
            if topic in TO_NODES and not isinstance(message, d.SupervisorHeartbeat):
                self.journal.request(message, time.monotonic())  # type: ignore[arg-type]
            self._publishers[topic.name].publish(message)

    def _to_inbox(self, topic: Topic[Any]) -> Callable[[Any], None]:
        def put(message: Any) -> None:
            self._inbox.put((time.monotonic(), topic, message))

        return put
