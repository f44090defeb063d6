"""The same robots in real time, on DDS. Each fleet adapter and each daemon is a node of its own.

Each daemon is a process that a test can kill. The test reads the edges of relays and doors from the
plants' control sockets. It checks that the lift and the door stay open for each robot that RMF has told
to enter.
"""

import signal
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from queue import Empty, SimpleQueue
from random import Random
from typing import Any

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.topics import Topic
from bridges.transports.transport import Publisher, Subscription
from hal_fakes import wire
from hal_fakes.demo.daemons import DaemonProcess, stop_all
from hal_fakes.plants.plant import Edge
from tests.site.robots import Places, Resident
from tests.site.timeline import EPOCH, Timeline

CONFIG = Path(__file__).parents[2] / "config"
FILES = {
    "lift": CONFIG / "lift_dry_contact.yaml",
    "door": CONFIG / "door_modbus.yaml",
    "lift supervisor": CONFIG / "lift_supervisor.yaml",
    "door supervisor": CONFIG / "door_supervisor.yaml",
}
LIFT, DOOR = "Lift1", "ward_door"
PLACES = Places(["L1", "L2"], [LIFT], [DOOR])
PACE = 0.05
PATIENCE_S = 240.0
"""The longest permitted wait (s), even on a busy machine after the death of a daemon."""


class RealTime(Timeline):
    """A timeline that follows the clock, and takes events from other threads."""

    def __init__(self) -> None:
        super().__init__()
        self._began = time.monotonic()
        self._posted: SimpleQueue[Callable[[], None]] = SimpleQueue()

    def post(self, what: Callable[[], None]) -> None:
        """Run this in the timeline now. Any thread may call this method."""
        self._posted.put(what)

    def until(self, done: Callable[[], bool], check: Callable[[], None]) -> None:
        """Let time pass until `done` is true. `check` raises an error if further waiting is useless."""
        while not done():
            self.run(time.monotonic() - self._began)
            check()
            try:
                what = self._posted.get(timeout=0.02)
            except Empty:
                continue
            self.now = max(self.now, time.monotonic() - self._began)
            what()


class DdsPlace:
    """A node on DDS. Its messages arrive at the times of the timeline."""

    speaks = "dds"

    def __init__(self, timeline: RealTime, domain: int, name: str) -> None:
        self.name = name
        self.domain_id = domain
        self.dropped: dict[str, int] = {}
        self._timeline = timeline
        self._closed = False
        self._inner = wire.join(name.replace("/", "_"), domain)
        self.release = self._inner.release

    def publisher(self, topic: Topic[Any]) -> Publisher[Any]:
        return self._inner.publisher(topic)

    def subscribe(
        self, topic: Topic[Any], received: Callable[[Any], None], *, others_only: bool = False
    ) -> Subscription:
        def post(message: Any) -> None:
            self._timeline.post(partial(self._arrive, received, message))

        return self._inner.subscribe(topic, post, others_only=others_only)

    def sender(self) -> None:
        """Return None. When the timeline delivers a message, the transport no longer knows who sent
        it."""

    @property
    def lives(self) -> bool:
        return self._inner.lives

    def faults(self) -> list[tuple[str, str]]:
        return self._inner.faults()

    def wall(self) -> float:
        return self._inner.wall()

    def close(self) -> None:
        self._closed = True
        self._inner.close()

    def _arrive(self, received: Callable[[Any], None], message: Any) -> None:
        if not self._closed:
            received(message)


