"""Robots on a wrong pad, and the orders that make them leave.

An order is a change of the robot's charging assignment. When the assignment's waypoint or mode changes,
RMF's fleet adapter restarts the robot's ChargeBattery (rmf_ros2 9dedd0f, ChargeBattery.cpp,
_consider_restart). Therefore an order moves a robot only while the robot runs ChargeBattery. It does so
in a charging task, or by `finishing_request: charge`. A robot's place is known from its fleet
(FleetState's position), or from a station that reads receivers.

Rules:
COORDINATOR-WRONG-PAD-1. A robot with a station may come to another station, or stay at another station
   for LEAVES_S. The coordinator then tells the robot to wait, and TOLD_S later to charge at its own
   station. The coordinator does so at most twice for one request.
COORDINATOR-WRONG-PAD-2. A robot without a station may stand on a pad for which another robot waits. The
   coordinator then repeats its order to wait. For this, it publishes the robot's assignment with
   MODE_CHARGE in place of MODE_WAIT for TOLD_S, and then with MODE_WAIT again. The order comes
   `leaves_s` after the robot arrived or the station released the robot.
COORDINATOR-WRONG-PAD-3. The coordinator gives no such order if it may not assign places. It gives no
   order to a robot in another task either, because RMF would not move the robot.
COORDINATOR-WRONG-PAD-4. A person is alerted if the robot still stands on the wrong pad OBEYS_S after
   the last order, or if the coordinator cannot order the robot to leave.
"""

from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

from msgspec.structs import replace

from bridges.kinds.charger.pad import misplaced_in
from bridges.kinds.charger.report import FaultCause
from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator.memory import CHARGING, Nudge, SiteLimits, SiteMemory
from bridges.kinds.charger_coordinator.queue import Here, queued_and_standing, suiting
from bridges.kinds.charger_coordinator.wishes import SETTLES_S
from bridges.kinds.shared.durations import NEVER

TOLD_S: Final = 1.0
OBEYS_S: Final = 15.0
LEAVES_S: Final = 30.0
TRIES: Final = 2


class OnWrongPad(NamedTuple):
    """A robot `who` that has stood at a wrong `station` since `since`.

    `why`: see `Nudge`. `tries`: the greatest number of orders to leave. `expected`: the robot's own
    station; None if the robot has no station. `waiter`: the robot that waits for the station; None if
    no robot waits.
    """

    who: RobotName
    station: str
    since: float
    why: str
    tries: int
    expected: str | None = None
    waiter: RobotName | None = None


def found(memory: SiteMemory, now: float, site: SiteLimits) -> dict[RobotName, OnWrongPad]:
    """Find every robot that stands at a wrong station or in another robot's way. If `now` is NEVER,
    also find the robots that will count as wrong at a later time, if no robot moves."""
    astray: dict[RobotName, OnWrongPad] = {}
    for one in (*_strayed(memory, now, site), *_blocking(memory, now, site)):
        astray.setdefault(one.who, one)
    return astray


def nudged(memory: SiteMemory, now: float, site: SiteLimits) -> SiteMemory:
    """Tell the robots on a wrong pad to leave, and forget the orders to robots that have left."""
    astray = found(memory, now, site)
    nudges = {who: n for who, n in memory.nudges.items() if _matters(memory, who, n, astray)}
    for who, one in astray.items():
        if now >= _next_at(memory, one):
            before = nudges.get(who)
            count = before.count + 1 if before else 1
            nudges[who] = Nudge(one.why, count, now)
    return replace(memory, nudges=nudges)


def is_nudged(memory: SiteMemory, who: RobotName, now: float) -> bool:
    """Return whether a changed assignment now tells the robot to leave."""
    return who in memory.nudges and now < memory.nudges[who].at + TOLD_S


def alarming(memory: SiteMemory, one: OnWrongPad, now: float) -> bool:
    """Return whether a person should be alerted."""
    return now >= max(one.since, _alarm_at(memory, one))


