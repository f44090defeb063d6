"""The values that the coordinator keeps from one event to the next, and the settings that it needs (its
limits)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal, TypeVar

import msgspec
from msgspec.structs import replace

from bridges.kinds.charger.report import FaultCause, diagnosis
from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator.schedule import Charging, LocalTime
from bridges.kinds.charger_coordinator.settings import CoordinatorSettings
from bridges.kinds.charger_coordinator.signals import ChargeWanted, Sighting
from bridges.kinds.shared.durations import AGES_AGO
from bridges.kinds.shared.graph_kind import LISTENS
from bridges.messages.definitions import ChargerStateValue, ChargingAssignments

K = TypeVar("K")
V = TypeVar("V")

NODE: Final = "charger_coordinator"
STATION_SILENT_S: Final = 5.0
"""The time (s) without a state after which a station counts as silent. Stations publish states at 1
Hz."""
FLEET_SILENT_S: Final = 30.0
"""The time (s) without a report on a robot after which its fleet counts as silent."""
STRIKES: Final = 2
"""The number of failures after which a robot is not tried again. If two stations suit the robot, it has
then failed at both, so the robot is at fault."""

IDLE: Final = ChargerStateValue.CHARGER_IDLE
ASSIGNED: Final = ChargerStateValue.CHARGER_ASSIGNED
CHARGING: Final = ChargerStateValue.CHARGER_CHARGING
RELEASED: Final = ChargerStateValue.CHARGER_RELEASED
ERROR: Final = ChargerStateValue.CHARGER_ERROR


@dataclass(frozen=True, slots=True)
class SiteLimits:
    """The settings that the core needs.

    `robots` maps a robot, in the order of names, to its suitable stations, best first. `waits_at`
    maps a robot to the waypoint where it waits. `places` maps a station and then a fleet to the
    station's waypoint in that fleet's graph. `receivers` maps a receiver's id to its robot.
    """

    robots: Mapping[RobotName, tuple[str, ...]]
    waits_at: Mapping[RobotName, str]
    places: Mapping[str, Mapping[str, str]]
    receivers: Mapping[str, RobotName]
    start_timeout_s: float
    full_percent: float
    again_percent: float
    leaves_s: float
    schedule: tuple[Charging, ...] = ()
    _stations: Mapping[tuple[str, str], str] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        found = {
            (fleet, place): name
            for name, places in self.places.items()
            for fleet, place in places.items()
        }
        object.__setattr__(self, "_stations", found)

    def station_at(self, fleet: str, place: str | None) -> str | None:
        """Find the station at this waypoint of the fleet's graph; None if there is no station."""
        return self._stations.get((fleet, place or ""))

    @classmethod
    def of(cls, settings: CoordinatorSettings) -> "SiteLimits":
        """Make the limits from the YAML."""
        robots = dict(sorted(settings.robots().items()))
        return cls(
            robots={who: tuple(robot.stations) for who, robot in robots.items()},
            waits_at={who: robot.waits_at for who, robot in robots.items()},
            places=settings.places(),
            receivers={r: who for who, robot in robots.items() for r in robot.receivers},
            start_timeout_s=settings.start_timeout_s,
            full_percent=settings.full_percent,
            again_percent=settings.again_percent,
            leaves_s=settings.leaves_s,
            schedule=tuple(settings.schedule),
        )


By = Literal["fleet", "schedule", "operator"]
WHOSE: Final[Mapping[By, str]] = {
    "fleet": "by the robot",
    "schedule": "by the schedule",
    "operator": "by an operator",
}


class Wish(msgspec.Struct, frozen=True):
    """One robot's need to be charged.

    `by`: the origin of the wish (the fleet's state, our schedule, an operator). `task_id`: the robot's
    task; empty for an operator's wish. `called`: the task `task_id` is the robot's drive to the
    station, because it began after the station was assigned to the robot. `station`, `request_id`,
    `start_timeout_s`: from the operator's request.
    """

    robot: RobotName
    by: By
    task_id: str = ""
    called: bool = False
    station: str = ""
    request_id: str = ""
    start_timeout_s: float = 0.0

    @property
    def whose(self) -> str:
        """The wish's origin in words. An operator's wish without a request was adopted from a station:
        another node may have requested it, or nobody."""
        adopted = self.by == "operator" and not self.request_id
        return "by an adopted request" if adopted else WHOSE[self.by]

    @classmethod
    def of(cls, wanted: ChargeWanted) -> "Wish":
        """Make a wish from an operator's request."""
        return cls(
            wanted.robot,
            "operator",
            station=wanted.station,
            request_id=wanted.request_id,
            start_timeout_s=wanted.start_timeout_s,
        )


