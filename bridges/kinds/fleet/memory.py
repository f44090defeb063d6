"""The values that a robot's core keeps from one scan to the next, and the settings that it needs (its
limits)."""

from collections.abc import Mapping

import msgspec

from bridges.kinds.fleet.places import RobotSite
from bridges.kinds.fleet.settings import FleetRobotSettings, RobotDurations
from bridges.kinds.fleet.signals import LightAnswer, PadHeard, Pose, RobotCommand, RobotSample
from bridges.kinds.shared.durations import AGES_AGO


class RobotLimits(msgspec.Struct, frozen=True):
    """The settings that the core needs. `t`: durations and distances. `light`: RMF's traffic light can
    pause the robot, but not send it to goals."""

    t: RobotDurations = RobotDurations()
    site: RobotSite = RobotSite()
    light: bool = False

    @classmethod
    def of(cls, settings: FleetRobotSettings, debounce: Mapping[str, float]) -> "RobotLimits":
        """Make the limits from the YAML. Their `site` stays empty here, because it comes from RMF's
        files."""
        return cls(settings.limits)


class Pad(msgspec.Struct, frozen=True):
    """The last state of a charger that names this robot, heard at `at`."""

    state: PadHeard
    at: float


class LightMemory(msgspec.Struct, frozen=True):
    """The path of a robot that RMF can only pause. `number`: the path's number, which RMF uses too.

    `told`: the path as the robot's manager last reported it. `path`: the checkpoints on RMF's map,
    beginning where the robot was when the path came; () without a path. `passed`: the last checkpoint
    that the robot has reached. `answer`: RMF's last answer about this path. `granted`: the checkpoint
    to which RMF lets the robot drive. `held`: we have paused the robot. `orders`: the number of pauses
    and resumes.
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
    """The facts of the past that the next decision needs. Times are monotonic seconds.

    `reading`: the last good reading, taken at `read_at`. `fresh`: the last event brought that reading,
    so RMF may get its place. `unread`: the reason why there is no newer reading. `unsent`: the reason
    why the command could not be sent; "" when it was sent. `stood_at`: the place where the robot last
    began to stand. `moved_at`: the time when the robot was last seen to move from such a place.
    `said_at`: the robot's own time in its last reading. `said_new_at`: our time when the robot's own
    time last advanced. `off_m`: the distance from the graph, measured at the place `off_at`.

    `command`: the command that the robot must carry out. `asked_at`: the time of the last attempt.
    `tries`: the number of attempts since the command began, or since an operator's reset. `arrived_at`:
    a docking robot has been at its dock since this time. `finished`: the number of the last command
    that was carried out; 0 for none. `charges_at`: the last charger that the robot was sent to. `pads`:
    charger -> its last state that names this robot. `light`: for a robot that RMF can only pause.
    """

    reading: RobotSample | None = None
    read_at: float | None = None
    fresh: bool = False
    unread: str = ""
    unsent: str = ""
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
