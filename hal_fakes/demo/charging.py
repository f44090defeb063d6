"""`make demo-charging`: the five situations of shared chargers, and whether each was dealt with.

Two chargers on HTTP and the coordinator, each a process of its own; this one is a fleet adapter with
three robots, an operator and a technician. There is a robot that cannot be charged, an operator's
request, two robots too many, a robot at the wrong charger, and a charger that overheats.
"""

from collections.abc import Iterable
from itertools import groupby
from pathlib import Path
from typing import Final

from bridges.charger_coordinator.settings import Settings
from bridges.rmf import definitions as d
from bridges.rmf import topics, words
from bridges.rmf.stamps import duration
from bridges.settings.load import load
from hal_fakes.demo.journal import Journal
from hal_fakes.demo.stage import Demo
from hal_fakes.demo.world import World
from hal_fakes.rmf import Party, Said
from hal_fakes.rmf.fleet import Fleet, FleetRobot

FLEET: Final = "tiny"
WARD: Final = "ward"
DRIVE_S: Final = 1.0
FILLS_PER_S: Final = 15.0
ONE, TWO, THREE = "AMR01", "AMR02", "AMR03"
A, B = "charger_a", "charger_b"
HERE = Path(__file__).parent
COORDINATOR = HERE.parents[1] / "config" / "charger_coordinator.yaml"


class Yard(Party):
    """The fleet and the pads. A robot that arrives at a charger's waypoint stands on that charger's
    pad, and its battery fills while the charger says that it charges."""

    subscribes = Fleet.subscribes

    def __init__(self, world: World, site: Settings) -> None:
        self.world = world
        waypoints = site.fleets[FLEET].waypoints
        graph = {name: (at.level, at.x, at.y) for name, at in waypoints.items()}
        graph[WARD] = ("L1", -20.0, 0.0)
        homes = {name: robot.waits_at for name, robot in site.fleets[FLEET].robots.items()}
        self.fleet = Fleet(FLEET, graph, homes, DRIVE_S)
        self._stations = {place: name for name, place in site.places().items()}
        self._on_pad: dict[str, str] = {}
        self._filled_at = world.wall()

    # ---- a party on RMF's side

    def hear(self, message: d.Message, now: float) -> list[Said]:
        """Charging assignments."""
        return self.fleet.hear(message, now)

    def tick(self, now: float) -> list[Said]:
        """Robots drive on, batteries fill, pads are stepped on and off."""
        said = self.fleet.tick(now)
        self._fill(now)
        for robot in self.fleet.robots.values():
            self._stands(robot)
        return said

    def wake_at(self) -> float:
        """All the time."""
        return 0.0

    # ---- what the day calls

    def needs(self, who: str, percent: float) -> None:
        """RMF finds its battery low."""
        self.fleet.robots[who].battery_percent = percent
        self.world.note(f"is at {percent:.0f} %: its fleet sends it to charge", who)
        self.fleet.charge(who, self.world.wall())

    def leaves(self, who: str) -> None:
        """It has work elsewhere."""
        self.world.note("drives off to work", who)
        self.fleet.works(who, WARD, self.world.wall())

    def strays(self, who: str, place: str) -> None:
        """It drives where nobody has sent it."""
        self.fleet.strays(who, place, self.world.wall())

    # ---- inside

    def _fill(self, now: float) -> None:
        passed_s, self._filled_at = now - self._filled_at, now
        for who, charger in self._on_pad.items():
            if self.world.charger_is(charger, "CHARGING", who):
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
            self.world.press(before, f"{FLEET}/{robot.name}", False)
        if charger is not None:
            self._on_pad[robot.name] = charger
            self.world.note(f"stands on the pad of {charger}", robot.name)
            self.world.press(charger, f"{FLEET}/{robot.name}", True)


# --- the day -----------------------------------------------------------------------------------


def dawns(world: World) -> bool:
    """Both chargers are idle, and the coordinator speaks."""
    return _idle(world) and bool(world.places)


def live(world: World) -> None:
    """All five situations."""
    site = load(COORDINATOR).section
    yard = Yard(world, site)
    world.join(yard)
    with world.leg("failure of a robot", f"the receiver of {TWO} is defective"):
        _robot_fails(world, yard)
    with world.leg("ad-hoc", f"{TWO} is mended, and an operator wants it charged now"):
        _operator_wants(world, TWO)
        yard.needs(TWO, 55)
        _charges(world, A, TWO)
    with world.leg(
        "scheduled and stacked", f"{ONE} and {THREE} come too: two chargers, three robots"
    ):
        _three_at_two(world, yard)
    with world.leg("wrong station", f"{ONE} drives to the wrong charger"):
        _strays(world, yard)
    with world.leg("failure of a charger", f"{A} overheats"):
        _charger_fails(world, yard)


def _idle(world: World) -> bool:
    return world.charger_is(A, "IDLE") and world.charger_is(B, "IDLE")


def _charges(world: World, charger: str, who: str, within_s: float = 10) -> None:
    charging = f"{who} to be charged at {charger}"
    world.until(lambda: world.charger_is(charger, "CHARGING", who), within_s, charging)


