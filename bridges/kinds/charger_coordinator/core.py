"""The coordinator's core: it assigns all stations of a site to robots.

The core's inputs are FleetState, ChargerState and the requests of operators. The core sends
ChargerRequest and ChargerCancel, which no part of RMF sends. A wish is a robot's need to be charged.

Rules:
COORDINATOR-1. `wishes.py` finds the robots with a wish. An operator's wish lasts until the operator's
   request is over or the robot is full.
COORDINATOR-2. Wishes are served in the order of their arrival, each at one of the robot's suitable
   stations (`queue.py`). A station has one robot at a time. The next robot gets the station only after
   the station's state shows that the first robot was released.
COORDINATOR-3. A request is repeated until the station's state shows the request. If the station does
   not show the request within TAKEN_S, the coordinator does not use the station for SHUNNED_S. The wish
   then goes to the end of the queue.
COORDINATOR-4. The stations' states show when a request has ended, and whether the robot or the station
   was at fault (`stations.py`).
COORDINATOR-5. The coordinator tells a robot on a wrong pad to leave the pad, or alerts a person
   (`wrong_pad.py`).
COORDINATOR-6. If another node requests a station for one of our robots, the coordinator treats that
   request like a request of its own.
COORDINATOR-7. During the quiet start, which is the first `quiet_start_s`, the coordinator only listens.
   If another node publishes charging assignments (RMF's rmf_charging_schedule), the coordinator sends
   no assignments. It then requests the stations that the other node has dedicated to the robots.
"""

from msgspec.structs import replace

from bridges.kinds.charger_coordinator import report, stations, wishes, wrong_pad
from bridges.kinds.charger_coordinator.memory import SiteLimits, SiteMemory
from bridges.kinds.charger_coordinator.queue import allot, suiting
from bridges.kinds.charger_coordinator.report import SiteReport
from bridges.kinds.charger_coordinator.signals import (
    ChargerStateHeard,
    ChargeUnwanted,
    ChargeWanted,
    Dedicated,
    Event,
    FleetSeen,
    ReceiverHeard,
)
from bridges.kinds.shared.decision import Decision, OperatorReset
from bridges.kinds.shared.durations import NEVER
from bridges.kinds.shared.graph_kind import MaySpeak

Decided = Decision[SiteMemory, None, SiteReport]


def initial(subject: str, started_at: float) -> SiteMemory:
    """Return the memory at start, before any message was heard."""
    return SiteMemory(began_at=started_at)


def idle(memory: SiteMemory, now: float) -> bool:
    """Return False: the only subject is the whole site, and the site is never forgotten."""
    return False


def decide(memory: SiteMemory, event: Event, now: float, site: SiteLimits) -> Decided:
    """Apply the event, allot free stations, and publish the messages that are due. Never raises."""
    memory, refused = _take(memory, event, now, site)
    memory = stations.in_time(stations.adopted(memory, now, site), now, site)
    if memory.may_speak:
        memory = allot(_as_dedicated(memory, now, site), now, site)
    memory = wrong_pad.nudged(memory, now, site)
    shown = report.report(memory, now, site)
    memory, publish = report.messages(memory, shown.faults, now, site)
    return Decision(memory, None, shown, _wake_at(memory, now, site), refused, publish)


def _take(memory: SiteMemory, event: Event, now: float, site: SiteLimits) -> tuple[SiteMemory, str]:
    match event:
        case FleetSeen(robots, when):
            memory = replace(memory, when=when)
            for sighting in robots:
                memory = wishes.sighted(memory, sighting, now, site)
            return memory, ""
        case ChargerStateHeard():
            return stations.heard(memory, event, now, site), ""
        case ReceiverHeard(robot, error):
            return replace(memory, receivers={**memory.receivers, robot: error}), ""
        case ChargeWanted():
            return wishes.wanted(memory, event, site)
        case ChargeUnwanted(request_id):
            return wishes.unwanted(memory, request_id)
        case Dedicated(dedicated):
            return replace(memory, preferred={**memory.preferred, **dict(dedicated)}), ""
        case MaySpeak(yes=yes, alone=alone, waits=passive):
            return _may_speak(replace(memory, passive=passive), yes, alone, now), ""
        case OperatorReset():
            memory = memory.without_unheard(now)
            return replace(memory, strikes={}, shunned={}, absent={}, nudges={}), ""
        case _:  # only time has passed
            return memory, ""


def _may_speak(memory: SiteMemory, yes: bool, alone: bool, now: float) -> SiteMemory:
    """Start or stop publishing. After the change, each station again has TAKEN_S to show its request,
    and all assignments are sent again."""
    grants = {
        name: grant if grant.shown else replace(grant, made_at=now)
        for name, grant in memory.grants.items()
    }
    return replace(memory, may_speak=yes, alone=alone, grants=grants, assigned=(), nudges={})


def _as_dedicated(memory: SiteMemory, now: float, site: SiteLimits) -> SiteMemory:
    """Take a station back from a robot on its way if another node's schedule has dedicated another
    station to the robot. The reason is that RMF drives the robot only to the dedicated station."""
    if memory.alone:
        return memory
    for name, grant in memory.grants.items():
        wish = memory.wish(grant.robot)
        on_its_way = wish is not None and not grant.over and not grant.started
        if wish is not None and on_its_way and name not in suiting(memory, wish, now, site):
            memory = memory.takes_back(grant.robot)
    return memory


def _wake_at(memory: SiteMemory, now: float, site: SiteLimits) -> float:
    due = [*memory.shunned.values(), *(memory.silent_since(name) for name in site.places)]
    for name, grant in memory.grants.items():
        if grant.shown:
            due.append(stations.hopeless_at(memory, name, grant))
            due.append(stations.absent_at(memory, name, grant, site))
        else:
            due.append(stations.not_taken_at(grant))
    due += [stations.proven_at(memory, who) for who in memory.strikes]
    due += report.due(memory, site)
    due += wrong_pad.due(memory, site)
    return min((at for at in due if at > now), default=NEVER)
