"""What stations, fleet adapters, technicians, log and status file are told.

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

import msgspec
from msgspec.structs import replace

from bridges.charger.pad import misplaced_in
from bridges.charger.report import Diagnosis
from bridges.charger.settings import Robot
from bridges.charger_coordinator.memory import (
    ASSIGNED,
    CHARGING,
    ERROR,
    NODE,
    Grant,
    Memory,
    Seen,
    Site,
)
from bridges.core.decision import Fault
from bridges.core.durations import due_at
from bridges.rmf import definitions as d
from bridges.rmf.stamps import duration
from bridges.rmf.topics import (
    ALERT,
    CHARGER_CANCELS,
    CHARGER_REQUESTS,
    CHARGING_ASSIGNMENTS,
    AnyTopic,
)

Messages = tuple[tuple[AnyTopic, d.Message], ...]
TITLES: Final = {
    "ROBOT_FAULTY": "A robot cannot be charged",
    "STATION_OUT_OF_SERVICE": "A charger is out of service",
    "STATION_SILENT": "A charger is silent",
    "WRONG_STATION": "A robot is at the wrong charger",
    "REQUEST_NOT_TAKEN": "A charger takes no request",
}
ERRORS: Final = ("ROBOT_FAULTY", "STATION_OUT_OF_SERVICE")


class SiteReport(msgspec.Struct, frozen=True):
    """`read_at`: when a station was heard last (monotonic s). `stations`: (station, who has it or
    what it shows). `queue`: the robots that wait, in their order."""

    read_at: float | None
    stations: tuple[tuple[str, str], ...] = ()
    queue: tuple[str, ...] = ()
    faults: tuple[Fault, ...] = ()

    def news(self) -> Any:
        """What is worth a line in the log."""
        return self.stations, self.queue


def report(memory: Memory, now: float, site: Site) -> SiteReport:
    """As it is now."""
    queue = [w.robot for w in memory.wishes if memory.station_of(w.robot) is None]
    return SiteReport(
        read_at=max((seen.at for seen in memory.stations.values()), default=None),
        stations=tuple((name, _of(memory, name)) for name in site.places),
        queue=tuple(map(str, queue)),
        faults=tuple(_faults(memory, now, site)),
    )


def _of(memory: Memory, name: str) -> str:
    """`CHARGING fleet/robot`, `IDLE`, or `?` before the first state."""
    seen, grant = memory.stations.get(name), memory.grants.get(name)
    state = "?" if seen is None else seen.state.name.removeprefix("CHARGER_")
    return state if grant is None or grant.over else f"{state} {grant.robot}"


def _faults(memory: Memory, now: float, site: Site) -> Iterator[Fault]:
    for who, stations in memory.strikes.items():
        if memory.faulty(who):
            what = f"{who} failed at {' and at '.join(stations)}: not tried again"
            yield Fault("ROBOT_FAULTY", what)
    for name in site.places:
        if now >= memory.silent_since(name):
            yield Fault("STATION_SILENT", f"{name}: no ChargerState comes")
        elif name in memory.stations:
            yield from _shown(memory, name, memory.stations[name], site)
        if now < memory.shunned.get(name, now):
            yield Fault("REQUEST_NOT_TAKEN", f"{name}: its daemon's log says why")


def _shown(memory: Memory, name: str, seen: Seen, site: Site) -> Iterator[Fault]:
    """By what the station says of itself."""
    if seen.diagnosis in (Diagnosis.STATION, Diagnosis.LOST, Diagnosis.UNCLEAR):
        yield Fault("STATION_OUT_OF_SERVICE", f"{name}: {seen.error}")
    if seen.diagnosis is not Diagnosis.PAD:
        return
    who = on_pad(seen.error, site)
    expected = memory.station_of(who) if who else None
    if who is None or expected != name:
        belongs = f"it is expected at {expected}" if expected else "nobody asked for that"
        what = who or _stranger(seen.error)
        yield Fault("WRONG_STATION", f"{what} stands at {name}, {belongs}")


def on_pad(error: str, site: Site) -> Robot | None:
    """Which robot of ours stands on a pad by its station's error; None for another's."""
    found = misplaced_in(error)
    if found is None:
        return None
    if found.robot is None:
        return site.receivers.get(found.receiver)
    return found.robot if found.robot in site.robots else None


def _stranger(error: str) -> str:
    found = misplaced_in(error)
    return f"unknown receiver {found.receiver}" if found and found.receiver else "an unknown robot"


# ---- messages


def messages(
    memory: Memory, faults: tuple[Fault, ...], now: float, site: Site
) -> tuple[Memory, Messages]:
    """What is to be sent now; nothing while it may not speak."""
    if not memory.may_speak:
        return memory, ()
    found: list[tuple[AnyTopic, d.Message]] = []
    for name, grant in memory.grants.items():
        if now >= _due_at(memory, name, grant):
            found.append(_to_station(name, grant))
            memory = memory.with_grant(name, replace(grant, sent_at=now))
    assignments = tuple(_assignments(memory, site))
    if assignments != memory.assigned:
        found += [(CHARGING_ASSIGNMENTS, message) for message in assignments]
    new = {str(fault): fault for fault in faults}
    found += [(ALERT, _alert(f)) for text, f in new.items() if text not in memory.alerts]
    memory = replace(memory, assigned=assignments, alerts=frozenset(new))
    return memory, tuple(found)


def due(memory: Memory) -> list[float]:
    """When the stations are to be told."""
    if not memory.may_speak:
        return []
    return [_due_at(memory, name, grant) for name, grant in memory.grants.items()]


def _due_at(memory: Memory, name: str, grant: Grant) -> float:
    seen = memory.stations.get(name)
    if not grant.over:
        return due_at(grant.sent_at, new=False, again=not grant.shown)
    shows_it = seen is not None and seen.request_id == grant.request_id
    lets_go = seen is None or seen.state not in (ASSIGNED, CHARGING, ERROR)
    return due_at(grant.sent_at, new=False, again=shows_it and not lets_go)


def _to_station(name: str, grant: Grant) -> tuple[AnyTopic, d.Message]:
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
