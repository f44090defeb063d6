"""A robot that RMF can only pause. The robot's own manager (the maker's system) sends it to its goals,
and RMF's traffic light allows it to go on.

RMF knows the robot's path as a row of checkpoints. RMF reserves the checkpoints one after the other,
and answers each question about the robot's progress (`signals.LightAnswer`).

FLEET-LIGHT-1. RMF gets the path that the manager reports, beginning at the robot's own place. A path is
   new if it is not the rest of the last path. A path is over when the robot reaches its last
   checkpoint.
FLEET-LIGHT-2. A robot may drive only to the checkpoint that RMF has granted. So a robot for which RMF
   has not answered is paused. The robot is paused `pauses_m` before the granted checkpoint. It is
   paused at once if RMF says so, if the robot is silent, or if the robot drives on against a pause. At
   the path's end the robot stops by itself.
FLEET-LIGHT-3. If a robot stands less than `pauses_m` before a granted checkpoint, it counts as standing
   at that checkpoint. RMF never hears that the robot has reached a checkpoint that RMF has not granted,
   unless the robot has really passed it.
FLEET-LIGHT-4. A robot is resumed only if we have paused it, because a person may have paused it too. A
   robot that reports a pause before ours counts as paused by others, even while it still rolls. If it
   then reports that it is not paused, and ours goes on, it counts as paused by us. It is resumed only
   if RMF says so or if its path is over. A resume that it has not obeyed yet is replaced by a pause if
   it must stand. After an operator's reset, a paused robot counts as paused by us. `keep.py` saves on
   disk which robots we have paused.
FLEET-LIGHT-5. If RMF answers with an error and the robot stands, RMF gets the path again, beginning at
   the robot's present place.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Literal

import msgspec
from msgspec.structs import replace

from bridges.kinds.fleet.memory import LightMemory, RobotLimits, RobotMemory, silent_at
from bridges.kinds.fleet.places import off_line_m
from bridges.kinds.fleet.sensing import apart, on_other_map, stands
from bridges.kinds.fleet.signals import LightAnswer, Pose, RobotCommand

SAME_M = 0.05
"""The distance (m) within which two places on a path count as one place."""
GRANTS = {"continue": 2, "wait": 1, "resume": 1}
"""The answers of RMF that let the robot drive. Each has a number: RMF asked about one checkpoint, and
grants this many checkpoints after it."""


class LightQuestion(msgspec.Struct, frozen=True):
    """A robot's progress, as RMF's traffic light asks for it. All places are on RMF's map.

    `checkpoint`: the last checkpoint that the robot has reached. `stands`: whether the robot is moving,
    stands at that checkpoint, or stands after it. `path`: () for a robot without a path. `held`: we
    have paused the robot.
    """

    path: tuple[Pose, ...]
    number: int
    checkpoint: int
    stands: Literal["moving", "at", "after"]
    here: Pose
    held: bool


def hear(memory: RobotMemory, answer: LightAnswer) -> RobotMemory:
    """Apply an answer of RMF's traffic light. An answer about an earlier path has no effect."""
    light = memory.light
    if answer.path != light.number or not light.path:
        return memory
    ahead = GRANTS.get(answer.says)
    granted = light.granted if ahead is None else answer.checkpoint + ahead
    return replace(memory, light=replace(light, answer=answer, granted=granted))


def follow(memory: RobotMemory, limits: RobotLimits) -> RobotMemory:
    """Update the path, and the last reached checkpoint, from the last reading."""
    reading = memory.reading
    if reading is None or not memory.fresh or on_other_map(memory, limits):
        return memory
    light, still = memory.light, stands(memory)
    here, told = limits.site.on_rmfs_map(reading.at), reading.path or ()
    astray = still and light.answer is not None and light.answer.says == "error"
    if told != light.told or astray:
        light = _told(light, told, here, limits, anew=astray)
    light = replace(light, passed=_passed(light, here, limits, still=still))
    if light.path and light.passed == len(light.path) - 1:
        light = replace(light, path=(), passed=0, answer=None, granted=0)
    return memory if light == memory.light else replace(memory, light=light)


def _told(
    light: LightMemory, told: tuple[Pose, ...], here: Pose, limits: RobotLimits, *, anew: bool
) -> LightMemory:
    """Apply the path that the manager reports. If it is not the rest of the present path, begin a new
    path."""
    ahead = _ahead([limits.site.on_rmfs_map(at) for at in told], here, limits.t.arrived_m)
    rest = light.path[light.passed + 1 :][-len(ahead) :]
    is_rest = bool(ahead) and len(rest) == len(ahead) and all(map(_is_same, rest, ahead))
    if is_rest and not anew:
        return replace(light, told=told)
    path, number = (here, *ahead) if ahead else (), light.number + 1
    return replace(light, told=told, path=path, number=number, passed=0, answer=None, granted=0)


