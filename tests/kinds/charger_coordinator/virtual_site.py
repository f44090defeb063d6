"""A simulated charging yard in virtual time: our coordinator, chargers, and fleet adapters.

The coordinator is the product's own node. Each charger has the core of a charger's daemon, and a
simulated station. The fleet adapters move their robots to the assigned places. All messages go through
the memory transport.
"""

from typing import Any

from bridges.kinds.charger import core as charger
from bridges.kinds.charger import messages as charger_messages
from bridges.kinds.charger.memory import ChargerLimits
from bridges.kinds.charger.settings import ChargerDurations, ChargerSettings, RobotName
from bridges.kinds.charger.signals import Activity, ChargerSample, FaultSide, Measured
from bridges.kinds.charger_coordinator import KIND
from bridges.kinds.charger_coordinator.settings import (
    CoordinatorSettings,
    RobotSettings,
    StationSettings,
    Waypoint,
)
from bridges.kinds.charger_coordinator.settings import FleetSettings as FleetSettings
from bridges.kinds.shared.decision import IoFailed, RequestRefused, Sampled
from bridges.messages import definitions as d
from bridges.messages import topics, words
from bridges.messages.stamps import duration
from bridges.runtime.graph_node import GraphNode
from tests.runtime.virtual_graph import EPOCH, Disk, Served, Ticking, World, in_order
from workbench.rmf_model.fleet import Finishing, FleetAdapter

STEP_S = 0.25
GRAPH = {
    "charger_a": ("L1", 10.0, 2.0),
    "dock_b": ("L1", 10.0, 6.0),
    "wait_1": ("L1", 0.0, 2.0),
    "wait_2": ("L1", 0.0, 4.0),
    "wait_3": ("L1", 0.0, 6.0),
    "ward": ("L1", 50.0, 0.0),
}
BIG_GRAPH = {
    "station_1": ("L1", 10.0, 2.0),
    "station_2": ("L1", 10.0, 6.0),
    "bay_1": ("L1", 0.0, 10.0),
    "ward": ("L1", 50.0, 0.0),
}
"""The waypoints of the second brand's fleet, which uses its own names for the two charging places."""
PLACES = {
    "charger_a": {"tiny": "charger_a", "big": "station_1"},
    "charger_b": {"tiny": "dock_b", "big": "station_2"},
}
NO_ERROR: tuple[FaultSide, str] = ("", "")
RECEIVERS = {f"RX-{i}": RobotName("tiny", f"AMR0{i}") for i in (1, 2, 3)}
BIG = {"RX-9": RobotName("big", "B01")}


def settings(**changes: Any) -> CoordinatorSettings:
    """Return the coordinator's settings for two stations and three robots. AMR03 may use charger_b
    only."""
    robots = {
        who.name: RobotSettings(
            stations=["charger_a", "charger_b"][who.name == "AMR03" :],
            waits_at=f"wait_{who.name[-1]}",
            receivers=[receiver],
        )
        for receiver, who in RECEIVERS.items()
    }
    waypoints = {
        name: Waypoint(level=level, x=x, y=y)
        for name, (level, x, y) in GRAPH.items()
        if name != "ward"
    }
    known: dict[str, Any] = {
        "stations": {
            "charger_a": StationSettings(),
            "charger_b": StationSettings(waypoint="dock_b"),
        },
        "fleets": {"tiny": FleetSettings(waypoints=waypoints, robots=robots)},
        "start_timeout_s": 60.0,
    }
    return CoordinatorSettings(**(known | changes))


def two_brands() -> CoordinatorSettings:
    """Return the settings of `settings()`, with a second fleet of another brand."""
    tiny = settings().fleets["tiny"]
    waypoints = {
        n: Waypoint(level=a, x=x, y=y) for n, (a, x, y) in BIG_GRAPH.items() if n != "ward"
    }
    robot = RobotSettings(
        stations=["charger_a", "charger_b"], waits_at="bay_1", receivers=["RX-9"], rcu="rcu_b01"
    )
    big = FleetSettings(waypoints=waypoints, robots={"B01": robot})
    stations = {
        "charger_a": StationSettings(waypoints={"big": "station_1"}),
        "charger_b": StationSettings(waypoint="dock_b", waypoints={"big": "station_2"}),
    }
    return settings(stations=stations, fleets={"tiny": tiny, "big": big})


