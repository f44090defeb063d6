"""A corridor in virtual time: a door with its daemon's core, robots of RMF, and a door supervisor.

Every message takes its way over a network that may lose, delay, repeat and reorder it. The
supervisor is ours in a shell of its own (`Shell`), or RMF's.
"""

import heapq
from collections.abc import Callable, Iterable, Sequence
from random import Random
from typing import Any

from bridges.core.decision import RequestRefused
from bridges.core.graph_kind import MaySpeak, Woken
from bridges.door import messages as door_messages
from bridges.door_supervisor import KIND, core, keep, messages, report
from bridges.door_supervisor.memory import Memory
from bridges.door_supervisor.settings import Settings
from bridges.rmf import definitions as d
from bridges.rmf import topics
from bridges.rmf.stamps import stamp
from hal_fakes.rmf import NEVER, Party, Said
from hal_fakes.rmf.phases import DoorClose, DoorOpen
from hal_fakes.rmf.robot import Phase, Robot
from tests.door.virtual import SCAN_S, Door

EPOCH = 2.0**30
"""Wall time when the story's clock shows 0; a power of two, so that sums of times stay exact."""
GAP_S = 0.125
EVERY_S = 1.0
WARD = "ward"


class Disk:
    """The state directory. It outlives the daemon; `written` counts."""

    def __init__(self) -> None:
        self.kept: bytes | None = None
        self.written = 0

    def write(self, kept: bytes) -> None:
        if kept != self.kept:
            self.kept, self.written = kept, self.written + 1

    def holds(self, who: str, door: str = WARD) -> bool:
        """Would a daemon that starts now know that this requester holds the door?"""
        found = keep.restore(self.kept, Settings(), 0.0) if self.kept else {}
        return door in found and found[door].holder(who) is not None


class Shell:
    """Our supervisor as the daemon runs it: quiet at start and beside a rival, table, heartbeat."""

    subscribes: Sequence[topics.Topic[Any]] = tuple(KIND.requests)

    def __init__(
        self, disk: Disk, now: float, rivals: Callable[[], int] = int, **changes: Any
    ) -> None:
        self.settings = Settings(**changes)
        self.limits = KIND.limits(self.settings)
        self.disk = disk
        self.rivals = rivals
        self.speaks = False
        self.refused: list[str] = []
        self.memories: dict[str, Memory] = {}
        self._wakes: dict[str, float] = {}
        self._faults: dict[str, list[str]] = {}
        self._look_at = -NEVER
        self._started_at = now
        self._alone_since: float | None = now
        self._beat: d.Message | None = None
        self._beat_at = -NEVER
        if disk.kept is not None:
            self.memories.update(keep.restore(disk.kept, self.settings, now))
        for door in list(self.memories):
            self._decide(door, MaySpeak(False), now)

    def hear(self, message: Any, now: float) -> list[Said]:
        """A request or a state."""
        said = self.tick(now)
        topic = (
            topics.DOOR_STATES if isinstance(message, d.DoorState) else topics.ADAPTER_DOOR_REQUESTS
        )
        try:
            event = KIND.requests[topic](message, self.settings, EPOCH + now)
        except RequestRefused as refusal:
            self.refused.append(refusal.kind)
            return said
        said += self._decide(KIND.device_name(message), event, now)
        return said + self._tell(now)

    def tick(self, now: float) -> list[Said]:
        """Time has passed."""
        said = self._look_around(now)
        for door, wake_at in list(self._wakes.items()):
            if now >= wake_at:
                said += self._decide(door, Woken(), now)
        for door in [door for door, memory in self.memories.items() if core.idle(memory, now)]:
            del self.memories[door], self._wakes[door]
        return said + self._tell(now)

    def wake_at(self) -> float:
        """When to tick next. The graph is looked at four times a second."""
        return min([self._look_at, self._told_next_at(), *self._wakes.values()])

    def faults(self) -> dict[str, list[str]]:
        """What is wrong, door by door, as last decided."""
        return {door: faults for door, faults in self._faults.items() if faults}

    def _look_around(self, now: float) -> list[Said]:
        if now < self._look_at:
            return []
        if self.rivals():
            self._alone_since = None
        elif self._alone_since is None:
            self._alone_since = now
        since = self._alone_since
        speak_at = NEVER if since is None else since + self.settings.quiet_start_s
        self._look_at = min(at for at in (now + 0.25, speak_at) if at > now)
        speaks = now >= speak_at
        if speaks == self.speaks:
            return []
        self.speaks = speaks
        return [
            said for door in self.memories for said in self._decide(door, MaySpeak(speaks), now)
        ]

    def _decide(self, door: str, event: Any, now: float) -> list[Said]:
        said: list[Said] = []
        if door not in self.memories:
            self.memories[door] = core.initial(door, self._started_at)
            said += self._decide(door, MaySpeak(self.speaks), now)
        decided = core.decide(self.memories[door], event, now, self.limits)
        self.memories[door], self._wakes[door] = decided.memory, decided.wake_at
        self._faults[door] = [str(fault) for fault in decided.report.faults]
        if decided.refused:
            self.refused.append(decided.refused)
        for topic, message in decided.publish:
            assert self.speaks, "it was not to speak"
            assert isinstance(message, d.DoorRequest)
            said.append((topic, messages.stamped(message, stamp(EPOCH + now))))
        return said

    def _tell(self, now: float) -> list[Said]:
        """Keep the table, then tell it: a heartbeat when it has changed, and each second."""
        self.disk.write(keep.persist(self.memories))
        if now < self._told_next_at():
            return []
        topic, self._beat = report.heartbeat(self.memories)
        self._beat_at = now
        return [(topic, self._beat)]

    def _told_next_at(self) -> float:
        if not self.speaks:
            return NEVER
        changed = report.heartbeat(self.memories)[1] != self._beat
        return self._beat_at + (GAP_S if changed else EVERY_S)


