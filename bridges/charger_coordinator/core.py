"""The coordinator's core: which robot charges where, for all stations of a site.

Its inputs are FleetState, ChargerState and the requests of operators. It sends ChargerRequest and
ChargerCancel, which no part of RMF does. A wish is a robot's need to be charged. Rules:
1. A robot has a wish once its fleet has shown it CHARGING or DOCKING at one of our waypoints for
   SETTLES_S. The wish lasts while the fleet shows that, or shows the robot on its way in the same
   task. The mode alone is not enough: RMF's fleet adapter leaves it at CHARGING through the tasks that
   follow (rmf_ros2 9dedd0f, RobotContext::current_mode, set by WaitForCharge and DockRobot only). An
   operator's wish lasts until its request is over or the robot is full.
2. Wishes are served first come, first served, among the suitable stations (`queue.py`). A station has
   one robot at a time. It is given to another only after its state shows that it has let the first go.
3. A request is repeated until the station shows it. A station that does not take it within TAKEN_S is
   passed over for SHUNNED_S, and the wish goes to the end of the queue.
4. The station's state shows how a request ends. Released after charging: the wish is fulfilled.
   Released without charging: the robot did not come. Then a fleet's wish goes to the end of the queue
   if its robot stands at one of our waypoints; any other wish is over. If the robot stands at that very
   station, it has failed there.
5. After an error of the station, the robot gets another station and keeps its place in the queue. An
   error of the robot, or one of an unclear side, also counts as a failure of the robot. After its
   second failure (at a second station if it has one) it is not tried again, and a technician is told.
   If another robot is on the pad, the assigned one keeps the station for its start_timeout.
6. A station that cannot be reached says nothing about the charge. A robot that was charging there
   keeps it; one that was on its way gets another station after LOST_S.
7. A request for one of our robots counts as that robot's, even if another node has made it.
8. During the quiet start, and while a charging schedule publishes, it only listens.
"""

from typing import Final

from msgspec.structs import replace

from bridges.charger.report import UNREQUESTED, Diagnosis
from bridges.charger.settings import Robot
from bridges.charger_coordinator import report
from bridges.charger_coordinator.memory import (
    ASSIGNED,
    CHARGING,
    ERROR,
    IDLE,
    NODE,
    RELEASED,
    Grant,
    Memory,
    Seen,
    Site,
    Standing,
    Wish,
    without,
)
from bridges.charger_coordinator.queue import allot
from bridges.charger_coordinator.report import SiteReport
from bridges.charger_coordinator.signals import (
    Dedicated,
    Event,
    FleetSeen,
    Sighting,
    StateHeard,
    Unwanted,
    Wanted,
)
from bridges.core.decision import Decision, OperatorReset
from bridges.core.durations import AGES_AGO, NEVER
from bridges.core.graph_kind import MaySpeak

SETTLES_S: Final = 2.0
"""A robot that passes by on another task may still show the mode CHARGING."""
TAKEN_S: Final = 10.0
SHUNNED_S: Final = 30.0
LOST_S: Final = 30.0

Decided = Decision[Memory, None, SiteReport]


def initial(subject: str, started_at: float) -> Memory:
    """Nothing has been heard."""
    return Memory(began_at=started_at)


def idle(memory: Memory, now: float) -> bool:
    """Never: the one subject is the site."""
    return False


def decide(memory: Memory, event: Event, now: float, site: Site) -> Decided:
    """Take the event in, allot free stations, and send what is due. Never raises."""
    memory, refused = _take(memory, event, now, site)
    memory = _in_time(_adopted(memory, now, site), now)
    if memory.may_speak:
        memory = allot(memory, now, site)
    shown = report.report(memory, now, site)
    memory, publish = report.messages(memory, shown.faults, now, site)
    return Decision(memory, None, shown, _wake_at(memory, now, site), refused, publish)


def _take(memory: Memory, event: Event, now: float, site: Site) -> tuple[Memory, str]:
    match event:
        case FleetSeen(robots):
            for sighting in robots:
                memory = _sighted(memory, sighting, now, site)
            return memory, ""
        case StateHeard():
            return _heard(memory, event, now, site), ""
        case Wanted():
            return _wanted(memory, event, site)
        case Unwanted(request_id):
            return _unwanted(memory, request_id)
        case Dedicated(stations):
            return replace(memory, preferred={**memory.preferred, **dict(stations)}), ""
        case MaySpeak(yes):
            return _may_speak(memory, yes, now), ""
        case OperatorReset():
            return replace(memory, strikes={}, shunned={}), ""
        case _:  # only time has passed
            return memory, ""


