"""The assignment of stations to robots. The robot that came first chooses first, and gets its best
suitable station that is free.

A station is free under four conditions:
- Its last state is IDLE, and is no older than STATION_SILENT_S.
- No robot has the station.
- The station has not lately failed to take a request.
- No other robot stands at the station.

A robot may stand on a station's pad without a request, so that the station shows an error or an
unrequested charge. Such a robot may have that very station. A released robot that still stands at a
station may have that station too.

If a robot has failed at a station, the robot first tries every other suitable station, and waits for
one that is busy. A second station shows which side is at fault. If every other station is out of order,
the robot tries the station where it has failed.

If another node publishes a charging schedule, a robot gets the station that the schedule has dedicated
to the robot. The reason is that RMF drives the robot to no other station. A robot without a dedicated
station may have the station where it stands.
"""

from collections.abc import Mapping, Sequence

from msgspec.structs import replace

from bridges.kinds.charger.pad import misplaced_in
from bridges.kinds.charger.report import UNREQUESTED
from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator.memory import (
    CHARGING,
    IDLE,
    NODE,
    RELEASED,
    Grant,
    SiteLimits,
    SiteMemory,
    Wish,
)
from bridges.kinds.charger_coordinator.stations import LOST_S

Here = Mapping[str, Sequence[RobotName]]
"""The robots standing at each station."""


def allot(memory: SiteMemory, now: float, site: SiteLimits) -> SiteMemory:
    """Give the free stations to the waiting robots, in the order of the queue."""
    waiting, here = queued_and_standing(memory, site)
    for wish in waiting:
        stations = suiting(memory, wish, now, site)
        station = next((s for s in stations if _free(memory, s, wish.robot, now, here)), None)
        if station is not None:
            memory = _granted(memory, wish, station, now, site)
    return memory


def _granted(
    memory: SiteMemory, wish: Wish, station: str, now: float, site: SiteLimits
) -> SiteMemory:
    count = memory.count + 1
    request_id = f"{NODE}/{wish.robot}/{count}"
    timeout_s = wish.start_timeout_s or site.start_timeout_s
    grant = Grant(wish.robot, request_id, now, timeout_s)
    return replace(memory, count=count).with_grant(station, grant)


def queued(memory: SiteMemory) -> list[Wish]:
    """List the wishes without a station, in the order of service."""
    allotted = memory.allotted
    return [wish for wish in memory.wishes if wish.robot not in allotted]


def queued_and_standing(memory: SiteMemory, site: SiteLimits) -> tuple[list[Wish], Here]:
    """List the wishes without a station, and the robots at each station. If no robot waits, nobody's
    place matters, and no station is listed."""
    waiting = queued(memory)
    return waiting, standing(memory, site) if waiting else {}


def suiting(memory: SiteMemory, wish: Wish, now: float, site: SiteLimits) -> list[str]:
    """List the stations to try, best first.

    The operator's choice comes first, then the station at the robot's place, then the dedicated
    station. The other suitable stations follow in the YAML's order. A station where the robot has
    failed is left out, unless all the others are out of order.

    If another node publishes the schedule, list only the operator's choice and the dedicated station.
    For a robot without a dedicated station, list the station where it stands in place of the dedicated
    one.
    """
    here = memory.stands_at(wish.robot, site)
    dedicated = memory.preferred.get(wish.robot)
    if not memory.alone:
        scheduled = here or "" if dedicated is None else dedicated
        return [s for s in dict.fromkeys((wish.station, scheduled)) if s in site.places]
    suit, failed = site.robots[wish.robot], memory.strikes.get(wish.robot, ())
    untried = [station for station in suit if station not in failed]
    to_try = suit if all(_out_of_order(memory, name, now) for name in untried) else untried
    first = (wish.station, here, dedicated)
    return sorted(to_try, key=lambda s: first.index(s) if s in first else len(first))


def _out_of_order(memory: SiteMemory, station: str, now: float) -> bool:
    """Return whether the station does not serve robots. A silence or an error does not count at once,
    because the station's daemon may only have been restarted."""
    if now >= memory.silent_since(station) + LOST_S or now < memory.shunned.get(station, now):
        return True
    seen = memory.stations.get(station)
    return seen is not None and seen.out_of_service and now >= seen.since + LOST_S


def _free(memory: SiteMemory, station: str, robot: RobotName, now: float, here: Here) -> bool:
    if not memory.speaks(station, now) or now < memory.shunned.get(station, now):
        return False
    if in_the_way(here, station, robot):
        return False
    seen, grant = memory.stations[station], memory.grants.get(station)
    if grant is not None:
        released = grant.over and grant.robot == seen.robot == robot and seen.state is RELEASED
        return released and robot in here.get(station, ())
    if seen.robot != robot or not seen.request_id.startswith(UNREQUESTED):
        return seen.state is IDLE
    stands_there = misplaced_in(seen.error)
    is_refused = stands_there is not None and stands_there.robot == robot
    return is_refused or seen.state in (IDLE, CHARGING)


def standing(memory: SiteMemory, site: SiteLimits) -> Here:
    """List the robots at each station.

    A robot whose fleet has fallen silent still stands where the fleet last saw it, because nothing
    drives a robot away while its fleet adapter is dead. Another robot would drive into it. After an
    operator's reset such a robot no longer counts.
    """
    here: dict[str, list[RobotName]] = {}
    for who, place in memory.places.items():
        station = site.station_at(who.fleet, place)
        if station is not None:
            here.setdefault(station, []).append(who)
    return here


def in_the_way(here: Here, station: str, robot: RobotName) -> RobotName | None:
    """Find another robot that stands at the station; None if there is no other."""
    return next((who for who in here.get(station, ()) if who != robot), None)
