"""The wishes of robots to be charged. A robot's place, battery and task decide. Its mode is only a
hint.

From a robot's first charge on, RMF's fleet adapter shows the mode CHARGING in every later task too. The
adapter never shows IDLE in a task. (See rmf_ros2 9dedd0f: TaskManager::robot_mode;
RobotContext::current_mode, which only WaitForCharge and DockRobot set.) The id of a task shows whether
the task came from RMF's dispatcher. Such a task is no charge.

Rules for a robot that has stood at one of our waypoints for SETTLES_S:
COORDINATOR-WISHES-1. Below `again_percent` the robot wants to be charged if it has no task, or if its
   mode is CHARGING or DOCKING.
COORDINATOR-WISHES-2. Between `again_percent` and `full_percent` the robot wants to be charged only if
   it shows CHARGING or DOCKING in its present task. A robot that was already charged in that task is
   not charged again. If a robot has not left our waypoints since its charge, it may only be waiting for
   traffic on its pad. Therefore such a robot gets a wish only after LINGERS_S.
COORDINATOR-WISHES-3. A robot without a task wants to be charged when the schedule says so. Within the
   time of one entry, the schedule charges the robot only once, unless the robot has worked in between.
   If another entry with a higher percentage begins, the schedule charges the robot again.
COORDINATOR-WISHES-4. A wish lasts as long as these rules hold, and also during the robot's drive to its
   station. The robot drives to the station in the same task, or without a task after a station was
   assigned to it. If a task begins within COMES_S of the assignment, that task is the drive. It is
   RMF's automatic retreat to a charger, or RMF has restarted the robot's task ChargeBattery. A task
   from RMF's dispatcher is no such drive.
COORDINATOR-WISHES-5. Under `finishing_request: nothing` RMF moves no robot without a task until its
   battery is very low. Under `park` RMF does not move such a robot either, but Jazzy's RMF does drive
   it to its assigned place. A robot that RMF does not move stays where it is when a station is
   assigned. After COMES_S the robot loses the station. ABSENT_S later it may get a station again.
"""

from typing import Final

from msgspec.structs import replace

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator import schedule
from bridges.kinds.charger_coordinator.memory import (
    By,
    Grant,
    SiteLimits,
    SiteMemory,
    Standing,
    Wish,
    without,
)
from bridges.kinds.charger_coordinator.signals import ChargeWanted, Sighting, is_dispatched

SETTLES_S: Final = 2.0
"""The time (s) for which a robot must stand still before it can have a wish. The reason is that a robot
that only passes a waypoint may also show the mode CHARGING."""
LINGERS_S: Final = 300.0
"""The time (s) after which a robot that stands on its pad wants to be charged again. No traffic jam
lasts that long."""
COMES_S: Final = 60.0
"""The time (s) within which RMF acts on a charging assignment, if it acts at all."""
ABSENT_S: Final = 600.0


def sighted(memory: SiteMemory, sighting: Sighting, now: float, site: SiteLimits) -> SiteMemory:
    """Apply one robot's part of a fleet's state."""
    who = sighting.who
    standing = _standing(memory.robots.get(who), sighting, now)
    memory = replace(memory, robots={**memory.robots, who: standing})
    memory = _reached(_called(_served(memory, sighting), sighting, now), sighting, site)
    wish = memory.wish(who)
    if wish is None:
        return _begun(memory, standing, now, site)
    if wish.by == "operator":
        return fulfilled(memory.takes_back(who), who, site) if _full(memory, wish, site) else memory
    if _lasts(memory, wish, sighting, site):
        return memory
    full = _full(memory, wish, site)
    memory = memory.takes_back(who)
    return fulfilled(memory, who, site) if full else memory.without_wish(who)


def wanted(memory: SiteMemory, event: ChargeWanted, site: SiteLimits) -> tuple[SiteMemory, str]:
    """Apply an operator's request. Also return the reason for a refusal, "" if there is none."""
    who = event.robot
    if event.request_id in memory.over:
        return memory, "request is over"
    if event.station and event.station not in site.robots[who]:
        known = event.station in site.places
        return memory, "station does not suit the robot" if known else "unknown charger"
    wish, before = Wish.of(event), memory.wish(who)
    if wish == before:
        return memory, ""
    memory = replace(memory, strikes=without(memory.strikes, who))
    if before is None:
        return replace(memory, wishes=(*memory.wishes, wish)), ""
    has = memory.station_of(who)
    if wish.station not in ("", has):
        memory = memory.takes_back(who)
    return replace(memory, wishes=tuple(wish if w is before else w for w in memory.wishes)), ""


def unwanted(memory: SiteMemory, request_id: str) -> tuple[SiteMemory, str]:
    """Withdraw an operator's request."""
    wish = next((w for w in memory.wishes if request_id and w.request_id == request_id), None)
    grants = memory.grants.values()
    granted = next((g.robot for g in grants if g.request_id == request_id and not g.over), None)
    who = wish.robot if wish else granted
    if who is None:
        return memory, "" if request_id in memory.over else "no such request"
    return memory.takes_back(who).without_wish(who), ""


def fulfilled(memory: SiteMemory, who: RobotName, site: SiteLimits) -> SiteMemory:
    """Note that the robot was charged in its present task, and forget its failures."""
    standing = memory.robots.get(who)
    served = {**memory.served, who: standing.sighting.task_id if standing else ""}
    memory = replace(memory, served=served, strikes=without(memory.strikes, who))
    if aim := schedule.target(site.schedule, who, memory.when):
        memory = memory.with_reached(who, aim)
    return memory.without_wish(who)