class Grant(msgspec.Struct, frozen=True):
    """A station that is assigned to a robot.

    `request_id`: the request to the station. `made_at`: the time of the assignment. `shown`: the
    station's state has shown the request. `started`: current has flowed. `over`: the robot has lost the
    station, but no other robot gets the station until the station releases this robot. `sent_at`: the
    time of the last request or cancel. `forgotten_at`: the time when the station's daemon last forgot
    the request, so that the coordinator sent it again.
    """

    robot: RobotName
    request_id: str
    made_at: float
    start_timeout_s: float = 0.0
    shown: bool = False
    started: bool = False
    over: bool = False
    sent_at: float = AGES_AGO
    forgotten_at: float = AGES_AGO


class Standing(msgspec.Struct, frozen=True):
    """The last known position and task of a robot, from its fleet's state at the time `at`.

    `since`: the robot's waypoint, mode and task have not changed since this time. `here_since`: the
    robot's waypoint has not changed since this time; -inf if it has not changed since the first state.
    """

    sighting: Sighting
    at: float
    since: float = AGES_AGO
    here_since: float = AGES_AGO

    @property
    def works(self) -> bool:
        """Return whether the robot has a task that is not for charging, according to its fleet."""
        return bool(self.sighting.task_id) and not self.sighting.charges


class StationSeen(msgspec.Struct, frozen=True):
    """A station's last state, heard at `at`.

    `since`: the station's state and error have not changed since this time. `full_in_s`: the time (s)
    from `at` until the robot is full, as the station estimates.
    """

    state: ChargerStateValue
    request_id: str
    robot: RobotName | None
    error: str
    at: float
    since: float
    full_in_s: float = 0.0

    @property
    def diagnosis(self) -> FaultCause:
        """The side at fault; NONE without an error."""
        return diagnosis(self.error) if self.state is ERROR else FaultCause.NONE

    @property
    def out_of_service(self) -> bool:
        """Return whether the error is, or may be, the station's own."""
        return self.diagnosis in (FaultCause.STATION, FaultCause.LOST, FaultCause.UNCLEAR)


class Nudge(msgspec.Struct, frozen=True):
    """The orders that told a robot to leave a pad.

    `why`: the id of the request for the robot's own station. If the robot has no station, `why` is the
    name of the station that the robot blocks. `count`: the number of orders. `at`: the time of the last
    order.
    """

    why: str
    count: int
    at: float


