"""What is said: to the stations, to RMF's fleet adapters, and to the technician.

1. A station that does not show our request is asked again each second; one that shows a request that
   is over is told to cancel it each second.
2. Every robot has one place at a time, and no two the same: the station that it has (MODE_CHARGE),
   else the waypoint where it waits (MODE_WAIT). All fleets are told whenever one of the places
   changes, as a fleet adapter that starts later reads them from what is retained. RMF then drives the
   robot there if it has a charging task (rmf_ros2 9dedd0f, ChargeBattery.cpp, _consider_restart).
3. Each fault is an Alert once: rmf-web shows it to a person.
"""

from collections.abc import Iterator
from typing import Any, Final

from msgspec.structs import replace

from bridges.charger_coordinator.memory import ASSIGNED, CHARGING, ERROR, NODE, Grant, Memory
from bridges.charger_coordinator.report import SiteReport
from bridges.charger_coordinator.settings import Site
from bridges.core.decision import Fault
from bridges.rmf import definitions as d
from bridges.rmf.stamps import duration
from bridges.rmf.topics import (
    ALERT,
    CHARGER_CANCELS,
    CHARGER_REQUESTS,
    CHARGING_ASSIGNMENTS,
    Topic,
)

REPEAT_S: Final = 1.0
Words = tuple[tuple[Topic[Any], d.Message], ...]
TITLES: Final = {
    "ROBOT_FAULTY": "A robot cannot be charged",
    "STATION_OUT_OF_SERVICE": "A charger is out of service",
    "STATION_SILENT": "A charger is silent",
    "WRONG_STATION": "A robot is at the wrong charger",
    "REQUEST_NOT_TAKEN": "A charger takes no request",
}
ERRORS: Final = ("ROBOT_FAULTY", "STATION_OUT_OF_SERVICE")


def say(memory: Memory, told: SiteReport, now: float, site: Site) -> tuple[Memory, Words]:
    """What is due now; nothing while it may not speak."""
    if not memory.may_speak:
        return memory, ()
    words: list[tuple[Topic[Any], d.Message]] = []
    for name, grant in memory.grants.items():
        if now >= _due_at(memory, name, grant):
            words.append(_to_station(name, grant))
            memory = memory.with_grant(name, replace(grant, sent_at=now))
    assignments = tuple(_assignments(memory, site))
    if assignments != memory.told:
        words += [(CHARGING_ASSIGNMENTS, message) for message in assignments]
    faults = {str(fault): fault for fault in told.faults}
    words += [(ALERT, _alert(f)) for text, f in faults.items() if text not in memory.alerts]
    memory = replace(memory, told=assignments, alerts=frozenset(faults))
    return memory, tuple(words)


def due(memory: Memory, now: float) -> list[float]:
    """When the stations are to be told."""
    if not memory.may_speak:
        return []
    return [_due_at(memory, name, grant) for name, grant in memory.grants.items()]


def _due_at(memory: Memory, name: str, grant: Grant) -> float:
    seen = memory.stations.get(name)
    if not grant.over:
        return float("inf") if grant.shown else grant.sent_at + REPEAT_S
    shows_it = seen is not None and seen.request_id == grant.request_id
    lets_go = seen is None or seen.state not in (ASSIGNED, CHARGING, ERROR)
    return grant.sent_at + REPEAT_S if shows_it and not lets_go else float("inf")


def _to_station(name: str, grant: Grant) -> tuple[Topic[Any], d.Message]:
    if grant.over:
        return CHARGER_CANCELS, d.ChargerCancel(name, grant.request_id)
    who, timeout = grant.robot, duration(grant.start_timeout_s)
    return CHARGER_REQUESTS, d.ChargerRequest(name, who.fleet, who.name, timeout, grant.request_id)


def _assignments(memory: Memory, site: Site) -> Iterator[d.ChargingAssignments]:
    """Every robot's place, fleet by fleet, in the order of names."""
    fleets: dict[str, list[d.ChargingAssignment]] = {}
    for who in sorted(site.robots):
        station = memory.station_of(who)
        mode = d.ChargingMode.MODE_WAIT if station is None else d.ChargingMode.MODE_CHARGE
        place = site.waits_at[who] if station is None else site.places[station]
        assignment = d.ChargingAssignment(who.name, place, int(mode))
        fleets.setdefault(who.fleet, []).append(assignment)
    return (d.ChargingAssignments(name, tuple(them)) for name, them in fleets.items())


def _alert(fault: Fault) -> d.Alert:
    """Without its id's end, which is the time of sending: rmf-web drops an id that it knows."""
    tier = d.AlertTier.TIER_ERROR if fault.code in ERRORS else d.AlertTier.TIER_WARNING
    return d.Alert(
        id=f"{NODE}/{fault.code}/{fault.detail}",
        title=TITLES.get(fault.code, fault.code),
        subtitle=fault.code,
        message=fault.detail,
        tier=int(tier),
    )