class DoorDaemon:
    """A door's daemon: scans, obeys door_requests, tells its state at 1 Hz and on change."""

    subscribes: Sequence[topics.Topic[Any]] = (topics.DOOR_REQUESTS,)

    def __init__(self, now: float = 0.0, name: str = WARD, **changes: Any) -> None:
        self.name = name
        self.door = Door(**changes)
        self.door.now = now
        self._told: d.DoorModeValue | None = None
        self._told_at = -NEVER

    def hear(self, message: Any, now: float) -> list[Said]:
        """A request for this door, or another's."""
        if message.door_name != self.name:
            return []
        self.door.now = now
        self.door.scan(door_messages.accept(message, self.door.settings))
        return self._state(now)

    def tick(self, now: float) -> list[Said]:
        """One scan."""
        self.door.now = now
        self.door.scan()
        return self._state(now)

    def wake_at(self) -> float:
        """The next scan."""
        return min(self.door.now + SCAN_S, self.door.wake_at)

    def restart(self, now: float) -> None:
        """The daemon dies and is back: outputs off, nothing remembered."""
        self.door.now = now
        self.door.restart()

    def _state(self, now: float) -> list[Said]:
        mode = self.door.report.mode
        if mode == self._told and now < self._told_at + 1.0:
            return []
        self._told, self._told_at = mode, now
        at = stamp(EPOCH + now)
        return [(topics.DOOR_STATES, d.DoorState(at, self.name, d.DoorMode(int(mode))))]