class Charger:
    """A charger: the core of a charger's daemon, and a simulated station.

    Possible faults:
    - `broken`: the station shows an error as soon as power flows. `fails` is the side at fault.
    - `refuses`: the handshake with these receivers fails.
    - `unplugged`: the station does not answer its daemon.
    - `dead`: the daemon is dead.
    """

    def __init__(self, name: str, knows: bool = True) -> None:
        receivers = RECEIVERS | BIG if knows else {}
        self.name = name
        self.limits = ChargerLimits(ChargerDurations(misses=3, released_s=1.0), receivers)
        self.memory = charger.initial(self.limits, 0.0)
        self.pad = ""
        self.percent = 0.0
        self.full_in_s: float | None = None
        self.fails: FaultSide = "station"
        self.broken = self.unplugged = self.dead = False
        self.refuses: set[str] = set()
        self.activity = Activity.IDLE
        self.error: tuple[FaultSide, str] | None = None
        self._since = 0.0
        self._power = False
        self._clears = 0
        self._told: Any = None
        self._told_at = -1.0

    def restarts(self, now: float, switched_off: bool = True) -> None:
        """Restart a killed daemon.

        `switched_off` says whether the command `outputs-off` has switched the station off before the
        restart.
        """
        self.memory = charger.initial(self.limits, now)
        self._power = self._power and not switched_off
        self._clears, self._told, self.dead = 0, None, False

    def stops(self) -> None:
        """Switch the station's power off, whatever its daemon has ordered."""
        self._power = False

    def scan(self, now: float) -> d.ChargerState | None:
        """Read the station, let the core decide, and switch the power. Return the state to publish now,
        or None."""
        self._run(now)
        if self.unplugged:
            return self.decide(IoFailed("no route to host"), now)
        side, text = self.error or NO_ERROR
        full = self.percent if self.activity is Activity.CHARGING else None
        measured = Measured(
            receiver_id=self.pad, battery_percent=full, time_to_full_s=self.full_in_s
        )
        return self.decide(Sampled(ChargerSample(self.activity, 0, text, measured, side)), now)

    def decide(self, event: Any, now: float) -> d.ChargerState | None:
        """Let the daemon's core decide on this event. Return the state to publish now, or None."""
        decision = charger.decide(self.memory, event, now, self.limits)
        self.memory, outputs = decision.memory, decision.outputs
        if not self.unplugged:
            self._power = self._power if outputs.power is None else outputs.power
            if outputs.clear_errors > self._clears and not self.broken:
                self.error = None
            self._clears = outputs.clear_errors
        report = decision.report
        if report.news() == self._told and now < self._told_at + 1.0:
            return None
        self._told, self._told_at = report.news(), now
        return charger_messages.state_message(self.name, ChargerSettings(), report, d.Time())

    def _run(self, now: float) -> None:
        if self.error and self.error[0] == "robot" and not self.pad:
            self.error = None
        if self.error:
            self.activity = Activity.ERROR
        elif not (self._power and self.pad):
            self.activity, self._since = Activity.IDLE, now
        elif self.activity is not Activity.CHARGING:
            self.activity = Activity.HANDSHAKE
            if now >= self._since + 2.0:
                self._energise()

    def _energise(self) -> None:
        if self.broken:
            self.error = (self.fails, "over temperature")
        elif self.pad in self.refuses:
            self.error = ("robot", "authentication timeout")
        else:
            self.activity = Activity.CHARGING


