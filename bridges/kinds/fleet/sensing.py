"""Judges a robot's readings: whether RMF may get the place, whether the robot stands, and how far it is
from its goal.

FLEET-SENSING-1. A reading counts only if all its numbers are finite and the battery is between 0 and 1.
   RMF's adapter ignores a battery outside this range, and it plans with a battery that is not a number.
   A battery up to 2 % above full counts as full.
FLEET-SENSING-2. A reading with the time of the last reading is that reading again, and brings nothing
   new. If no newer time comes for `stale_after_s`, the manager has lost the robot, and the reading does
   not count any more, nor after a reading that failed. A reading with an earlier time does not count.
   If earlier times keep coming for `stale_after_s`, the robot's clock was set back, and the readings
   count again.
FLEET-SENSING-3. A robot stands if it reports that it stands. If it does not report this, it stands if
   it has moved less than 3 cm and 3° for a second.
"""

import math

from msgspec.structs import replace

from bridges.kinds.fleet.memory import RobotLimits, RobotMemory
from bridges.kinds.fleet.signals import Goal, Pose, RobotSample
from bridges.kinds.shared.durations import AGES_AGO

STANDS_S = 1.0
STANDS_M = 0.03
STANDS_RAD = math.radians(3)
ABOVE_FULL = 1.02
LOOKS_AGAIN_M = 0.1
"""The least distance (m) that a robot must move before its distance from the graph is measured
again."""


def implausible(sample: RobotSample) -> str:
    """Return why RMF must not have this reading; "" for a good reading."""
    if not all(map(math.isfinite, (sample.at.x, sample.at.y, sample.at.yaw))):
        return "its place is no number"
    if not 0.0 <= sample.battery <= ABOVE_FULL:  # false for NaN too
        return f"its battery is {100 * sample.battery:.0f} %: is the unit right?"
    return ""


def take(memory: RobotMemory, sample: RobotSample, now: float, limits: RobotLimits) -> RobotMemory:
    """Add one reading."""
    if reason := implausible(sample):
        return replace(memory, fresh=False, unread=reason)
    said_at, before = sample.said_at, memory.said_at
    if said_at is not None and before is not None and said_at <= before:
        old = now >= memory.said_new_at + limits.t.stale_after_s
        if said_at == before and memory.fresh and not old:
            return memory
        if said_at == before or not old:
            reason = "its manager repeats an old reading"
            return replace(memory, fresh=False, unread=reason)
    sample = replace(sample, battery=min(1.0, sample.battery))
    memory = _measured(_moved(memory, sample.at, now, limits), sample.at, limits)
    return replace(
        memory,
        reading=sample,
        read_at=now,
        fresh=True,
        unread="",
        said_at=said_at,
        said_new_at=now,
    )


def _moved(memory: RobotMemory, at: Pose, now: float, limits: RobotLimits) -> RobotMemory:
    stood, near = memory.stood_at, STANDS_M * limits.site.metre(at.map)
    if stood is not None and stood.map == at.map and apart(stood, at) <= near:
        turned = turned_rad(stood.yaw, at.yaw) > STANDS_RAD
        return replace(memory, stood_at=at, moved_at=now) if turned else memory
    return replace(memory, stood_at=at, moved_at=now)


def _measured(memory: RobotMemory, at: Pose, limits: RobotLimits) -> RobotMemory:
    """Measure the distance from the graph, if the robot has moved."""
    before = memory.off_at
    near = LOOKS_AGAIN_M * limits.site.metre(at.map)
    if before is not None and before.map == at.map and apart(before, at) < near:
        return memory
    off_m = limits.site.graph.off_m(limits.site.on_rmfs_map(at)) if _known(at, limits) else 0.0
    return replace(memory, off_at=at, off_m=off_m)


def _known(at: Pose, limits: RobotLimits) -> bool:
    return at.map in limits.site.graph.levels()


def on_other_map(memory: RobotMemory, limits: RobotLimits) -> bool:
    """Return whether the robot is on a map that RMF's graph lacks. Without a graph every map counts as
    known."""
    graph = limits.site.graph
    return bool(memory.reading and graph.vertices) and not _known(memory.reading.at, limits)  # type: ignore[union-attr]


def stands(memory: RobotMemory) -> bool:
    """Return whether a fresh reading shows that the robot stands."""
    if memory.reading is None or memory.read_at is None or not memory.fresh:
        return False
    if memory.reading.moving is not None:
        return not memory.reading.moving
    return memory.moved_at > AGES_AGO and memory.read_at >= memory.moved_at + STANDS_S


def off_goal_m(memory: RobotMemory, goal: Goal, limits: RobotLimits) -> float:
    """Return the robot's distance from its goal (m of RMF's map); inf on another map."""
    at = memory.reading.at if memory.reading else None
    if at is None or at.map != goal.at.map:
        return math.inf
    return apart(at, goal.at) / limits.site.metre(at.map)


def faces(memory: RobotMemory, goal: Goal, limits: RobotLimits) -> bool:
    """Return whether the robot faces in its goal's direction."""
    assert memory.reading is not None
    turned = turned_rad(memory.reading.at.yaw, goal.at.yaw)
    return turned <= math.radians(limits.t.arrived_deg)


def apart(one: Pose, other: Pose) -> float:
    """Return the distance of two places on one map, in the map's unit."""
    return math.hypot(one.x - other.x, one.y - other.y)


def turned_rad(one: float, other: float) -> float:
    """Return the angle between two directions, from 0 to pi."""
    return abs(math.remainder(one - other, math.tau))