class Walker:
    """A fleet adapter and its robot, which goes through the door again and again.

    `log`: (s, what). `passing`: it has been let in and has not asked to close. `skew`: of its clock.
    """

    subscribes = Robot.subscribes

    def __init__(self, who: str, plan: Iterable[tuple[float, float]], skew: float = 0.0) -> None:
        self.who = who
        self.skew = EPOCH + skew
        self.robot = Robot(who)
        self.passing = False
        self.visits = 0
        self.log: list[tuple[float, str]] = []
        self._plan = iter(plan)
        self._stay_s = 0.0
        self._next_at = 0.0
        self._plan_next(0.0)

    def hear(self, message: Any, now: float) -> list[Said]:
        """The robot's own rules, then what comes next in its day."""
        return self.robot.hear(message, now + self.skew) + self._go_on(now)

    def tick(self, now: float) -> list[Said]:
        """Its timers."""
        said: list[Said] = []
        if now >= self.robot.wake_at() - self.skew:
            said += self.robot.tick(now + self.skew)
        return said + self._go_on(now)

    def wake_at(self) -> float:
        """A repeat, or its next step."""
        return min(self.robot.wake_at() - self.skew, self._next_at)

    def restart(self, now: float) -> None:
        """The fleet adapter dies and is back: it knows of no door."""
        self.robot, self.passing = Robot(self.who), False
        self._note(now, "restarted")
        self._plan_next(now)

    def _plan_next(self, now: float) -> None:
        rest_s, self._stay_s = next(self._plan, (NEVER, 0.0))
        self._next_at = now + rest_s

    def _go_on(self, now: float) -> list[Said]:
        phase = self.robot.phase
        if phase is not None and not phase.done:
            return []
        if isinstance(phase, DoorOpen) and not self.passing:
            self.passing, self._next_at = True, now + self._stay_s
            self._note(now, "enters")
        elif isinstance(phase, DoorClose):
            self.robot.phase = None
            self.visits += 1
            self._note(now, "done")
            self._plan_next(now)
        if now < self._next_at:
            return []
        self._next_at = NEVER
        leaves, self.passing = self.passing, False
        self._note(now, "leaves" if leaves else "asks")
        return self._begin(DoorClose(WARD) if leaves else DoorOpen(WARD), now)

    def _begin(self, phase: Phase, now: float) -> list[Said]:
        return self.robot.begin(phase, now + self.skew)

    def _note(self, now: float, what: str) -> None:
        self.log.append((round(now, 3), what))


class Corridor:
    """All of them, and the network between. `heard` by: everything said, as (s, who, topic, message).

    `fate(topic)`: the delays (s) after which each copy of a message arrives; none: it is lost.
    """

    def __init__(
        self, fate: Callable[[Random], Sequence[float]] | None = None, seed: int = 0
    ) -> None:
        self.now = 0.0
        self.parties: dict[str, Party] = {}
        self.said: list[tuple[float, str, topics.Topic[Any], Any]] = []
        self.watch: Callable[[str, Said], None] = lambda who, said: None
        self.fate = fate
        self.random = Random(seed)
        self._under_way: list[tuple[float, int, str, Any]] = []
        self._count = 0

    def say(self, who: str, said: Iterable[Said]) -> None:
        """Somebody publishes."""
        for topic, message in said:
            self.said.append((self.now, who, topic, message))
            self.watch(who, (topic, message))
            for name, party in self.parties.items():
                if topic in party.subscribes:
                    self._send(name, message)

    def run(self, until: float) -> None:
        """Let time pass."""
        while self._next_at() <= until:
            self.now = self._next_at()
            while self._under_way and self._under_way[0][0] <= self.now:
                _, _, name, message = heapq.heappop(self._under_way)
                if name in self.parties:
                    self.say(name, self.parties[name].hear(message, self.now))
            for name, party in list(self.parties.items()):
                if party.wake_at() <= self.now:
                    self.say(name, party.tick(self.now))
        self.now = until

    def to_door(self) -> list[tuple[float, str, str]]:
        """Every word on door_requests: (s, who said it, OPEN or CLOSED)."""
        return [
            (round(at, 3), who, d.DoorModeValue(said.requested_mode.value).name[5:])
            for at, who, topic, said in self.said
            if topic == topics.DOOR_REQUESTS
        ]

    def _send(self, name: str, message: Any) -> None:
        delays = self.fate(self.random) if self.fate else (0.0,)
        for delay in delays:
            self._count += 1
            heapq.heappush(self._under_way, (self.now + delay, self._count, name, message))

    def _next_at(self) -> float:
        due = [party.wake_at() for party in self.parties.values()]
        return max(self.now, min([*due, *(entry[0] for entry in self._under_way[:1])]))
