"""The queue, as shown to a person. For each waiting robot it shows the origin of its wish, the
obstacles to its charge, and its waiting time.

The waiting time is known only if a station reports when its present charge ends. It is given for the
suitable station that becomes free first. The station given to a robot ahead in the queue is left out
for the robots behind it.
"""

from collections.abc import Iterator
from typing import Final

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator.memory import (
    CHARGING,
    ERROR,
    SiteLimits,
    SiteMemory,
)
from bridges.kinds.charger_coordinator.queue import (
    Here,
    in_the_way,
    queued_and_standing,
    suiting,
)
from bridges.kinds.shared.durations import NEVER

MOST: Final = 4
"""The greatest number of stations that the queue shows for one robot."""
MAY_BE_GONE: Final = (
    " was last seen at {station} and its fleet says nothing of it (if it is gone, reset)"
)
"""The end of the clause about a robot of which its fleet says nothing."""


def reasons(memory: SiteMemory, now: float, site: SiteLimits) -> Iterator[str]:
    """Yield a text for each waiting robot, such as `tiny/AMR03 by the robot: charger_b charges
    tiny/AMR01, free in 12 min`."""
    taken: set[str] = set()
    waiting, here = queued_and_standing(memory, site)
    for wish in waiting:
        stations = suiting(memory, wish, now, site)
        left = [name for name in stations if name not in taken]
        first = min(left, key=lambda name: free_in_s(memory, name, now), default=None)
        texts = [_obstacle(memory, name, wish.robot, now, here) for name in stations[:MOST]]
        if len(stations) > MOST:
            texts.append(f"and {len(stations) - MOST} more")
        if first is not None and (wait_s := free_in_s(memory, first, now)) < NEVER:
            taken.add(first)
            texts.append(f"{first} is free in {_lasts(wait_s)}")
        why = ", ".join(texts) or "the charging schedule has no station for this robot"
        why = why if memory.may_speak else memory.passive
        yield f"{wish.robot} {wish.whose}: {why}"


def free_in_s(memory: SiteMemory, station: str, now: float) -> float:
    """Return the remaining time of the charge (s), as the station reports it; NEVER if not known."""
    seen = memory.stations.get(station)
    if seen is None or seen.state is not CHARGING or not seen.full_in_s:
        return NEVER
    return max(0.0, seen.at + seen.full_in_s - now)


def _obstacle(memory: SiteMemory, station: str, robot: RobotName, now: float, here: Here) -> str:
    """Explain why the robot does not have this station."""
    seen, grant = memory.stations.get(station), memory.grants.get(station)
    if seen is None or not memory.speaks(station, now):
        return f"{station} is silent"
    if now < memory.shunned.get(station, now):
        return f"{station} takes no request"
    if grant is not None and not grant.over:
        does = "charges" if grant.started else "is assigned to"
        return f"{station} {does} {grant.robot}"
    other = in_the_way(here, station, robot)
    if other is not None:
        return where(memory, other, station, now)
    if seen.state is ERROR:
        return f"{station} is out of service"
    return f"{station} is not free yet"


def where(memory: SiteMemory, robot: RobotName, station: str, now: float) -> str:
    """Return a clause such as `tiny/AMR02 stands at charger_a`. It says so if the robot's fleet says
    nothing of it, because only a person knows whether that robot is still there."""
    if not memory.unheard(robot, now):
        return f"{robot} stands at {station}"
    return f"{robot}{MAY_BE_GONE.format(station=station)}"


def _lasts(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"
