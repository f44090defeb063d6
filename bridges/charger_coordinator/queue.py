"""Who gets which station: first come, first served, among the stations that suit.

A station is free when its last state, no older than STATION_SILENT_S, is IDLE, nobody has it, it has
not just failed to take a request, and no other robot stands there. A robot that turned up at a station
without a request, and is refused there as such, may have that very station.

Where a robot has failed already it is tried again only if nothing else suits it: a second station
tells whose fault it was.
"""

from collections.abc import Iterator
from typing import Final

from msgspec.structs import replace

from bridges.charger.pad import misplaced_in
from bridges.charger.report import UNREQUESTED
from bridges.charger.settings import Robot
from bridges.charger_coordinator.memory import ERROR, IDLE, NODE, Grant, Memory, Site, Wish

REMEMBERED_S: Final = 30.0
"""Where a robot was seen by its fleet counts for so long."""


def allot(memory: Memory, now: float, site: Site) -> Memory:
    """Give what is free to who waits, in their order."""
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
    return (s for s in _suiting(memory, wish, site) if _free(memory, s, wish.robot, now, site))


def _suiting(memory: Memory, wish: Wish, site: Site) -> list[str]:
    """The stations to try, best first: as asked, where it stands, as dedicated, as the YAML says."""
    suiting, failed = site.robots[wish.robot], memory.strikes.get(wish.robot, ())
    untried = [station for station in suiting if station not in failed] or list(suiting)
    stands_at = site.station_at(memory.place_of(wish.robot))
    first = (wish.station, stands_at, memory.preferred.get(wish.robot))
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
    """Another robot that stands at the station by its fleet's word."""
    return next(
        (
            who
            for who, standing in memory.robots.items()
            if who != robot
            and now < standing.at + REMEMBERED_S
            and standing.sighting.place == site.places[station]
        ),
        None,
    )
