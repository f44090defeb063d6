"""The effects of a station's state: the end of requests, and the decision whether the robot or the
station is at fault.

COORDINATOR-STATIONS-1. A station's state shows that a request has ended.
   - If the station releases the robot after charging, the wish is fulfilled.
   - If the station releases the robot without charging, the robot did not come. Its wish then goes to
     the end of the queue if two conditions hold: the wish is not an operator's, and the robot stands at
     one of our waypoints. Otherwise the wish is over. If the robot stands at that very station, the
     robot has failed there.
   - If the station stops showing a request without a release, the station's daemon was restarted and
     has forgotten the request. The wish stays, and the request is sent again (`_forgot`). The restart
     may have switched the power off. Therefore a charge that ends within PROVEN_S of the restart counts
     as cut short.
   - If a request is over before its station shows it, the station may still take it. The station is not
     free until it has shown and released the request, or has not shown it within TAKEN_S.
COORDINATOR-STATIONS-2. After an error of the station, the robot gets another station and keeps its
   place in the queue. If the robot is at fault, or the side at fault is unclear, the error also counts
   as a failure of the robot. After a second failure the robot is not tried again, and the coordinator
   alerts a technician. If two stations suit the robot and are in order, the first failure is at one of
   them and the second at the other.
COORDINATOR-STATIONS-3. A failure of a robot is forgotten when the robot has been charged for PROVEN_S,
   or fully. The failure is also forgotten when the station proves to be at fault. One proof is an error
   that names the station. The other proof is an error that lasts for more than PROVEN_S after the robot
   has left.
COORDINATOR-STATIONS-4. If another robot is on the pad, the assigned robot keeps the station for its
   start_timeout. If a station is out of reach, its error does not show whether the charge goes on. If a
   robot was charging at that station, the robot keeps the station. It loses the station after LOST_S if
   its fleet then sees it elsewhere, for PROVEN_S. If the robot is still on its way, it gets another
   station after LOST_S.
"""

from typing import Final

from msgspec.structs import replace

from bridges.kinds.charger.report import OUT_OF_SERVICE, UNREQUESTED, FaultCause, diagnosis
from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator.memory import (
    ASSIGNED,
    CHARGING,
    ERROR,
    IDLE,
    NODE,
    RELEASED,
    Grant,
    SiteLimits,
    SiteMemory,
    StationSeen,
    Wish,
    without,
)
from bridges.kinds.charger_coordinator.signals import ChargerStateHeard
from bridges.kinds.charger_coordinator.wishes import COMES_S, fulfilled, gives_up, stays_away
from bridges.kinds.shared.durations import AGES_AGO, NEVER

TAKEN_S: Final = 10.0
SHUNNED_S: Final = 30.0
LOST_S: Final = 30.0
PROVEN_S: Final = 10.0


def heard(memory: SiteMemory, state: ChargerStateHeard, now: float, site: SiteLimits) -> SiteMemory:
    """Apply a station's state."""
    name, before = state.station, memory.stations.get(state.station)
    same = before is not None and (before.state, before.error) == (state.state, state.error)
    since = before.since if before is not None and same else now
    seen = StationSeen(
        state.state, state.request_id, state.robot, state.error, now, since, state.full_in_s
    )
    memory = replace(memory, stations={**memory.stations, name: seen})
    memory = _acquitted(memory, name, before, now, site)
    grant = memory.grants.get(name)
    if grant is None:
        return memory
    if state.state is not IDLE and state.request_id == grant.request_id:
        return _followed(memory, name, grant, seen, now, site)
    if grant.over and (grant.shown or grant.started or now >= not_taken_at(grant)):
        return memory.with_grant(name, None)
    if grant.shown and seen.diagnosis is FaultCause.LOST:
        return memory
    if (grant.shown or grant.started) and not _forgot(memory, name, grant, now, site):
        return _ended(memory.with_grant(name, None), name, grant, now, site)
    return memory.with_grant(name, _repeated(grant, seen, now))


def _forgot(memory: SiteMemory, name: str, grant: Grant, now: float, site: SiteLimits) -> bool:
    """Return whether the station has forgotten the request that it has shown.

    If the station is IDLE, it may instead have released the robot between two states. In that case the
    robot has left, or did not come in time.
    """
    seen = memory.stations[name]
    if seen.state is not IDLE:
        return seen.request_id.startswith(UNREQUESTED)
    if grant.started:
        return memory.stands_at(grant.robot, site) == name
    return now < grant.made_at + grant.start_timeout_s


