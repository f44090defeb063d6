"""Stories for a robot's core in virtual time. The core reads the robot eight times a second.

The robot drives in a corridor on L1 from x = 0 to x = 10 m, with a charger at each end. The pantry is
in the middle, and a lift to L2 is at x = 8 m. The robot's map is RMF's map, turned by 90 degrees and
moved.
"""

from dataclasses import dataclass, field
from typing import Any

from msgspec.structs import replace

from bridges.kinds.fleet import core
from bridges.kinds.fleet.memory import RobotLimits, RobotMemory
from bridges.kinds.fleet.places import Lane, NavGraph, RobotSite, Vertex
from bridges.kinds.fleet.report import RobotReport
from bridges.kinds.fleet.settings import RobotDurations
from bridges.kinds.fleet.signals import (
    Event,
    Goal,
    Navigate,
    Order,
    Pose,
    RobotCommand,
    RobotSample,
)
from bridges.kinds.shared.decision import IoFailed, Sampled
from bridges.kinds.shared.similarity import Similarity

GRAPH = NavGraph(
    vertices=(
        Vertex("L1", 0.0, 0.0, "charger_a", charger=True),
        Vertex("L1", 5.0, 0.0, "pantry"),
        Vertex("L1", 8.0, 0.0, "lift1_L1", lift="Lift1"),
        Vertex("L1", 10.0, 0.0, "charger_b", charger=True),
        Vertex("L2", 8.0, 0.0, "lift1_L2", lift="Lift1"),
        Vertex("L2", 8.0, 5.0, "ward"),
    ),
    lanes=(
        Lane(0, 1),
        Lane(1, 0, dock="dock_a"),
        Lane(1, 2),
        Lane(2, 1),
        Lane(2, 3, dock="dock_b"),
        Lane(4, 5),
    ),
)
SITE = RobotSite(GRAPH, {"": Similarity(1j, complex(100, 0), 0.0)}, "charger_a")
LIMITS = RobotLimits(RobotDurations(), SITE)
SCAN_S = 0.125
SILENT = IoFailed("192.168.1.80:22011 refuses the connection")


def at(x: float, y: float = 0.0, level: str = "L1", yaw: float = 0.0) -> Pose:
    """Return the pose on the robot's map for this place on RMF's map."""
    return SITE.on_robots_map(Pose(level, x, y, yaw))


def goal(x: float, y: float = 0.0, level: str = "L1", **more: Any) -> Goal:
    """Return a goal at this place on RMF's map."""
    return Goal(at(x, y, level), **more)


PANTRY = goal(5.0, name="pantry")
DOCK_A = goal(0.0, name="charger_a", dock="dock_a")


@dataclass
class Story:
    """One robot and its core. `sample` is the reading that the core gets next. `takes`: the robot's
    manager takes each command before the next reading, if `sample` has no refusal.

    `sent` gets an entry (s, command) whenever the command changes.
    """

    limits: RobotLimits = LIMITS
    sample: RobotSample = RobotSample(at(0.0), 0.8)
    now: float = 100.0
    takes: bool = True
    sent: list[tuple[float, RobotCommand | None]] = field(default_factory=list)
    reports: list[RobotReport] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.began = self.now
        self.memory: RobotMemory = core.initial(self.limits, self.now)
        self.wake_at = self.now

    def take(self, event: Event) -> "Story":
        """Let the core decide on an event."""
        before = self.memory.command
        decision = core.decide(self.memory, event, self.now, self.limits)
        self.memory, self.wake_at = decision.memory, decision.wake_at
        assert self.wake_at > self.now
        assert decision.outputs.command == self.memory.command
        if self.memory.command != before:
            self.sent.append((round(self.now - self.began, 3), self.memory.command))
        self.reports.append(decision.report)
        return self

    def see(self, for_s: float = 0.0, **changes: Any) -> "Story":
        """Let the core read this sample once. With `for_s` it reads the sample again and again for
        `for_s` seconds."""
        self.sample = replace(self.sample, **changes)
        self._read()
        for _ in range(round(for_s / SCAN_S)):
            self.now += SCAN_S
            self._read()
        return self

    def _read(self) -> None:
        command = self.memory.command
        if command is not None and self.takes and not self.sample.refused:
            self.sample = replace(self.sample, taken=(command.id, command.attempt))
        self.take(Sampled(self.sample))

    def silence(self, for_s: float) -> "Story":
        """Let each reading fail for `for_s` seconds."""
        for _ in range(round(for_s / SCAN_S)):
            self.now += SCAN_S
            self.take(SILENT)
        return self

    def order(self, order: Order) -> "Story":
        """Let the core read the robot, and then get this order from RMF."""
        self._read()
        return self.take(order)

    @property
    def report(self) -> RobotReport:
        """Return the last report."""
        return self.reports[-1]

    @property
    def faults(self) -> list[str]:
        """Return the codes of the present faults."""
        return [fault.code for fault in self.report.faults]

    @property
    def commands(self) -> list[tuple[float, str]]:
        """Return (s, command in words) for each change of the command."""
        return [(at_s, _words(command)) for at_s, command in self.sent]


def _words(command: RobotCommand | None) -> str:
    return f"{command.doing} {command.id}, attempt {command.attempt}" if command else "none"


def driving(number: int = 1, to: Goal = PANTRY, **sample: Any) -> Story:
    """Return a story in which RMF has just ordered a robot at charger_a to drive to this goal."""
    return Story(sample=RobotSample(at(0.0), 0.8, **sample)).see().order(Navigate(number, to))
