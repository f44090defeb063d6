"""Messages to stations, fleet adapters and technicians, and the report to the log and the status file.

COORDINATOR-REPORT-1. A request is repeated each second until its station shows the request. A cancel is
   repeated each second while the station still shows the cancelled request.
COORDINATOR-REPORT-2. Every robot is assigned exactly one place. A robot with a station is assigned that
   station (MODE_CHARGE). A robot without a station is assigned its waypoint for waiting (MODE_WAIT).
   When a place changes, the assignments of all fleets are published. The publisher retains these
   messages for fleet adapters that start later. RMF drives a robot with a charging task to its assigned
   place (rmf_ros2 9dedd0f, ChargeBattery.cpp, _consider_restart).
COORDINATOR-REPORT-3. Each fault is sent once as an Alert, which rmf-web shows to a person. The fault of
   a station that took no request lasts through the next attempts, until the station shows a request.
"""

from collections.abc import Iterator
from typing import Final

import msgspec
from msgspec.structs import replace

from bridges.kinds.charger.pad import misplaced_in
from bridges.kinds.charger.report import FaultCause, diagnosis
from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator import wrong_pad
from bridges.kinds.charger_coordinator.memory import (
    ASSIGNED,
    CHARGING,
    ERROR,
    NODE,
    Grant,
    SiteLimits,
    SiteMemory,
    StationSeen,
)
from bridges.kinds.charger_coordinator.queue import queued
from bridges.kinds.charger_coordinator.reasons import reasons, where
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import due_at
from bridges.messages import definitions as d
from bridges.messages.stamps import duration
from bridges.messages.topics import (
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
    "PAD_BLOCKED": "A robot blocks a charger",
    "RECEIVER_ERROR": "A robot's receiver reports an error",
    "REQUEST_NOT_TAKEN": "A charger takes no request",
}
ASKS_S: Final = 5.0
"""The time (s) for which a robot may stand on a pad without a wish before this is a fault. Normally the
fleet's next state brings the wish within this time."""
AGAIN_S: Final = 15.0
ERRORS: Final = ("ROBOT_FAULTY", "STATION_OUT_OF_SERVICE")


class SiteReport(msgspec.Struct, frozen=True):
    """The site, as shown to a person.

    `read_at`: the time of the last state of any station (monotonic s). `stations`: pairs of a station's
    name and a text. The text has the station's state, its robot, and the origin of the robot's wish.
    `queue`: the waiting robots in order, with their reasons. `waiting`: the waiting robots without
    reasons. `assigns`: whether this coordinator publishes the robots' places, or another node does.
    `schedule`: the times of the schedule. `absent`: robots that did not drive to their assigned
    station.
    """

    read_at: float | None
    stations: tuple[tuple[str, str], ...] = ()
    queue: tuple[str, ...] = ()
    waiting: tuple[RobotName, ...] = ()
    assigns: str = ""
    schedule: tuple[str, ...] = ()
    absent: tuple[RobotName, ...] = ()
    faults: tuple[Fault, ...] = ()

    def news(self) -> object:
        """Return the facts whose change is logged. Durations are left out, because they change all the
        time."""
        return self.stations, self.waiting, self.assigns, self.schedule, self.absent


def report(memory: SiteMemory, now: float, site: SiteLimits) -> SiteReport:
    """Report the present state of the site."""
    waiting = queued(memory)
    return SiteReport(
        read_at=max((seen.at for seen in memory.stations.values()), default=None),
        stations=tuple((name, _of(memory, name, now, site)) for name in site.places),
        queue=tuple(reasons(memory, now, site)),
        waiting=tuple(wish.robot for wish in waiting),
        assigns=_assigns(memory),
        schedule=tuple(one.text(memory.when) for one in site.schedule),
        absent=tuple(who for who, until in memory.absent.items() if now < until),
        faults=tuple(_faults(memory, now, site)),
    )


def _assigns(memory: SiteMemory) -> str:
    if memory.alone:
        return "yes" if memory.may_speak else "no"
    return "no: another node publishes charging_assignments"


def _of(memory: SiteMemory, name: str, now: float, site: SiteLimits) -> str:
    """Describe a station: `CHARGING fleet/robot, by the schedule`, or `IDLE`. Before the first state
    the text is `?`. The state of a silent station is in the past: `was IDLE`."""
    seen, grant = memory.stations.get(name), memory.grants.get(name)
    state = "?" if seen is None else seen.state.name.removeprefix("CHARGER_")
    if seen is not None and now >= memory.silent_since(name):
        state = f"silent, was {state}"
    if grant is None or grant.over:
        return state
    wish = memory.wish(grant.robot)
    whose = f", {wish.whose}" if wish else ""
    told = ", told to leave another pad" if _strayed(memory, name, grant, site) else ""
    return f"{state} {grant.robot}{whose}{told}"


def _strayed(memory: SiteMemory, name: str, grant: Grant, site: SiteLimits) -> bool:
    """Return whether the robot was told to leave the pad of another station, and still stands there."""
    return grant.robot in memory.nudges and wrong_pad.stands(memory, grant.robot, site)[0] not in (
        None,
        name,
    )


def _faults(memory: SiteMemory, now: float, site: SiteLimits) -> Iterator[Fault]:
    for who, stations in memory.strikes.items():
        if memory.faulty(who):
            what = f"{who} failed at {' and at '.join(stations)}: not tried again"
            yield Fault("ROBOT_FAULTY", what)
    for name in site.places:
        if now >= memory.silent_since(name):
            yield Fault("STATION_SILENT", f"{name}: no ChargerState comes")
        elif name in memory.stations:
            yield from _faults_of(memory, name, memory.stations[name], now, site)
        if name in memory.shunned:
            yield Fault("REQUEST_NOT_TAKEN", f"{name}: its daemon's log says why")
    for one in wrong_pad.found(memory, now, site).values():
        if wrong_pad.alarming(memory, one, now):
            yield _misplaced(memory, one, now)
    for who, error in memory.receivers.items():
        if error and diagnosis(error) is not FaultCause.LOST:
            yield Fault("RECEIVER_ERROR", f"the receiver on {who}: {error}")