class SiteMemory(msgspec.Struct, frozen=True):
    """The memory of the site from event to event.

    Wishes and stations:
    - `wishes`: in the order of service. `grants`: by station. `count`: the number of requests made.
    - `over`: the ids of the latest ended requests of operators. Late repeats of these requests are
      refused.
    - `strikes`: the stations where each robot has failed. `served`: the task in which each robot was
      charged.
    - `reached`: the percentage of the schedule that a robot has reached in the present time of the
      schedule. The robot is charged again only for a higher percentage.
    - `absent`: a robot that did not drive to its assigned station -> the time when it may get a station
      again.
    - `shunned`: a station that took no request, and has shown none since -> the time until which the
      station is not used.
    - `preferred`: the station that another node has dedicated to each robot.
    - `nudges`: the orders to robots to leave a pad.

    Readings: `robots`, `stations`: the last state of each robot and each station. `stood`: the waypoint
    where each robot stood before the coordinator's restart, for robots that their fleet has not
    reported since. `receivers`: the error of each robot's own receiver. `when`: the local time.

    Publishing: `may_speak`: the coordinator may publish. `passive`: if the coordinator may not publish,
    the reason why requesters must wait. `alone`: no other node publishes charging assignments.
    `assigned`: the assignments published last, at `assigned_at`. `alerts`: the faults already sent as
    alerts.
    """

    began_at: float = 0.0
    may_speak: bool = False
    passive: str = LISTENS
    alone: bool = True
    wishes: tuple[Wish, ...] = ()
    grants: Mapping[str, Grant] = msgspec.field(default_factory=dict)
    strikes: Mapping[RobotName, tuple[str, ...]] = msgspec.field(default_factory=dict)
    served: Mapping[RobotName, str] = msgspec.field(default_factory=dict)
    reached: Mapping[RobotName, float] = msgspec.field(default_factory=dict)
    absent: Mapping[RobotName, float] = msgspec.field(default_factory=dict)
    over: tuple[str, ...] = ()
    count: int = 0
    robots: Mapping[RobotName, Standing] = msgspec.field(default_factory=dict)
    stood: Mapping[RobotName, str] = msgspec.field(default_factory=dict)
    stations: Mapping[str, StationSeen] = msgspec.field(default_factory=dict)
    shunned: Mapping[str, float] = msgspec.field(default_factory=dict)
    preferred: Mapping[RobotName, str] = msgspec.field(default_factory=dict)
    nudges: Mapping[RobotName, Nudge] = msgspec.field(default_factory=dict)
    receivers: Mapping[RobotName, str] = msgspec.field(default_factory=dict)
    when: LocalTime | None = None
    assigned: tuple[ChargingAssignments, ...] = ()
    assigned_at: float = AGES_AGO
    alerts: frozenset[str] = frozenset()

    def wish(self, robot: RobotName) -> Wish | None:
        """Find this robot's wish; None if the robot has no wish."""
        return next((wish for wish in self.wishes if wish.robot == robot), None)

    def station_of(self, robot: RobotName) -> str | None:
        """Find this robot's station; None if the robot has no station."""
        return self.allotted.get(robot)

    def place_of(self, robot: RobotName) -> str | None:
        """Return the waypoint of our YAML where the fleet last saw the robot; None for a robot
        elsewhere."""
        standing = self.robots.get(robot)
        return standing.sighting.place if standing else self.stood.get(robot)

    def unheard(self, robot: RobotName, now: float) -> bool:
        """Return whether the fleet has not reported this robot for FLEET_SILENT_S."""
        standing = self.robots.get(robot)
        return standing is None or now >= standing.at + FLEET_SILENT_S

    def without_unheard(self, now: float) -> "SiteMemory":
        """Return the memory without the places of the robots that their fleets do not report."""
        heard = {who: seen for who, seen in self.robots.items() if not self.unheard(who, now)}
        return replace(self, robots=heard, stood={})

    @property
    def places(self) -> Mapping[RobotName, str | None]:
        """The place (`place_of`) of every robot that its fleet has reported, now or before our
        restart."""
        return {who: self.place_of(who) for who in {**self.stood, **self.robots}}

    @property
    def allotted(self) -> Mapping[RobotName, str]:
        """The station of every robot that has one."""
        found: dict[RobotName, str] = {}
        for name, grant in self.grants.items():
            if not grant.over:
                found.setdefault(grant.robot, name)
        return found

    def here_since(self, robot: RobotName) -> float:
        """Return the time since which the robot has been at its place, as far as known."""
        standing = self.robots.get(robot)
        return standing.here_since if standing else self.began_at

    def stands_at(self, robot: RobotName, site: SiteLimits) -> str | None:
        """Return the station where the fleet last saw the robot; None for a robot elsewhere."""
        return site.station_at(robot.fleet, self.place_of(robot))

    @property
    def assigns(self) -> bool:
        """Return whether the coordinator may assign charging places to robots."""
        return self.may_speak and self.alone

    def faulty(self, robot: RobotName) -> bool:
        """Return whether this robot has failed too often. Such a robot is not tried again before an
        operator's reset."""
        return len(self.strikes.get(robot, ())) >= STRIKES

    def speaks(self, station: str, now: float) -> bool:
        """Return whether this station's last state is recent."""
        return station in self.stations and now < self.stations[station].at + STATION_SILENT_S

    def silent_since(self, station: str) -> float:
        """Return the time at which the station became silent, or will become silent if no state
        comes."""
        seen = self.stations.get(station)
        return STATION_SILENT_S + (self.began_at if seen is None else seen.at)

    # ---- changed copies

    def with_grant(self, station: str, grant: Grant | None) -> "SiteMemory":
        """Return the memory in which the station has this grant. With None, the station has no
        robot."""
        rest = without(self.grants, station)
        return replace(self, grants=rest | ({} if grant is None else {station: grant}))

    def without_wish(self, robot: RobotName) -> "SiteMemory":
        """Return the memory without this robot's wish."""
        wish = self.wish(robot)
        if wish is None:
            return self
        over = (*self.over, wish.request_id)[-8:] if wish.request_id else self.over
        return replace(self, wishes=tuple(w for w in self.wishes if w is not wish), over=over)

    def with_reached(self, robot: RobotName, aim: float) -> "SiteMemory":
        """Return the memory in which this robot has reached the schedule's percentage `aim`."""
        most = max(aim, self.reached.get(robot, 0.0))
        return replace(self, reached={**self.reached, robot: most})

    def last_in_queue(self, robot: RobotName) -> "SiteMemory":
        """Return the memory with this robot's wish at the end of the queue."""
        wish = self.wish(robot)
        if wish is None:
            return self
        return replace(self, wishes=(*(w for w in self.wishes if w is not wish), wish))

    def takes_back(self, robot: RobotName) -> "SiteMemory":
        """Return the memory in which this robot loses its station. No other robot gets the station
        until the station has released the robot."""
        station = self.station_of(robot)
        if station is None:
            return self
        return self.with_grant(station, replace(self.grants[station], over=True, sent_at=AGES_AGO))


def without(table: Mapping[K, V], key: K) -> dict[K, V]:
    """Copy the table without this key."""
    return {k: v for k, v in table.items() if k != key}
