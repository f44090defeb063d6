"""A corridor in virtual time: a door with its daemon's core, RMF's robots, and a door supervisor.

The supervisor is our supervisor as in its daemon, or a stand-in for RMF's supervisor.
"""

from collections.abc import Iterable
from typing import Any

from bridges.kinds.door import messages as door_messages
from bridges.kinds.door_supervisor import KIND, keep
from bridges.kinds.door_supervisor.settings import DoorSupervisorSettings
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import stamp
from tests.kinds.door.virtual import SCAN_S, Door
from tests.runtime.virtual_graph import EPOCH, NEVER, Disk, Served, StandIn, World, say
from workbench.rmf_model.phases import DoorClose, DoorOpen
from workbench.rmf_model.robot import Phase, RobotContext
from workbench.rmf_model.supervisors import DoorSupervisor

WARD = "ward"


def holds(disk: Disk, who: str) -> bool:
    """Return whether the table on this disk has this requester as a holder of the door."""
    found = keep.restore(disk.kept, DoorSupervisorSettings(), 0.0) if disk.kept else {}
    return WARD in found and found[WARD].holder(who) is not None


class OurSupervisor(Served):
    """The supervisor of this repository, with its state directory `disk`."""

    disk: Disk

    def __init__(self, world: World, disk: Disk | None = None, **changes: Any) -> None:
        super().__init__(
            world, KIND, DoorSupervisorSettings(**changes), "supervisor", disk=disk or Disk()
        )


class RmfsSupervisor(StandIn):
    """A stand-in for RMF's own supervisor."""

    def __init__(self, world: World) -> None:
        super().__init__(world, DoorSupervisor, "rmf_supervisor", topics.DOOR_REQUESTS)


def to_door(world: World) -> list[tuple[float, str, str]]:
    """Return every message on door_requests as (s, sender, OPEN or CLOSED)."""
    return [
        (at, who, d.DoorModeValue(request.requested_mode.value).name[5:])
        for at, who, request in world.said_on(topics.DOOR_REQUESTS)
    ]


class DoorDaemon:
    """A door's daemon, which scans the door and obeys door_requests.

    The daemon publishes the door's state each second and at each change.
    """

    def __init__(self, world: World, name: str = WARD, **changes: Any) -> None:
        self.name = name
        self.world = world
        self.door = Door(**changes)
        self.door.now = world.now
        self._told: d.DoorModeValue | None = None
        self._told_at = -NEVER
        world.add(self, topics.DOOR_REQUESTS)

    def hear(self, topic: topics.Topic[Any], message: Any) -> None:
        """Let the daemon hear a request. The daemon ignores requests for other doors."""
        if message.door_name == self.name:
            self.door.now = self.world.now
            self.door.scan(door_messages.accept(message, self.door.settings))
            self._tell()

    def wake(self) -> None:
        """Scan once."""
        self.door.now = self.world.now
        self.door.scan()
        self._tell()

    def wake_at(self) -> float:
        """Return the time of the next scan."""
        return min(self.door.now + SCAN_S, self.door.wake_at)

    def restart(self) -> None:
        """Restart the daemon. Its outputs are off, and it remembers nothing."""
        self.door.now = self.world.now
        self.door.restart()

    def _tell(self) -> None:
        mode, now = self.door.report.mode, self.world.now
        if mode == self._told and now < self._told_at + 1.0:
            return
        self._told, self._told_at = mode, now
        state = d.DoorState(stamp(EPOCH + now), self.name, d.DoorMode(int(mode)))
        self.world.send(self.name, topics.DOOR_STATES, state)


class Walker:
    """A fleet adapter and its robot, which goes through the door again and again.

    - `log` has (s, event).
    - `passing` says that the robot may go through the door, and its adapter has not sent CLOSE yet.
    - `skew` is the time (s) by which the adapter's clock is ahead.
    """

    def __init__(
        self, world: World, name: str, plan: Iterable[tuple[float, float]], skew: float = 0.0
    ) -> None:
        self.name = name
        self.world = world
        self.skew = EPOCH + skew
        self.robot = RobotContext(name)
        self.passing = False
        self.visits = 0
        self.log: list[tuple[float, str]] = []
        self._plan = iter(plan)
        self._stay_s = 0.0
        self._next_at = 0.0
        self._plan_next()
        world.add(self, *RobotContext.subscribes)

    def hear(self, topic: topics.Topic[Any], message: Any) -> None:
        """Let the robot's adapter react to a message by RMF's rules. Then begin the robot's next step
        if it is due."""
        say(self.world, self.name, self.robot.hear(message, self.world.now + self.skew))
        self._go_on()

    def wake(self) -> None:
        """Run the robot's timers. Then begin the robot's next step if that step is due."""
        if self.world.now >= self.robot.wake_at() - self.skew:
            say(self.world, self.name, self.robot.tick(self.world.now + self.skew))
        self._go_on()

    def wake_at(self) -> float:
        """Return the time (s) at which the adapter repeats its request, or at which the robot's next
        step is due."""
        return min(self.robot.wake_at() - self.skew, self._next_at)

    def restart(self) -> None:
        """Restart the fleet adapter, which forgets the door."""
        self.robot, self.passing = RobotContext(self.name), False
        self._note("restarted")
        self._plan_next()

    def _plan_next(self) -> None:
        rest_s, self._stay_s = next(self._plan, (NEVER, 0.0))
        self._next_at = self.world.now + rest_s

    def _go_on(self) -> None:
        phase, now = self.robot.phase, self.world.now
        if phase is not None and not phase.done:
            return
        if isinstance(phase, DoorOpen) and not self.passing:
            self.passing, self._next_at = True, now + self._stay_s
            self._note("enters")
        elif isinstance(phase, DoorClose):
            self.robot.phase = None
            self.visits += 1
            self._note("done")
            self._plan_next()
        if now < self._next_at:
            return
        self._next_at = NEVER
        leaves, self.passing = self.passing, False
        self._note("leaves" if leaves else "asks")
        self._begin(DoorClose(WARD) if leaves else DoorOpen(WARD))

    def _begin(self, phase: Phase) -> None:
        say(self.world, self.name, self.robot.begin(phase, self.world.now + self.skew))

    def _note(self, what: str) -> None:
        self.log.append((round(self.world.now, 3), what))