class RealSite:
    """A lift, a door, both supervisors, and robots that compete for lift and door. The class has the
    methods of `robots.Ground`."""

    def __init__(self, directory: Path, domain: int, names: tuple[str, ...]) -> None:
        self.timeline = RealTime()
        self.opinions = 0
        self.sessions: list[str] = [""]
        self._directory = directory
        self._domain = domain
        self._started = 0
        self._inside: set[str] = set()
        self._across: dict[str, str] = {}
        self._edges: dict[tuple[str, str], bool] = {}
        self.daemons: dict[str, DaemonProcess] = {}
        self.observer = DdsPlace(self.timeline, domain, "observer")
        self.observer.subscribe(topics.LIFT_STATES, self._lift_state)
        self.voices = self.observer.subscribe(topics.LIFT_REQUESTS, lambda message: None)
        for party in FILES:
            self.start(party)
        self.robots = [self._robot(f"fleet/{name}") for name in names]

    def start(self, party: str) -> None:
        """Start a daemon, in place of a killed one."""
        self._started += 1
        directory = self._directory / str(self._started)
        directory.mkdir()
        self.daemons[party] = daemon = DaemonProcess(FILES[party], directory, self._domain)
        if party in ("lift", "door"):
            daemon.follow(lambda edge: self.timeline.post(partial(self._edge, edge)))

    def restart(self, party: str, how: signal.Signals) -> None:
        """Kill a daemon with this signal, and start another. SIGKILL permits the daemon no last
        message."""
        daemon = self.daemons.pop(party)
        if party in ("lift", "door"):
            device = LIFT if party == "lift" else DOOR
            self._across = {r: where for r, where in self._across.items() if where != device}
            self._edges = {key: on for key, on in self._edges.items() if key[0] != device}
        if how == signal.SIGTERM:
            daemon.ask_to_stop()
        daemon.end(time.monotonic() + (10.0 if how == signal.SIGTERM else 0.0))
        self.start(party)

    def restart_adapter(self, robot: Resident) -> None:
        """Start a new fleet adapter for this robot. The robot stays at its place."""
        robot.kill()
        self._across.pop(robot.name, None)
        self._inside.discard(robot.name)
        robot.start()

    def check(self) -> None:
        """Raise an error unless all daemons are alive and each robot's wait is short enough."""
        for daemon in self.daemons.values():
            daemon.check()
        for robot in self.robots:
            waited_s = self.timeline.now - robot.since
            assert not robot.waits_for or waited_s < PATIENCE_S, f"{robot.name}: {robot.waits_for}"

    def until(self, done: Callable[[], bool]) -> None:
        """Let all parties go on until the condition holds."""
        self.timeline.until(done, self.check)

    def done(self, what: str) -> int:
        """Return how often the robots have done this, all together."""
        return sum(robot.done[what] for robot in self.robots)

    def driven(self) -> list[tuple[str, str]]:
        """Return (device, relay) of each output that is on at the terminal blocks."""
        return [key for key, on in self._edges.items() if on and key[1] in RELAYS]

    def close(self) -> None:
        """Stop all robots and daemons, also after a failure."""
        for robot in self.robots:
            if robot.alive:
                robot.kill()
        self.observer.close()
        stop_all(self.daemons.values())

    def _robot(self, name: str) -> Resident:
        def join(name: str) -> DdsPlace:
            robot.skew = time.time() - EPOCH - self.timeline.now
            return DdsPlace(self.timeline, self._domain, name)

        robot = Resident(self.timeline, join, self, name, Random(name), PLACES, PACE)
        return robot

    # ---- the laws

    def _lift_state(self, state: d.LiftState) -> None:
        before = self.sessions[-1]
        if state.session_id != before:
            handed = before and state.session_id
            assert not handed, f"the lift went from {before} to {state.session_id}"
            self.sessions.append(state.session_id)

    def _edge(self, edge: Edge) -> None:
        self._edges[edge.device, edge.signal] = bool(edge.value)
        lets_go = edge.signal in ("door_open", "hold_open") and not edge.value
        across = [robot for robot, where in self._across.items() if where == edge.device]
        assert not (lets_go and across), f"{edge.device} lets its door go with {across} in it"

    # ---- the places of the robots

    def may_enter_lift(self, robot: Resident, lift: str, floor: str) -> bool:
        return self._edges.get((lift, "door"), False)

    def boards(self, robot: Resident, lift: str, floor: str) -> None:
        assert not self._inside - {robot.name}, f"{robot.name} meets {self._inside} in the car"
        self._inside.add(robot.name)
        self._across[robot.name] = lift

    def leaves(self, robot: Resident, lift: str, floor: str) -> None:
        self._across[robot.name] = lift

    def crossed(self, robot: Resident) -> None:
        self._across.pop(robot.name, None)

    def is_out(self, robot: Resident, lift: str) -> None:
        self._inside.discard(robot.name)

    def may_enter_door(self, robot: Resident, door: str) -> bool:
        return self._edges.get((door, "opened"), False)

    def in_doorway(self, robot: Resident, door: str) -> None:
        self._across[robot.name] = door

    def may_enter_pad(self, charger: str) -> bool:
        return True

    def on_pad(self, robot: Resident, charger: str) -> None:
        """Do nothing: this site has no charger."""

    def off_pad(self, robot: Resident, charger: str) -> None:
        """Do nothing: this site has no charger."""

    def charged(self, charger: str) -> bool:
        return True


RELAYS = {"hold_open", "door_open", "agv_mode_request", *(f"call_L{n}" for n in range(1, 5))}