def stays_away(memory: SiteMemory, station: str, grant: Grant, site: SiteLimits) -> bool:
    """Return whether the robot does not drive to its assigned station. Such a robot has no task, and
    has not moved since the assignment."""
    standing, wish = memory.robots.get(grant.robot), memory.wish(grant.robot)
    if standing is None or wish is None or wish.by == "operator" or standing.sighting.task_id:
        return False
    elsewhere = memory.stands_at(grant.robot, site) != station
    return elsewhere and standing.here_since <= grant.made_at


def gives_up(memory: SiteMemory, who: RobotName, now: float) -> SiteMemory:
    """Take the station from a robot that did not drive to it. The robot gets no station for
    ABSENT_S."""
    absent = {**memory.absent, who: now + ABSENT_S}
    return replace(memory.takes_back(who).without_wish(who), absent=absent)


# ---- helpers


def _standing(before: Standing | None, sighting: Sighting, now: float) -> Standing:
    if before is None:
        return Standing(sighting, now)
    was = before.sighting
    here = was.place == sighting.place
    same = here and (was.charges, was.task_id) == (sighting.charges, sighting.task_id)
    return Standing(
        sighting, now, before.since if same else now, before.here_since if here else now
    )


def _served(memory: SiteMemory, sighting: Sighting) -> SiteMemory:
    """Forget that a robot was charged in an earlier task, when it has left our waypoints in a later
    task."""
    who, task = sighting.who, sighting.task_id
    if sighting.place is None and task and memory.served.get(who, task) != task:
        return replace(memory, served=without(memory.served, who))
    return memory


def _reached(memory: SiteMemory, sighting: Sighting, site: SiteLimits) -> SiteMemory:
    """Note the percentage of the schedule that a robot has reached. Forget this note when no entry is
    under way, or when the robot has worked."""
    who = sighting.who
    aim = schedule.target(site.schedule, who, memory.when)
    worked = bool(sighting.task_id) and sighting.place is None
    if not aim or worked:
        return replace(memory, reached=without(memory.reached, who))
    return memory.with_reached(who, aim) if sighting.battery_percent >= aim else memory


def _called(memory: SiteMemory, sighting: Sighting, now: float) -> SiteMemory:
    """Note the first task after the assignment of a station as the robot's drive to that station,
    unless RMF's dispatcher gave that task."""
    who, task = sighting.who, sighting.task_id
    wish, station = memory.wish(who), memory.station_of(who)
    if wish is None or wish.by == "operator" or wish.task_id or not task or station is None:
        return memory
    grant = memory.grants[station]
    if grant.started or now >= grant.made_at + COMES_S or is_dispatched(task):
        return memory
    called = replace(wish, task_id=task, called=True)
    return replace(memory, wishes=tuple(called if w is wish else w for w in memory.wishes))


def _begun(memory: SiteMemory, standing: Standing, now: float, site: SiteLimits) -> SiteMemory:
    sighting = standing.sighting
    who = sighting.who
    by = None if memory.faulty(who) else _asks(memory, standing, now, site)
    if by is None:
        return memory
    memory = replace(memory, served=without(memory.served, who), absent=without(memory.absent, who))
    return replace(memory, wishes=(*memory.wishes, Wish(who, by, sighting.task_id)))


def _asks(memory: SiteMemory, standing: Standing, now: float, site: SiteLimits) -> By | None:
    """Return the origin of this robot's wish: its fleet's state, or the schedule. Return None if the
    robot has no wish."""
    s = standing.sighting
    if s.place is None or s.battery_percent >= site.full_percent:
        return None
    if now < standing.since + SETTLES_S or standing.works:
        return None
    low = s.battery_percent < site.again_percent
    if s.charges and (low or _believed(memory, standing, now)):
        return "fleet"
    if s.charges or now < memory.absent.get(s.who, now):
        return None
    aim = schedule.target(site.schedule, s.who, memory.when)
    if s.battery_percent < aim and memory.reached.get(s.who, 0.0) < aim:
        return "schedule"
    return "fleet" if low else None


def _believed(memory: SiteMemory, standing: Standing, now: float) -> bool:
    """Return whether the mode that the fleet shows belongs to the robot's present task, and not to an
    earlier task."""
    served = memory.served.get(standing.sighting.who)
    if served is None:
        return True
    return served != standing.sighting.task_id and now >= standing.since + LINGERS_S


def _lasts(memory: SiteMemory, wish: Wish, s: Sighting, site: SiteLimits) -> bool:
    """Return whether the robot's wish goes on. The robot must stand at one of our waypoints, or drive
    to its station."""
    if s.battery_percent >= _goal(memory, wish, site):
        return False
    same = s.task_id == wish.task_id
    if s.place is not None:
        return s.charges or not s.task_id or (same and wish.called)
    return same and (bool(s.task_id) or memory.station_of(s.who) is not None)


def _goal(memory: SiteMemory, wish: Wish, site: SiteLimits) -> float:
    """Return the battery charge (%) that fulfils the wish."""
    if wish.by != "schedule" or not site.schedule:
        return site.full_percent
    aim = schedule.target(site.schedule, wish.robot, memory.when)
    return max(aim, site.again_percent)


def _full(memory: SiteMemory, wish: Wish, site: SiteLimits) -> bool:
    """Return whether the robot has been charged up to the goal. The fleet's state gives the battery
    charge."""
    grant = memory.grants.get(memory.station_of(wish.robot) or "")
    percent = memory.robots[wish.robot].sighting.battery_percent
    return grant is not None and grant.started and percent >= _goal(memory, wish, site)