def _repeated(grant: Grant, seen: StationSeen, now: float) -> Grant | None:
    """Return the grant if the station may still take its request. Return None if the station will not
    take it."""
    before = seen.state is RELEASED or seen.request_id.startswith(UNREQUESTED)
    may_come = seen.state is IDLE or (before and seen.robot == grant.robot)
    if not may_come or not grant.request_id.startswith(f"{NODE}/"):
        return None
    if not grant.shown and not grant.started:
        return grant
    return replace(grant, forgotten_at=now, shown=False, started=False, sent_at=AGES_AGO)


def _followed(
    memory: SiteMemory, name: str, grant: Grant, seen: StationSeen, now: float, site: SiteLimits
) -> SiteMemory:
    """Follow a station that shows our request."""
    grant = replace(grant, shown=True, started=grant.started or seen.state is CHARGING)
    memory = replace(memory, shunned=without(memory.shunned, name)).with_grant(name, grant)
    if grant.over:
        return memory
    if seen.state is RELEASED:
        memory = _ended(memory, name, grant, now, site)
        return memory.with_grant(name, replace(grant, over=True))
    if seen.diagnosis in (FaultCause.ROBOT, FaultCause.STATION, FaultCause.UNCLEAR):
        memory = memory.with_grant(name, replace(grant, over=True, sent_at=AGES_AGO))
        return (
            memory if seen.diagnosis is FaultCause.STATION else _struck(memory, name, grant.robot)
        )
    return memory


def _ended(memory: SiteMemory, name: str, grant: Grant, now: float, site: SiteLimits) -> SiteMemory:
    """Apply the end of a request that the coordinator did not cancel."""
    who, wish = grant.robot, memory.wish(grant.robot)
    if grant.started and now < grant.forgotten_at + PROVEN_S:
        return memory
    if grant.started:
        return fulfilled(memory, who, site)
    if memory.stands_at(who, site) == name:
        memory = _struck(memory, name, who)
    stays = wish is not None and wish.by != "operator" and memory.place_of(who) is not None
    return memory.last_in_queue(who) if stays else memory.without_wish(who)


def _struck(memory: SiteMemory, name: str, who: RobotName) -> SiteMemory:
    """Count a failure of the robot at this station. After its second failure, drop the robot's wish,
    because the robot is not tried again."""
    strikes = {**memory.strikes, who: (*memory.strikes.get(who, ()), name)}
    memory = replace(memory, strikes=strikes)
    return memory.without_wish(who) if memory.faulty(who) else memory


def adopted(memory: SiteMemory, now: float, site: SiteLimits) -> SiteMemory:
    """Adopt the charges that other nodes requested for our robots. Also adopt the charges that nobody
    requested."""
    for name, seen in memory.stations.items():
        if name not in memory.grants and seen.state in (ASSIGNED, CHARGING):
            memory = _adopt(memory, name, seen, now, site)
    return memory


def _adopt(
    memory: SiteMemory, name: str, seen: StationSeen, now: float, site: SiteLimits
) -> SiteMemory:
    who = seen.robot or _waits_at(memory, name, site)
    if who is None or who not in site.robots:
        return memory
    elsewhere = memory.station_of(who) is not None
    if elsewhere and not seen.request_id.startswith(f"{NODE}/"):
        return memory
    to_request = seen.robot is not None and seen.request_id.startswith(UNREQUESTED)
    if not to_request:
        started = seen.state is CHARGING
        grant = Grant(who, seen.request_id, now, shown=True, started=started, over=elsewhere)
        memory = memory.with_grant(name, grant)
    if elsewhere or memory.wish(who) is not None:
        return memory
    return replace(memory, wishes=(*memory.wishes, Wish(who, "operator")))


def _waits_at(memory: SiteMemory, station: str, site: SiteLimits) -> RobotName | None:
    """Find the robot that charges at this station when the station's state names no robot. It is a
    robot that has a wish, has no station, and stands at this one."""
    here = (w.robot for w in memory.wishes if memory.stands_at(w.robot, site) == station)
    return next((who for who in here if memory.station_of(who) is None), None)


# ---- time


