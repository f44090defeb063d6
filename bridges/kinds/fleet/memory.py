"""The memory of a robot's core from scan to scan, and its limits."""

from collections.abc import Mapping

import msgspec

from bridges.kinds.fleet.places import RobotSite
from bridges.kinds.fleet.settings import FleetRobotSettings, RobotDurations
from bridges.kinds.fleet.signals import LightAnswer, PadHeard, Pose, RobotCommand, RobotSample
from bridges.kinds.shared.durations import AGES_AGO


class RobotLimits(msgspec.Struct, frozen=True):
    """The settings that the core needs. `t`: durations and distances. `light`: RMF can only pause the
    robot."""

    t: RobotDurations = RobotDurations()
    site: RobotSite = RobotSite()
    light: bool = False

    @classmethod
    def of(cls, settings: FleetRobotSettings, debounce: Mapping[str, float]) -> "RobotLimits":
        """Make the limits from the YAML; the site comes from RMF's files."""
        return cls(settings.limits)


class Pad(msgspec.Struct, frozen=True):
    """A charger's last state that names this robot, heard at `at`."""

    state: PadHeard
    at: float


class LightMemory(msgspec.Struct, frozen=True):
    """The path of a robot that RMF can only pause. RMF knows the path by the same number.

    `told`: the path as its manager last told it. `path`: the checkpoints on RMF's map, from the place
    where the robot was; () without a path. `passed`: the last checkpoint that it has reached.
    `answer`: RMF's last answer about this path. `granted`: the checkpoint to which RMF lets the robot
    drive. `held`: we have paused it. `orders`: the number of pauses and resumes.
    """

    told: tuple[Pose, ...] = ()
    path: tuple[Pose, ...] = ()
    number: int = 0
    passed: int = 0
    answer: LightAnswer | None = None
    granted: int = 0
    held: bool = False
    orders: int = 0


class RobotMemory(msgspec.Struct, frozen=True):
    """Everything that the next decision needs to know of the past. Times are monotonic seconds.

    `reading`: the last good reading, taken at `read_at`. `fresh`: the last event was that reading, so
    RMF may have it. `unread`: why there is no newer one. `stood_at`, `moved_at`: the place where the
    robot last began to stand, and the time when it was last seen to leave such a place. `said_at`,
    `said_new_at`: the robot's own time of its last reading, and when it last advanced. `off_m`: the
    distance from the graph, taken at `off_at`.

    `command`: the command that the robot shall carry out. `asked_at`: the time of its last attempt.
    `tries`: its attempts since its begin or since an operator's reset.
    `arrived_at`: since when a docking robot has been at its dock. `finished`: the number of the last
    command that was carried out; 0 for none. `charges_at`: the last charger that the robot was sent to.
    `pads`: charger -> its last state that names this robot. `light`: for a robot that RMF can only
    pause.
    """

    reading: RobotSample | None = None
    read_at: float | None = None
    fresh: bool = False
    unread: str = ""
    stood_at: Pose | None = None
    moved_at: float = AGES_AGO
    said_at: float | None = None
    said_new_at: float = AGES_AGO
    off_at: Pose | None = None
    off_m: float = 0.0
    command: RobotCommand | None = None
    asked_at: float = AGES_AGO
    tries: int = 0
    arrived_at: float | None = None
    finished: int = 0
    charges_at: str = ""
    pads: Mapping[str, Pad] = {}
    light: LightMemory = LightMemory()
    started_at: float = AGES_AGO


def silent_at(memory: RobotMemory, limits: RobotLimits) -> float:
    """Return the time at which the robot counts as silent."""
    since = memory.started_at if memory.read_at is None else memory.read_at
    return since + limits.t.stale_after_s