def _may_speak(memory: Memory, yes: bool, now: float) -> Memory:
    """A request that no station has shown yet counts from now; assignments are published again."""
    grants = {
        name: grant if grant.shown else replace(grant, made_at=now)
        for name, grant in memory.grants.items()
    }
    return replace(memory, may_speak=yes, grants=grants, assigned=())


# ---- wishes


def _sighted(memory: Memory, sighting: Sighting, now: float, site: Site) -> Memory:
    who = sighting.who
    standing = _standing(memory.robots.get(who), sighting, now)
    memory = replace(memory, robots={**memory.robots, who: standing})
    if who in memory.served and memory.served[who] != sighting.task_id:
        memory = replace(memory, served=without(memory.served, who))
    wish = memory.wish(who)
    if wish is not None and wish.by == "operator":
        return _fulfilled(memory.takes_back(who), who) if _is_full(memory, who, site) else memory
    wants = not memory.faulty(who) and _wants(memory, standing, wish, now, site)
    if wish is None and wants:
        wish = Wish(who, "fleet", sighting.task_id)
        served = without(memory.served, who)
        return replace(memory, wishes=(*memory.wishes, wish), served=served)
    if wish is not None and not wants:
        full = _is_full(memory, who, site)
        memory = memory.takes_back(who)
        return _fulfilled(memory, who) if full else memory.without_wish(who)
    return memory


def _is_full(memory: Memory, who: Robot, site: Site) -> bool:
    """It has been charged, and its fleet shows `full_percent`."""
    grant = memory.grants.get(memory.station_of(who) or "")
    percent = memory.robots[who].sighting.battery_percent
    return grant is not None and grant.started and percent >= site.full_percent


def _standing(before: Standing | None, sighting: Sighting, now: float) -> Standing:
    if before is None:
        return Standing(sighting, now)
    was = before.sighting
    same = (was.place, was.charges) == (sighting.place, sighting.charges)
    return Standing(sighting, now, before.since if same else now)


def _wants(memory: Memory, standing: Standing, wish: Wish | None, now: float, site: Site) -> bool:
    """Does its fleet show that this robot needs to be charged?"""
    sighting = standing.sighting
    if not sighting.charges or sighting.battery_percent >= site.full_percent:
        return False
    if wish is not None:
        under_way = sighting.task_id and sighting.task_id == wish.task_id
        return bool(under_way or sighting.place)
    if sighting.place is None or now < standing.since + SETTLES_S:
        return False
    charged = memory.served.get(sighting.who) == sighting.task_id
    return sighting.battery_percent < site.again_percent if charged else True


def _wanted(memory: Memory, event: Wanted, site: Site) -> tuple[Memory, str]:
    who = event.robot
    if event.request_id in memory.over:
        return memory, "request is over"
    if event.station and event.station not in site.robots[who]:
        return memory, "station does not suit the robot"
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


def _unwanted(memory: Memory, request_id: str) -> tuple[Memory, str]:
    wish = next((w for w in memory.wishes if request_id and w.request_id == request_id), None)
    grants = memory.grants.values()
    granted = next((g.robot for g in grants if g.request_id == request_id and not g.over), None)
    who = wish.robot if wish else granted
    if who is None:
        return memory, "" if request_id in memory.over else "no such wish"
    return memory.takes_back(who).without_wish(who), ""


# ---- stations


def _heard(memory: Memory, heard: StateHeard, now: float, site: Site) -> Memory:
    name, before = heard.station, memory.stations.get(heard.station)
    same = before is not None and (before.state, before.error) == (heard.state, heard.error)
    since = before.since if before is not None and same else now
    seen = Seen(heard.state, heard.request_id, heard.robot, heard.error, now, since)
    memory = replace(memory, stations={**memory.stations, name: seen})
    grant = memory.grants.get(name)
    if grant is not None:
        if heard.state is not IDLE and heard.request_id == grant.request_id:
            return _followed(memory, name, grant, seen, site)
        if not grant.shown and not grant.over and _may_still_come(heard, grant):
            return memory
        memory = _gone(memory, name, grant, site)
    return memory


def _may_still_come(heard: StateHeard, grant: Grant) -> bool:
    """The station may be about to take the request."""
    refused_here = heard.state is ERROR and heard.robot == grant.robot
    return heard.state is IDLE or (refused_here and heard.request_id.startswith(UNREQUESTED))


def _followed(memory: Memory, name: str, grant: Grant, seen: Seen, site: Site) -> Memory:
    """The station shows our request."""
    grant = replace(grant, shown=True, started=grant.started or seen.state is CHARGING)
    memory = memory.with_grant(name, grant)
    if grant.over:
        return memory
    if seen.state is RELEASED:
        memory = _ended(memory, name, grant, site)
        return memory.with_grant(name, replace(grant, over=True))
    if seen.diagnosis in (Diagnosis.ROBOT, Diagnosis.STATION, Diagnosis.UNCLEAR):
        memory = memory.with_grant(name, replace(grant, over=True, sent_at=AGES_AGO))
        return memory if seen.diagnosis is Diagnosis.STATION else _struck(memory, name, grant.robot)
    return memory


