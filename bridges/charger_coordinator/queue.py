"""Who gets which station: first come, first served, among the suitable stations.

A station is free if its last state is IDLE and no older than STATION_SILENT_S, no robot has it, it has
not just failed to take a request, and no other robot stands there. A robot that stands on a station's
pad without a request, so that the station shows an error, may have that very station.

A station where a robot has failed is tried again only if no other one suits the robot: a second
station shows which side was at fault.

Beside another node's charging schedule, a robot gets the station that the schedule has dedicated to it:
RMF drives it to no other. A robot that the schedule does not name may have the one where it stands.
"""

from collections.abc import Iterator
from typing import Final

from msgspec.structs import replace

from bridges.charger.pad import misplaced_in
from bridges.charger.report import UNREQUESTED
from bridges.charger.settings import Robot
from bridges.charger_coordinator.memory import ERROR, IDLE, NODE, Grant, Memory, Site, Wish

REMEMBERED_S: Final = 30.0
"""How long a robot's last place counts, after its fleet has shown it."""


def allot(memory: Memory, now: float, site: Site) -> Memory:
    """Give the free stations to the robots that wait, in the order of the queue."""
    for wish in memory.wishes:
        if memory.station_of(wish.robot) is None:
            station = next(_free_for(memory, wish, now, site), None)
            if station is not None:
                memory = _granted(memory, wish, station, now, site)
    return memory


def _granted(memory: Memory, wish: Wish, station: str, now: float, site: Site) -> Memory:
    count = memory.count + 1
    request_id = f"{NODE}/{wish.robot}/{count}"
    timeout_s = wish.start_timeout_s or site.start_timeout_s
    grant = Grant(wish.robot, request_id, now, timeout_s)
    return replace(memory, count=count).with_grant(station, grant)


def _free_for(memory: Memory, wish: Wish, now: float, site: Site) -> Iterator[str]:
    return (s for s in suiting(memory, wish, site) if _free(memory, s, wish.robot, now, site))


def suiting(memory: Memory, wish: Wish, site: Site) -> list[str]:
    """The stations to try, best first: the operator's, the one where it stands, the dedicated one, then
    the YAML's order."""
    here = memory.stands_at(wish.robot, site)
    dedicated = memory.preferred.get(wish.robot)
    if not memory.alone:
        scheduled = here or "" if dedicated is None else dedicated
        return [s for s in dict.fromkeys((wish.station, scheduled)) if s in site.places]
    suit, failed = site.robots[wish.robot], memory.strikes.get(wish.robot, ())
    untried = [station for station in suit if station not in failed] or list(suit)
    first = (wish.station, here, dedicated)
    return sorted(untried, key=lambda s: first.index(s) if s in first else len(first))


def _free(memory: Memory, station: str, robot: Robot, now: float, site: Site) -> bool:
    if not memory.speaks(station, now) or now < memory.shunned.get(station, now):
        return False
    if station in memory.grants or in_the_way(memory, station, robot, now, site):
        return False
    seen = memory.stations[station]
    if seen.state is not ERROR:
        return seen.state is IDLE
    stands_there = misplaced_in(seen.error)
    is_refused = stands_there is not None and seen.robot == stands_there.robot == robot
    return is_refused and seen.request_id.startswith(UNREQUESTED)


def in_the_way(
    memory: Memory, station: str, robot: Robot | None, now: float, site: Site
) -> Robot | None:
    """Another robot that stands at the station, by its fleet's state; None if there is none."""
    return next(
        (
            who
            for who, standing in memory.robots.items()
            if who != robot
            and now < standing.at + REMEMBERED_S
            and memory.stands_at(who, site) == station
        ),
        None,
    )