def _sent(world: World, who: str, place: str, within_s: float) -> None:
    sent = f"{who} to be sent: {place}"
    world.until(lambda: world.places[who] == place, within_s, sent)


def _error(world: World, charger: str, error: str, within_s: float, who: str = "") -> None:
    told = f"{charger} to report: {error}"
    world.until(lambda: world.charger_is(charger, "ERROR", who, error), within_s, told)


def _alerted(world: World, code: str) -> None:
    world.until(lambda: world.alerted(code), 3, f"a person to be told {code}")


def _operator_wants(world: World, who: str) -> None:
    """As `rmf-bridge send charger any --queue` does."""
    request = d.ChargerRequest("", FLEET, who, duration(30.0), "operator-1")
    world.say([(topics.ADAPTER_CHARGER_REQUESTS, request)])


def _robot_fails(world: World, yard: Yard) -> None:
    for charger in (A, B):
        world.fail(charger, "receiver", "wrong")
    yard.needs(TWO, 40)
    for charger in (A, B):
        _error(world, charger, "robot: authentication timeout", 10, TWO)
    _alerted(world, "ROBOT_FAULTY")
    world.until(lambda: _idle(world), 10, "both chargers to be free again")
    for charger in (A, B):
        world.fail(charger, "receiver", "ok")


def _three_at_two(world: World, yard: Yard) -> None:
    yard.needs(ONE, 60)
    _sent(world, ONE, "charge at dock_b", 6)
    yard.needs(THREE, 70)
    _charges(world, B, ONE, 8)
    world.until(lambda: world.charger_is(B, "RELEASED"), 10, f"{B} to release {ONE}")
    yard.leaves(ONE)
    _charges(world, B, THREE)
    yard.leaves(TWO)
    world.until(lambda: world.charger_is(A, "IDLE"), 6, f"{A} to be free")


def _strays(world: World, yard: Yard) -> None:
    yard.needs(ONE, 50)
    _sent(world, ONE, f"charge at {A}", 8)
    yard.leaves(THREE)
    yard.strays(ONE, "dock_b")
    _error(world, B, f"wrong docking: {FLEET}/{ONE}", 8)
    _alerted(world, "WRONG_STATION")
    world.until(lambda: world.charger_is(A, "ASSIGNED", ONE), 2, f"{A} to be kept for {ONE}")
    world.note("is sent to its own charger by a person", ONE)
    yard.strays(ONE, A)
    _charges(world, A, ONE, 8)


def _charger_fails(world: World, yard: Yard) -> None:
    world.press(A, "over_temperature", True)
    _error(world, A, "over temperature", 5)
    _alerted(world, "STATION_OUT_OF_SERVICE")
    _charges(world, B, ONE)
    world.until(lambda: world.charger_is(A, "ERROR"), 1, f"{A} to stay out of service")
    world.note("is cooled and reset by the technician", A)
    world.press(A, "over_temperature", False)
    world.daemons[A].reset()
    world.until(lambda: world.charger_is(A, "IDLE"), 8, f"{A} to be in service again")
    yard.leaves(ONE)
    world.until(lambda: _idle(world), 8, "both chargers to be free")


# --- the verdict: pure -------------------------------------------------------------------------

CHARGED: Final = {A: [TWO, ONE], B: [ONE, THREE, ONE]}
"""Who was charged where, in order; nobody else, nowhere else."""


def problems(journal: Journal) -> list[str]:
    """Everything that was not as it should be; empty when the day went right."""
    states = [state for state in journal.states if isinstance(state, d.ChargerState)]
    return [*_charged(states), *_shared(states), *_unverified(states)]


def _charged(states: list[d.ChargerState]) -> Iterable[str]:
    for charger, expected in CHARGED.items():
        seen = [(_charging(s), s.robot_name) for s in states if s.charger_name == charger]
        robots = [who for (charging, who), _ in groupby(seen) if charging]
        if robots != expected:
            yield f"{charger} charged {' '.join(robots) or 'nobody'}, expected {' '.join(expected)}"


def _shared(states: list[d.ChargerState]) -> Iterable[str]:
    """Never one robot on two chargers, as far as their states say."""
    latest: dict[str, d.ChargerState] = {}
    for state in states:
        latest[state.charger_name] = state
        charging = [s.robot_name for s in latest.values() if _charging(s)]
        if len(set(charging)) != len(charging):
            yield f"{state.robot_name} was charged at two chargers at once"
            return


def _unverified(states: list[d.ChargerState]) -> Iterable[str]:
    """What is charged was asked for, by the coordinator."""
    for state in states:
        if _charging(state) and not state.request_id.startswith("charger_coordinator/"):
            yield f"{state.charger_name} charged for {state.request_id or 'no request'}"
            return


def _charging(state: d.ChargerState) -> bool:
    return words.word(d.ChargerStateValue, state.state) == "CHARGING"


DEMO: Final = Demo(
    files={A: HERE / "charging_a.yaml", B: HERE / "charging_b.yaml", "coordinator": COORDINATOR},
    dawn=f"{A} and {B} idle, and a place for each robot",
    dawns=dawns,
    live=live,
    problems=problems,
    right="five situations, each dealt with; never two robots at one charger.",
)