def _gone(memory: Memory, name: str, grant: Grant, site: Site) -> Memory:
    """The station no longer shows the request."""
    memory = memory.with_grant(name, None)
    return _ended(memory, name, grant, site) if grant.shown and not grant.over else memory


def _ended(memory: Memory, name: str, grant: Grant, site: Site) -> Memory:
    """A request has ended without our cancel."""
    who, wish = grant.robot, memory.wish(grant.robot)
    if grant.started:
        return _fulfilled(memory, who)
    place = memory.place_of(who)
    if place == site.places[name]:
        memory = _struck(memory, name, who)
    stays = wish is not None and wish.by == "fleet" and place is not None
    return memory.last_in_queue(who) if stays else memory.without_wish(who)


def _fulfilled(memory: Memory, who: Robot) -> Memory:
    """The robot was charged in its present task, so its failures are forgotten."""
    standing = memory.robots.get(who)
    served = {**memory.served, who: standing.sighting.task_id if standing else ""}
    memory = replace(memory, served=served, strikes=without(memory.strikes, who))
    return memory.without_wish(who)


def _struck(memory: Memory, name: str, who: Robot) -> Memory:
    """The robot has failed at this station. After its second failure it is not tried again."""
    strikes = {**memory.strikes, who: (*memory.strikes.get(who, ()), name)}
    memory = replace(memory, strikes=strikes)
    return memory.without_wish(who) if memory.faulty(who) else memory


def _adopted(memory: Memory, now: float, site: Site) -> Memory:
    """Adopt requests that another node has made for our robots."""
    for name, seen in memory.stations.items():
        if name not in memory.grants and seen.state in (ASSIGNED, CHARGING):
            memory = _adopt(memory, name, seen, now, site)
    return memory


def _adopt(memory: Memory, name: str, seen: Seen, now: float, site: Site) -> Memory:
    who = seen.robot or _stands_at(memory, site.places[name])
    if who is None or who not in site.robots:
        return memory
    elsewhere = memory.station_of(who) is not None
    if elsewhere and not seen.request_id.startswith(f"{NODE}/"):
        return memory
    started = seen.state is CHARGING
    grant = Grant(who, seen.request_id, now, shown=True, started=started, over=elsewhere)
    memory = memory.with_grant(name, grant)
    if elsewhere or memory.wish(who) is not None:
        return memory
    return replace(memory, wishes=(*memory.wishes, Wish(who, "operator")))


def _stands_at(memory: Memory, place: str) -> Robot | None:
    """Which robot is charged at this waypoint without a name: one with a wish that stands there."""
    here = (w.robot for w in memory.wishes if memory.place_of(w.robot) == place)
    return next((who for who in here if memory.station_of(who) is None), None)


# ---- time


def _in_time(memory: Memory, now: float) -> Memory:
    """What changes by time alone."""
    for name, grant in list(memory.grants.items()):
        if grant.over or grant.started:
            continue
        if memory.may_speak and not grant.shown and now >= grant.made_at + TAKEN_S:
            shunned = {**memory.shunned, name: now + SHUNNED_S}
            memory = replace(memory, shunned=shunned).with_grant(name, None)
            memory = memory.last_in_queue(grant.robot)
        elif grant.shown and now >= _hopeless_at(memory, name, grant):
            memory = memory.takes_back(grant.robot)
    return memory


def _hopeless_at(memory: Memory, name: str, grant: Grant) -> float:
    """When a robot on its way should get another station. Reasons: we do not hear the station's
    daemon, the daemon does not reach the station, or another robot does not leave the pad."""
    seen, at = memory.stations.get(name), memory.silent_since(name) + LOST_S
    if seen is not None and seen.diagnosis is Diagnosis.LOST:
        at = min(at, seen.since + LOST_S)
    if seen is not None and seen.diagnosis is Diagnosis.PAD:
        at = min(at, seen.since + max(grant.start_timeout_s, LOST_S))
    return at


def _wake_at(memory: Memory, now: float, site: Site) -> float:
    due = [*memory.shunned.values(), *(memory.silent_since(name) for name in site.places)]
    for name, grant in memory.grants.items():
        due.append(_hopeless_at(memory, name, grant) if grant.shown else grant.made_at + TAKEN_S)
    due += report.due(memory)
    return min((at for at in due if at > now), default=NEVER)
