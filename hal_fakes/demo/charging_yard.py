"""RMF's side of the charging demo on a real graph: a fleet adapter and its robots, and what is heard.

A robot that arrives at a charger's waypoint stands on that charger's pad. Its battery fills while the
charger says that it charges.
"""

import time
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import Any, Final

from bridges.charger_coordinator.settings import Settings
from bridges.rmf import definitions as d
from bridges.rmf import topics
from bridges.rmf.stamps import duration
from bridges.rmf.topics import Topic
from bridges.rmf.transport import Publisher, Transport
from hal_fakes.demo.daemons import Wrong
from hal_fakes.demo.journal import SETTLES_S
from hal_fakes.demo.stage import Stage
from hal_fakes.rmf.fleet import Fleet, FleetRobot

FLEET: Final = "tiny"
WARD: Final = "ward"
DRIVE_S: Final = 1.0
FILLS_PER_S: Final = 15.0
LOOK_EVERY_S: Final = 0.05
HEARD: Final[tuple[Topic[Any], ...]] = (
    topics.CHARGER_STATES,
    topics.CHARGER_REQUESTS,
    topics.CHARGER_CANCELS,
    topics.CHARGING_ASSIGNMENTS,
    topics.ALERT,
)


class Yard:
    """`places`: robot -> where it is sent. `alerts`: what a person was told."""

    def __init__(self, transport: Transport, stage: Stage, site: Settings) -> None:
        self.stage = stage
        self.journal = stage.journal
        waypoints = site.fleets[FLEET].waypoints
        graph = {name: (at.level, at.x, at.y) for name, at in waypoints.items()}
        graph[WARD] = ("L1", -20.0, 0.0)
        homes = {name: robot.waits_at for name, robot in site.fleets[FLEET].robots.items()}
        self.fleet = Fleet(FLEET, graph, homes, DRIVE_S)
        self.places: dict[str, str] = {}
        self.alerts: list[d.Alert] = []
        self._stations = {place: name for name, place in site.places().items()}
        self._on_pad: dict[str, str] = {}
        self._filled_at = time.monotonic()
        self._inbox: SimpleQueue[tuple[float, Topic[Any], Any]] = SimpleQueue()
        self._states: Publisher[Any] = transport.publisher(topics.FLEET_STATES)
        self._wishes = transport.publisher(topics.ADAPTER_CHARGER_REQUESTS)
        for topic in HEARD:
            transport.subscribe(topic, self._to_inbox(topic))

    def is_up(self) -> bool:
        """Chargers idle, and the coordinator speaks."""
        return (
            self.shows("charger_a", "IDLE")
            and self.shows("charger_b", "IDLE")
            and bool(self.places)
        )

    # ---- what the day calls

    def shows(self, charger: str, state: str, robot: str = "", error: str = "") -> bool:
        """The charger's last state is this, for this robot, with this in its error message."""
        latest = self.journal.latest(charger)
        return (
            isinstance(latest, d.ChargerState)
            and latest.state == d.ChargerStateValue[f"CHARGER_{state}"]
            and robot in ("", latest.robot_name)
            and error in latest.error_message
        )

    def alerted(self, code: str) -> bool:
        """A person was told this."""
        return any(alert.subtitle == code for alert in self.alerts)

    def note(self, text: str, who: str = "") -> None:
        """One line about a robot, or about people."""
        self.journal.note("robot", text, time.monotonic(), who)

    def needs(self, who: str, percent: float) -> None:
        """RMF finds its battery low."""
        self.fleet.robots[who].battery_percent = percent
        self.note(f"is at {percent:.0f} %: its fleet sends it to charge", who)
        self.fleet.charge(who, time.monotonic())

    def leaves(self, who: str) -> None:
        """It has work elsewhere."""
        self.note("drives off to work", who)
        self.fleet.works(who, WARD, time.monotonic())

    def strays(self, who: str, place: str) -> None:
        """It drives where nobody has sent it."""
        self.fleet.strays(who, place, time.monotonic())

    def operator_wants(self, who: str) -> None:
        """As `rmf-bridge send charger any --queue` does."""
        self._wishes.publish(d.ChargerRequest("", FLEET, who, duration(30.0), "operator-1"))

    def until(self, ready: Callable[[], bool], within_s: float, what: str) -> None:
        """Go on until `ready`. Raises Wrong, with `what`, when it takes longer than `within_s`."""
        deadline = time.monotonic() + within_s
        while not ready():
            if time.monotonic() >= deadline:
                raise Wrong(f"waited {within_s:g} s for {what}")
            self._turn()

    # ---- inside

    def _turn(self) -> None:
        self.stage.check()
        now = time.monotonic()
        for _, message in self.fleet.tick(now):
            self._states.publish(message)
        self._fill(now)
        for robot in self.fleet.robots.values():
            self._stands(robot)
        try:
            at, topic, message = self._inbox.get(timeout=LOOK_EVERY_S)
        except Empty:
            pass
        else:
            self._take(at, topic, message)
        self.journal.flush(time.monotonic() - SETTLES_S)

    def _fill(self, now: float) -> None:
        passed_s, self._filled_at = now - self._filled_at, now
        for who, charger in self._on_pad.items():
            if self.shows(charger, "CHARGING", who):
                robot = self.fleet.robots[who]
                percent = robot.battery_percent + passed_s * FILLS_PER_S
                robot.battery_percent = min(100.0, percent)

    def _stands(self, robot: FleetRobot) -> None:
        """Onto a pad, and off it."""
        before, charger = self._on_pad.get(robot.name), self._stations.get(robot.place)
        if charger == before:
            return
        if before is not None:
            del self._on_pad[robot.name]
            self.stage.press(before, f"{FLEET}/{robot.name}", False)
        if charger is not None:
            self._on_pad[robot.name] = charger
            self.note(f"stands on the pad of {charger}", robot.name)
            self.stage.press(charger, f"{FLEET}/{robot.name}", True)

    def _take(self, at: float, topic: Topic[Any], message: Any) -> None:
        match message:
            case d.ChargerState():
                self.journal.state(message, at)
            case d.ChargerRequest() | d.ChargerCancel():
                self.journal.request(message, at)
            case d.ChargingAssignments():
                self._sent(message, at)
            case d.Alert():
                self.alerts.append(message)
                self.journal.note("alert", f"{message.title}: {message.message}", at)

    def _sent(self, message: d.ChargingAssignments, at: float) -> None:
        for one in message.assignments:
            mode = "charge at" if one.mode == d.ChargingMode.MODE_CHARGE else "wait at"
            text = f"{mode} {one.waypoint_name}"
            if self.places.get(one.robot_name) != text:
                self.places[one.robot_name] = text
                self.journal.note("place", text, at, one.robot_name)
        self.fleet.hear(message, time.monotonic())

    def _to_inbox(self, topic: Topic[Any]) -> Callable[[Any], None]:
        def put(message: Any) -> None:
            self._inbox.put((time.monotonic(), topic, message))

        return put