def _ahead(places: Sequence[Pose], here: Pose, near_m: float) -> list[Pose]:
    """Return the places that are still ahead of the robot. Leave out a place that is the same as the
    place before it."""
    for number, (start, end) in enumerate(pairwise(places)):
        if _off_m(start, end, here) <= near_m:
            places = places[number + 1 :]
            break
    found: list[Pose] = []
    for place in places:
        if _apart(found[-1] if found else here, place) > (SAME_M if found else near_m):
            found.append(place)
    return found


def _passed(light: LightMemory, here: Pose, limits: RobotLimits, *, still: bool) -> int:
    """Return the last checkpoint that the robot has reached."""
    passed = max(_reached(light, here, limits.t.arrived_m), default=light.passed)
    ahead = range(passed + 1, min(light.granted, len(light.path) - 1) + 1)
    near = (to for to in ahead if _way_m(light.path, passed, here, to) <= limits.t.pauses_m)
    return max(near, default=passed) if still else passed


def _reached(light: LightMemory, here: Pose, near_m: float) -> Iterator[int]:
    """Yield the checkpoints that the robot has reached: it is near them, or nearer to the path after
    them than to the path before them."""
    path = light.path
    for number in range(light.passed + 1, len(path)):
        before = _off_m(path[number - 1], path[number], here)
        after = (_off_m(one, two, here) for one, two in pairwise(path[number:]))
        if _apart(path[number], here) > near_m and next(after, before) + SAME_M >= before:
            return
        yield number


def _way_m(path: Sequence[Pose], passed: int, here: Pose, to: int) -> float:
    """Return the length of the way from `here` along the path to the checkpoint `to`."""
    places = [here, *path[passed + 1 : to + 1]]
    return sum(_apart(a, b) for a, b in pairwise(places))


def _is_same(one: Pose, other: Pose) -> bool:
    return _apart(one, other) <= SAME_M


def _apart(one: Pose, other: Pose) -> float:
    return apart(one, other) if one.map == other.map else float("inf")


def _off_m(start: Pose, end: Pose, here: Pose) -> float:
    """Return the robot's distance from the part of the path between `start` and `end`. If that part
    leads to another floor, return the distance from its end on the robot's floor."""
    if start.map == end.map == here.map:
        return off_line_m(start, end, here)
    return min(_apart(start, here), _apart(end, here))


def must_stand(memory: RobotMemory, now: float, limits: RobotLimits) -> bool:
    """Return whether the robot must pause now."""
    light = memory.light
    if not light.path:
        return False
    if memory.reading is None or now >= silent_at(memory, limits):
        return True
    if light.answer is None or light.answer.says not in GRANTS:
        return True
    if light.granted >= len(light.path) - 1:
        return False
    here = limits.site.on_rmfs_map(memory.reading.at)
    left_m = _way_m(light.path, light.passed, here, light.granted)
    return light.passed >= light.granted or left_m <= limits.t.pauses_m


def steer(memory: RobotMemory, now: float, limits: RobotLimits) -> RobotMemory:
    """Begin a pause or a resume if one is due."""
    light, command, still = memory.light, memory.command, stands(memory)
    doing = command.doing if command else ""
    paused = memory.reading.paused if memory.reading else None
    if must_stand(memory, now, limits):
        if doing != "resume" and still and (light.held or paused):
            return memory
        ours = light.held or (paused is False if doing == "pause" else not paused)
        memory = replace(memory, light=replace(light, held=ours))
        return memory if doing == "pause" else _begin(memory, "pause", now)
    if not (light.held and still) or doing == "resume":
        return memory
    if not light.path or (light.answer and light.answer.says == "resume"):
        return _begin(memory, "resume", now)
    return memory


def _begin(memory: RobotMemory, doing: Literal["pause", "resume"], now: float) -> RobotMemory:
    light = replace(memory.light, orders=memory.light.orders + 1)
    command = RobotCommand(light.orders, doing)
    return replace(memory, light=light, command=command, asked_at=now, tries=1)


def resumed(memory: RobotMemory, now: float, limits: RobotLimits) -> bool:
    """Return whether the robot has obeyed a resume.

    If a robot does not report whether it is paused, it must be seen to move. A robot without a path has
    no reason to move, so for this robot the time `stops_s` is enough.
    """
    assert memory.reading is not None
    if memory.reading.paused is not None:
        return not memory.reading.paused
    waits = stands(memory)
    return not waits or (not memory.light.path and now >= memory.asked_at + limits.t.stops_s)


def question(memory: RobotMemory, limits: RobotLimits) -> LightQuestion | None:
    """Return the robot's progress for RMF's traffic light. Return None if the last reading gave no
    place on RMF's map."""
    light = memory.light
    if memory.reading is None or not memory.fresh or on_other_map(memory, limits):
        return None
    here, passed = limits.site.on_rmfs_map(memory.reading.at), light.passed
    stopping_m = limits.t.pauses_m
    if not light.path:
        state: Literal["moving", "at", "after"] = "at"
    elif stands(memory):
        state = "at" if _apart(light.path[passed], here) <= stopping_m else "after"
    else:
        state = "moving"
        can_stop = _way_m(light.path, passed, here, passed + 1) > stopping_m
        passed += not can_stop and passed + 1 < light.granted
    return LightQuestion(light.path, light.number, passed, state, here, light.held)