def in_time(memory: SiteMemory, now: float, site: SiteLimits) -> SiteMemory:
    """Apply timeouts."""
    for name, grant in list(memory.grants.items()):
        if grant.over or (grant.started and not left_lost(memory, name, grant, site)):
            continue
        if grant.started:
            memory = memory.takes_back(grant.robot)
        elif memory.may_speak and not grant.shown and now >= not_taken_at(grant):
            shunned = {**memory.shunned, name: now + SHUNNED_S}
            memory = replace(memory, shunned=shunned).with_grant(name, None)
            memory = memory.last_in_queue(grant.robot)
        elif grant.shown and now >= hopeless_at(memory, name, grant):
            memory = memory.takes_back(grant.robot)
        elif now >= absent_at(memory, name, grant, site):
            memory = gives_up(memory, grant.robot, now)
    return _proven(memory, now)


def not_taken_at(grant: Grant) -> float:
    """Return the time by which a station must show this request. After that the coordinator does not
    use the station for some time."""
    return max(grant.made_at, grant.forgotten_at) + TAKEN_S


def hopeless_at(memory: SiteMemory, name: str, grant: Grant) -> float:
    """Return the time when a robot on its way should get another station.

    There are three reasons: the station's daemon is silent, the daemon does not reach the station, or
    another robot does not leave the pad.
    """
    seen, at = memory.stations.get(name), memory.silent_since(name) + LOST_S
    if seen is not None and seen.diagnosis is FaultCause.LOST:
        at = min(at, seen.since + LOST_S)
    if seen is not None and seen.diagnosis is FaultCause.PAD:
        at = min(at, seen.since + max(grant.start_timeout_s, LOST_S))
    return at


def left_lost(memory: SiteMemory, name: str, grant: Grant, site: SiteLimits) -> bool:
    """Return whether the fleet sees a robot away from the station that charged it, although the station
    cannot show that the charge has ended."""
    standing = memory.robots.get(grant.robot)
    if standing is None or memory.stands_at(grant.robot, site) == name:
        return False
    return standing.at >= max(hopeless_at(memory, name, grant), standing.here_since + PROVEN_S)


def absent_at(memory: SiteMemory, name: str, grant: Grant, site: SiteLimits) -> float:
    """Return the time when a robot that does not drive to its assigned station loses it; NEVER for
    other robots."""
    stays = memory.may_speak and grant.shown and stays_away(memory, name, grant, site)
    return grant.made_at + COMES_S if stays else NEVER


# ---- the side at fault


def _acquitted(
    memory: SiteMemory, name: str, before: StationSeen | None, now: float, site: SiteLimits
) -> SiteMemory:
    """Forget the failures of robots at this station if its states prove that the station was at
    fault."""
    for who, failed_at in memory.strikes.items():
        if name in failed_at and _was_the_stations(memory, who, name, before, now, site):
            left = tuple(station for station in failed_at if station != name)
            rest = without(memory.strikes, who)
            memory = replace(memory, strikes=rest | ({who: left} if left else {}))
    return memory


def _was_the_stations(
    memory: SiteMemory,
    who: RobotName,
    name: str,
    before: StationSeen | None,
    now: float,
    site: SiteLimits,
) -> bool:
    """Return whether the station was at fault. The station was at fault if its error names the station,
    or if the error lasted after the robot had left."""
    seen, standing = memory.stations[name], memory.robots.get(who)
    if seen.state is ERROR:
        return diagnosis(seen.error.removeprefix(OUT_OF_SERVICE)) is FaultCause.STATION
    failed = before and before.diagnosis in (FaultCause.STATION, FaultCause.UNCLEAR)
    if not failed or standing is None or memory.stands_at(who, site) == name:
        return False
    return now >= standing.here_since + PROVEN_S


def _proven(memory: SiteMemory, now: float) -> SiteMemory:
    """Forget the failures of robots that are being charged."""
    for who in memory.strikes:
        if now >= proven_at(memory, who):
            memory = replace(memory, strikes=without(memory.strikes, who))
    return memory


def proven_at(memory: SiteMemory, who: RobotName) -> float:
    """Return the time when the present charge has lasted long enough to prove that the robot can be
    charged."""
    station = memory.station_of(who)
    seen = memory.stations.get(station or "")
    if station is None or seen is None or not memory.grants[station].started:
        return NEVER
    return seen.since + PROVEN_S if seen.state is CHARGING else NEVER
