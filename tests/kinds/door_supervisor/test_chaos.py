"""Robots at one door in bad conditions. Messages are lost, late, doubled or reordered. The supervisor,
the door's daemon and the fleet adapters are killed and restarted.

The supervisor must send no CLOSE while a robot is inside that it has let in. It must not flood the
network. After the network has recovered, every robot must get through, and the door must close behind
the last robot.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from random import Random
from typing import Any

import pytest

from bridges.messages import topics
from tests.depth import depth
from tests.kinds.door_supervisor.world import DoorDaemon, OurSupervisor, Walker, holds
from tests.runtime.virtual_graph import Disk, World, in_order

ROBOTS = ("fleet/a", "fleet/b", "other/c")
STORM_S = 120.0
CALM_S = 60.0

Fate = Callable[[Random], Sequence[float]]


def lossy(random: Random) -> Sequence[float]:
    return () if random.random() < 0.3 else (0.0,)


def late(random: Random) -> Sequence[float]:
    copies = random.choice((0, 1, 1, 1, 2, 3))
    return tuple(random.choice((0.0, 0.1, 0.5, 2.0)) * random.random() for _ in range(copies))


class Storm:
    """One door, robots and our supervisor in bad conditions. The test watches each message of our
    supervisor.

    `wrong` has each CLOSE that was sent while a robot was inside.
    """

    def __init__(self, seed: int, fate: Fate, disk: Disk | None = None) -> None:
        self.random = Random(seed)
        fates = Random(seed)
        self.world = World(lambda sender, receiver: fate(fates))
        self.world.watch = self._watch
        self.disk = disk or Disk()
        self.door = DoorDaemon(self.world)
        self.walkers: dict[str, Walker] = {}
        self.ours = OurSupervisor(self.world, self.disk)
        for who in ROBOTS:
            plan = self._plan(Random(f"{seed} {who}"))
            self.walkers[who] = Walker(self.world, who, plan, skew=self.random.uniform(-99, 99))
        self.let_in: set[str] = set()
        self.misled: list[tuple[float, str]] = []
        self._seen: set[Any] = set()
        self.wrong: list[tuple[float, tuple[str, ...]]] = []

    def rages(self) -> None:
        """Restart the supervisor, the door's daemon or a fleet adapter every 2 s to 15 s, until
        STORM_S."""
        while self.world.now < STORM_S:
            self.run(self.world.now + self.random.uniform(2.0, 15.0))
            match self.random.choice(("supervisor", "supervisor", "door", *ROBOTS)):
                case "supervisor":
                    self.ours.leave()
                    self.run(self.world.now + self.random.choice((0.0, 1.0, 6.0)))
                    self.ours.restart()
                case "door":
                    self.door.restart()
                case who:
                    self.let_in.discard(who)
                    self.walkers[who].restart()

    def calms(self) -> None:
        self.world.route = in_order
        self.run(self.world.now + CALM_S)

    def run(self, until: float) -> None:
        """Let time pass in steps of 1/16 s, until the time `until`."""
        while self.world.now < until:
            self.world.run(min(until, self.world.now + 0.0625))

    def _plan(self, random: Random) -> Any:
        while self.world.now < STORM_S + CALM_S / 2:
            yield random.uniform(1.0, 10.0), random.uniform(0.5, 20.0)

    def _watch(self, who: str, topic: Any, message: Any) -> None:
        self._look()
        if who != "supervisor" or topic != topics.DOOR_REQUESTS:
            return
        if message.requested_mode.value == 0 and self.let_in:
            self.wrong.append((self.world.now, tuple(self.let_in)))

    def _look(self) -> None:
        """Update the set of the robots that our supervisor has let in.

        If a robot goes in although our supervisor's table has no entry for it, an old heartbeat has
        misled the robot.
        """
        for who, walker in self.walkers.items():
            if not walker.passing:
                self.let_in.discard(who)
            elif who not in self.let_in and (walker.log[-1], who) not in self._seen:
                self._seen.add((walker.log[-1], who))
                if holds(self.disk, who):
                    self.let_in.add(who)
                else:
                    self.misled.append((self.world.now, who))


def rates(storm: Storm, topic: Any) -> list[float]:
    """Return the times (s) between our supervisor's messages on this topic, also across restarts."""
    at = [when for when, who, said, _ in storm.world.sent if (who, said) == ("supervisor", topic)]
    return [b - a for a, b in pairwise(at)]


@pytest.mark.parametrize("fate", [lossy, late])
@pytest.mark.parametrize("seed", range(depth(6, 12)))
def test_no_door_closes_on_a_robot_and_no_robot_waits_for_ever(seed: int, fate: Fate) -> None:
    storm = Storm(seed, fate)
    storm.rages()
    before = {who: walker.visits for who, walker in storm.walkers.items()}
    storm.calms()
    assert storm.wrong == []
    if fate is lossy:
        assert storm.misled == []
    assert all(walker.visits > before[who] for who, walker in storm.walkers.items())
    storm.run(storm.world.now + 30.0)
    assert not holds(storm.disk, ROBOTS[0])
    assert storm.door.door.told[-1][1] == "CLOSED"
    assert min(rates(storm, topics.DOOR_REQUESTS)) >= 0.0999
    assert min(rates(storm, topics.DOOR_SUPERVISOR_HEARTBEAT)) >= 0.0999
    span = storm.world.now
    assert len(rates(storm, topics.DOOR_REQUESTS)) <= 2 * span
    assert len(rates(storm, topics.DOOR_SUPERVISOR_HEARTBEAT)) <= 5 * span
    assert storm.disk.written <= 4 * sum(w.visits + 5 for w in storm.walkers.values())


class Forgetful(Disk):
    """A disk that keeps no table. So a restart loses the table, as in RMF's own supervisor."""

    def read(self) -> bytes | None:
        return None


def test_the_test_notices_a_close_on_a_robot() -> None:
    """Prove that this test works. A supervisor that loses its table at a restart sends CLOSE to a door
    with a robot inside. The test must notice that CLOSE."""
    wrong = 0
    for seed in range(4):
        storm = Storm(seed, lossy, Forgetful())
        storm.rages()
        wrong += len(storm.wrong)
    assert wrong > 0