def _faults_of(
    memory: SiteMemory, name: str, seen: StationSeen, now: float, site: SiteLimits
) -> Iterator[Fault]:
    """Yield the faults in a station's state."""
    if seen.out_of_service:
        yield Fault("STATION_OUT_OF_SERVICE", f"{name}: {seen.error}")
    if seen.diagnosis is not FaultCause.PAD:
        return
    who = wrong_pad.on_pad(seen.error, site)
    unasked = who is not None and memory.station_of(who) is None and now >= seen.since + ASKS_S
    if who is None or unasked:
        what = who or _stranger(seen.error)
        yield Fault("WRONG_STATION", f"{what} stands at {name}, but nobody requested that")


def _misplaced(memory: SiteMemory, one: wrong_pad.OnWrongPad, now: float) -> Fault:
    if one.expected:
        text = f"{one.who} stands at {one.station}, but is expected at {one.expected}"
        return Fault("WRONG_STATION", text)
    why = "RMF moves this robot only with a charging task (as with finishing_request: charge)"
    stands = where(memory, one.who, one.station, now)
    return Fault("PAD_BLOCKED", f"{stands}, and {one.waiter} waits for that station: {why}")


def _stranger(error: str) -> str:
    found = misplaced_in(error)
    return f"unknown receiver {found.receiver}" if found and found.receiver else "an unknown robot"


# ---- messages


def messages(
    memory: SiteMemory, faults: tuple[Fault, ...], now: float, site: SiteLimits
) -> tuple[SiteMemory, Messages]:
    """List the messages that are due. The list is empty if the coordinator may not publish."""
    if not memory.may_speak:
        return memory, ()
    found: list[tuple[AnyTopic, d.Message]] = []
    for name, grant in memory.grants.items():
        if now >= _due_at(memory, name, grant):
            found.append(_to_station(name, grant))
            memory = memory.with_grant(name, replace(grant, sent_at=now))
    assignments = tuple(_assignments(memory, now, site)) if memory.alone else ()
    forgotten = any(at <= now for at in _again_at(memory, site))
    if assignments != memory.assigned or forgotten:
        memory = replace(memory, assigned_at=now)
        found += [(CHARGING_ASSIGNMENTS, message) for message in assignments]
    new = {str(fault): fault for fault in faults}
    found += [(ALERT, _alert(f)) for text, f in new.items() if text not in memory.alerts]
    memory = replace(memory, assigned=assignments, alerts=frozenset(new))
    return memory, tuple(found)


def _again_at(memory: SiteMemory, site: SiteLimits) -> Iterator[float]:
    """Yield the times at which assignments must be repeated. An assignment is repeated for a robot that
    has a station, no task, and stands elsewhere.

    An EasyFullControl adapter takes the retained assignment at its start. A moment later the adapter
    replaces that assignment by the charger in its own configuration file (seen in Jazzy). No message
    shows this moment. Therefore the assignment is published every AGAIN_S until the robot moves, or has
    lost the station.
    """
    for name, grant in memory.grants.items():
        standing = memory.robots.get(grant.robot)
        place = memory.place_of(grant.robot)
        if grant.over or grant.started or standing is None or standing.sighting.task_id:
            continue
        if place is not None and memory.stands_at(grant.robot, site) != name:
            yield max(memory.assigned_at, grant.made_at) + AGAIN_S


def due(memory: SiteMemory, site: SiteLimits) -> list[float]:
    """List the times when requests, cancels, assignments and faults are due."""
    if not memory.may_speak:
        return []
    asks = [seen.since + ASKS_S for seen in memory.stations.values()]
    asks += _again_at(memory, site)
    return asks + [_due_at(memory, name, grant) for name, grant in memory.grants.items()]


def _due_at(memory: SiteMemory, name: str, grant: Grant) -> float:
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


def _assignments(
    memory: SiteMemory, now: float, site: SiteLimits
) -> Iterator[d.ChargingAssignments]:
    """Assign every robot's place, fleet by fleet, in the order of names.

    For TOLD_S after an order to leave a pad, a robot with a station gets MODE_WAIT at its waypoint for
    waiting, and a robot without a station gets MODE_CHARGE there (`wrong_pad.py`).
    """
    fleets: dict[str, list[d.ChargingAssignment]] = {}
    allotted = memory.allotted
    for who in site.robots:
        station, told = allotted.get(who), wrong_pad.is_nudged(memory, who, now)
        charges = (station is None) == told
        mode = d.ChargingMode.MODE_CHARGE if charges else d.ChargingMode.MODE_WAIT
        place = site.places[station][who.fleet] if station and not told else site.waits_at[who]
        assignment = d.ChargingAssignment(who.name, place, int(mode))
        fleets.setdefault(who.fleet, []).append(assignment)
    return (d.ChargingAssignments(name, tuple(them)) for name, them in fleets.items())


def _alert(fault: Fault) -> d.Alert:
    """Make the Alert of a fault. `stamped` appends the time to the alert's id, because rmf-web shows an
    id only once."""
    tier = d.AlertTier.TIER_ERROR if fault.code in ERRORS else d.AlertTier.TIER_WARNING
    return d.Alert(
        id=f"{NODE}/{fault.code}/{fault.detail}",
        title=TITLES.get(fault.code, fault.code),
        subtitle=fault.code,
        message=fault.detail,
        tier=int(tier),
    )