def due(memory: SiteMemory, site: SiteLimits) -> Iterator[float]:
    """Yield the times of the next orders and alerts."""
    for nudge in memory.nudges.values():
        yield nudge.at + TOLD_S
    for one in found(memory, NEVER, site).values():
        yield one.since
        yield _next_at(memory, one)
        yield _alarm_at(memory, one)


def stands(memory: SiteMemory, who: RobotName, site: SiteLimits) -> tuple[str | None, float, float]:
    """Return the station where the robot stands, the time of its arrival, and the time from which it
    counts as standing there."""
    for name, seen in memory.stations.items():
        if seen.diagnosis is FaultCause.PAD and on_pad(seen.error, site) == who:
            return name, seen.since, seen.since
    came_at = memory.here_since(who)
    return memory.stands_at(who, site), came_at, came_at + SETTLES_S


# ---- helpers


def _strayed(memory: SiteMemory, now: float, site: SiteLimits) -> Iterator[OnWrongPad]:
    """Yield robots that have a station, stand at another station, and have not been charged at their
    own yet."""
    for name, grant in memory.grants.items():
        if grant.over or grant.started:
            continue
        at, came_at, settled_at = stands(memory, grant.robot, site)
        since = settled_at if came_at > grant.made_at else grant.made_at + LEAVES_S
        if at is not None and at != name and since <= now:
            yield OnWrongPad(grant.robot, at, since, grant.request_id, TRIES, expected=name)


def _blocking(memory: SiteMemory, now: float, site: SiteLimits) -> Iterator[OnWrongPad]:
    """Yield robots without a station that stand on a pad for which another robot waits."""
    waiting, here = queued_and_standing(memory, site)
    idle = {name: who for name in here if (who := _idle_at(memory, name, here)) is not None}
    for wish in waiting if idle else ():
        for name in suiting(memory, wish, now, site):
            who, seen = idle.get(name), memory.stations.get(name)
            if who is None or who == wish.robot or seen is None:
                continue
            since = max(memory.here_since(who), seen.since) + site.leaves_s
            if since <= now:
                yield OnWrongPad(who, name, since, name, 1, waiter=wish.robot)


def _idle_at(memory: SiteMemory, station: str, here: Here) -> RobotName | None:
    """Find a robot that stands at this free station and has no station allotted."""
    grant, seen = memory.grants.get(station), memory.stations.get(station)
    if seen is None or seen.state is CHARGING or (grant is not None and not grant.over):
        return None
    return next((who for who in here[station] if memory.station_of(who) is None), None)


def _matters(
    memory: SiteMemory, who: RobotName, nudge: Nudge, astray: Mapping[RobotName, OnWrongPad]
) -> bool:
    """Return whether the number of these orders must be remembered. It is remembered until the robot's
    next request, even if the robot leaves and comes back to a wrong pad."""
    station = memory.station_of(who)
    if station is not None:
        return memory.grants[station].request_id == nudge.why
    return who in astray and astray[who].why == nudge.why


def _can_be_nudged(memory: SiteMemory, who: RobotName) -> bool:
    standing = memory.robots.get(who)
    return memory.assigns and standing is not None and not standing.works


def _next_at(memory: SiteMemory, one: OnWrongPad) -> float:
    """Return the time of the next order to leave. Return NEVER if the robot had enough orders, or if
    the coordinator cannot order the robot to leave."""
    nudge = memory.nudges.get(one.who)
    if not _can_be_nudged(memory, one.who):
        return NEVER
    if nudge is None or nudge.why != one.why:
        return one.since
    return nudge.at + OBEYS_S if nudge.count < one.tries else NEVER


def _alarm_at(memory: SiteMemory, one: OnWrongPad) -> float:
    nudge = memory.nudges.get(one.who)
    if not _can_be_nudged(memory, one.who):
        return one.since
    if nudge is None or nudge.why != one.why or nudge.count < one.tries:
        return NEVER
    return nudge.at + OBEYS_S


def on_pad(error: str, site: SiteLimits) -> RobotName | None:
    """Find the robot named in the station's error; None if the error names no robot of the YAML."""
    seen = misplaced_in(error)
    if seen is None:
        return None
    if seen.robot is None:
        return site.receivers.get(seen.receiver)
    return seen.robot if seen.robot in site.robots else None