class Yard:
    """The whole yard: the coordinator, the chargers and the fleets.

    `story` has (s, event) in order of time. `fills` is the charging speed (% per s).
    """

    def __init__(
        self,
        site: CoordinatorSettings | None = None,
        *,
        knows: bool = True,
        fills: float = 5.0,
        drive_s: float = 4.0,
        finishing: Finishing = "nothing",
        jazzy: bool = False,
    ) -> None:
        self.world = World(in_order)
        self.settings = site or settings()
        self.fills = fills
        self.story: list[tuple[float, str]] = []
        self.chargers = {name: Charger(name, knows) for name in PLACES}
        homes = {f"AMR0{i}": f"wait_{i}" for i in (1, 2, 3)}
        self.fleet = FleetAdapter("tiny", GRAPH, homes, drive_s, finishing, jazzy)
        self.big = FleetAdapter("big", BIG_GRAPH, {"B01": "bay_1"}, drive_s, finishing, jazzy)
        self.adapters = [self.fleet, self.big][: len(self.settings.fleets)]
        self.rmf = Ticking(self.world, "rmf", STEP_S, self._step).transport
        self.states = self.rmf.publisher(topics.CHARGER_STATES)
        self.fleets: Any = self.rmf.publisher(topics.FLEET_STATES)
        self.wishes = self.rmf.publisher(topics.ADAPTER_CHARGER_REQUESTS)
        self.withdrawals = self.rmf.publisher(topics.ADAPTER_CHARGER_CANCELS)
        self.rmf.subscribe(topics.CHARGER_REQUESTS, self._request)
        self.rmf.subscribe(topics.CHARGER_CANCELS, self._cancel)
        self.rmf.subscribe(topics.CHARGING_ASSIGNMENTS, self._assignments)
        self.rmf.subscribe(topics.ALERT, self._alert)
        self.assigned: dict[str, str] = {}
        self.assignments = 0
        self.request_ids: dict[str, str] = {}
        self._shown: dict[str, str] = {}
        self.disk = Disk()
        self.coordinator = self.serves("ours", self.disk)

    def serves(self, name: str, disk: Disk | None = None) -> Served:
        """Start a coordinator's daemon whose wall clock showed 13:46:40 at the monotonic time 0 s."""
        return Served(self.world, KIND, self.settings, name, 1e6 - EPOCH, disk)

    @property
    def node(self) -> GraphNode[Any, Any, Any, Any, Any]:
        """Return the coordinator's node."""
        return self.coordinator.node

    @property
    def now(self) -> float:
        """Return the monotonic time (s)."""
        return self.world.now

    def run(self, until: float) -> list[tuple[float, str]]:
        """Let time pass until `until`. Return the events of that time."""
        told = len(self.story)
        self.world.run(until)
        return self.story[told:]

    def _step(self) -> None:
        for adapter in self.adapters:
            for _, message in adapter.tick(self.now):
                self.fleets.publish(message)
        for charger_ in self.chargers.values():
            self._scan(charger_)

    def tell(self, what: str) -> None:
        """Add an event to `story` with the present time."""
        self.story.append((round(self.now, 3), what))

    def wants(self, who: str, station: str = "", request_id: str = "op-1") -> None:
        """Publish an operator's request to charge this robot."""
        timeout = duration(0.0)
        request = d.ChargerRequest(station, "tiny", who, timeout, request_id)
        self.wishes.publish(request)

    def mode(self, station: str) -> str:
        """Return the name of the station's last shown state, for example CHARGING."""
        return self._shown[station].split()[0]

    @property
    def faults(self) -> list[str]:
        """Return the faults in the coordinator's status."""
        return [
            f"{f['code']}: {f['detail']}" for s in self.node.devices().values() for f in s["faults"]
        ]

    def _scan(self, station: Charger) -> None:
        if station.dead:
            return
        robots = [(a.name, robot) for a in self.adapters for robot in a.robots.values()]
        places = PLACES[station.name]
        here = next((robot for fleet, robot in robots if robot.place == places[fleet]), None)
        receivers = {who.name: receiver for receiver, who in (RECEIVERS | BIG).items()}
        station.pad = receivers[here.name] if here else ""
        if here and station.activity is Activity.CHARGING:
            here.battery_percent = min(100.0, here.battery_percent + self.fills * STEP_S)
        station.percent = here.battery_percent if here else 0.0
        self._publish(station, station.scan(self.now))

    def _publish(self, station: Charger, state: d.ChargerState | None) -> None:
        if state is None:
            return
        robot = f" {state.robot_name}" if state.robot_name else ""
        text = words.word(d.ChargerStateValue, state.state) + robot
        text += f" ({state.error_message})" if state.error_message else ""
        if self._shown.get(station.name) != text:
            self._shown[station.name] = text
            self.tell(f"{station.name}: {text}")
        self.states.publish(state)

    def _request(self, request: Any) -> None:
        self._to(request, f"{request.charger_name} <- charge {request.robot_name}")

    def _cancel(self, cancel: Any) -> None:
        self._to(cancel, f"{cancel.charger_name} <- cancel")

    def _to(self, message: Any, text: str) -> None:
        station = self.chargers[message.charger_name]
        if self.request_ids.get(text) != message.request_id:
            self.request_ids[text] = message.request_id
            self.tell(text)
        if station.dead:
            return
        accept: Any = charger_messages.accept_request
        if isinstance(message, d.ChargerCancel):
            accept = charger_messages.accept_cancel
        try:
            event = accept(message, ChargerSettings())
        except RequestRefused as refusal:
            raise AssertionError(str(refusal)) from refusal
        self._publish(station, station.decide(event, self.now))

    def _assignments(self, message: Any) -> None:
        self.assignments += 1
        places = [a.waypoint_name for a in message.assignments]
        assert len(set(places)) == len(places), "two robots sent to one place"
        for a in message.assignments:
            word = f"{d.ChargingMode(a.mode).name[5:]} {a.waypoint_name}"
            if self.assigned.get(a.robot_name) != word:
                self.assigned[a.robot_name] = word
                self.tell(f"{a.robot_name} -> {word}")
        for adapter in self.adapters:
            adapter.hear(message, self.now)

    def _alert(self, alert: Any) -> None:
        self.tell(f"ALERT {alert.subtitle}: {alert.message}")
