"""`make demo-charging`: the numbered scenarios of shared chargers, and the verdict on each scenario.

Two chargers on HTTP and the coordinator are processes of their own. This process plays two fleets of
two brands, an operator and a technician. The scenarios are:

- (1) the schedule charges a robot;
- (2) a robot and an operator request a charge;
- (3) there are more robots than chargers, and a pad is blocked;
- (4) a robot stands at the wrong charger;
- (5a) chargers overheat;
- (5b) a robot cannot be charged.

A line that begins with `so:` is a fact that the demo awaits. If the fact does not come, the demo ends
with exit code 1.
"""

from collections.abc import Iterable
from itertools import groupby
from pathlib import Path
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import topics, words
from bridges.messages.stamps import duration
from bridges.settings.load import load
from hal_fakes.demo.demo_run import Demo
from hal_fakes.demo.fleets import DemoFleets
from hal_fakes.demo.journal import Journal
from hal_fakes.demo.world import World

ONE, TWO, PORTER = "AMR01", "AMR02", "P01"
A, B = "charger_a", "charger_b"
HERE = Path(__file__).parent
COORDINATOR = HERE / "charging_coordinator.yaml"


# --- the day: the scenarios in order -----------------------------------------------------------


def dawns(world: World) -> bool:
    """Are both chargers idle, and does the coordinator publish?"""
    return _idle(world) and bool(world.places)


def live(world: World) -> None:
    """Play all scenarios in order."""
    fleets = DemoFleets(world, load(COORDINATOR).section)
    world.join(fleets)
    with world.leg("1 scheduled", f"the schedule charges {ONE} to 96 % all day"):
        _scheduled(world, fleets)
    with world.leg(
        "2 ad-hoc",
        "a robot requests a charge, and an operator requests a charge for the robot on the pad",
    ):
        _ad_hoc(world, fleets)
    with world.leg("3 stacked", f"{PORTER} is full and stays on its pad; {ONE} and {TWO} come"):
        _stacked(world, fleets)
    with world.leg("4 wrong station", f"{ONE} is assigned to {A} and drives to {B}"):
        _wrong_station(world, fleets)
    with world.leg("5a station faulty", f"{A} is hot at the self-check, {B} during the charge"):
        _stations_faulty(world, fleets)
    with world.leg("5b robot faulty", f"the receiver of {TWO} is defective"):
        _robot_faulty(world, fleets)


def _idle(world: World) -> bool:
    return world.charger_is(A, "IDLE") and world.charger_is(B, "IDLE")


def _charges(world: World, charger: str, who: str, within_s: float = 12) -> None:
    charging = f"{who} is charged at {charger}"
    world.shows(charging, lambda: world.charger_is(charger, "CHARGING", who), within_s)


def _shown(world: World, fleets: DemoFleets, charger: str, text: str) -> None:
    seen = f"the coordinator shows {charger}: {text}"
    world.shows(seen, lambda: fleets.shown.get(charger) == text)


def _sent(world: World, who: str, place: str, within_s: float = 10) -> None:
    world.shows(f"{who} is told to {place}", lambda: world.places[who] == place, within_s)


def _error(world: World, charger: str, error: str, who: str = "", within_s: float = 10) -> None:
    told = f"{charger} reports: {error}"
    world.shows(told, lambda: world.charger_is(charger, "ERROR", who, error), within_s)


def _alerted(world: World, code: str, text: str, within_s: float = 5) -> None:
    def is_told() -> bool:
        return any(a.subtitle == code and text in a.message for a in world.alerts)

    world.shows(f"a person is told: {text}", is_told, within_s)


def _free(world: World, within_s: float = 10) -> None:
    world.shows("both chargers are free again", lambda: _idle(world), within_s)


def _waits(world: World, fleets: DemoFleets, who: str, why: str, within_s: float = 10) -> None:
    def queued() -> bool:
        return f"/{who} " in fleets.queue and why in fleets.queue

    world.shows(f"{who} waits in the queue: {why}", queued, within_s)


def _mended(world: World, charger: str) -> None:
    """Mend the charger, and reset its daemon as a technician does, with `rmf-bridge reset`."""
    world.note("is cooled and reset by the technician", charger)
    world.press(charger, "over_temperature", False)
    world.daemons[charger].reset()
    world.shows(f"{charger} is in service", lambda: world.charger_is(charger, "IDLE"), 8)


def _scheduled(world: World, fleets: DemoFleets) -> None:
    fleets.leaves(ONE)
    world.pause(3.0)
    fleets.rests(ONE, 92)
    _sent(world, ONE, f"charge at {A}")
    _shown(world, fleets, A, f"ASSIGNED tiny/{ONE}, by the schedule")
    _charges(world, A, ONE)
    _sent(world, ONE, "wait at wait_1")
    _free(world)


def _ad_hoc(world: World, fleets: DemoFleets) -> None:
    fleets.needs(TWO, 40)
    fleets.robot(PORTER).battery_percent = 70
    fleets.leaves(PORTER, "bay_b")
    _error(world, B, "wrong docking: porter/P01 is not assigned here", PORTER)
    world.note(f"an operator wants {PORTER} charged: rmf-bridge send charger any --queue")
    request = d.ChargerRequest("", "porter", PORTER, duration(30.0), "operator-1")
    world.say([(topics.ADAPTER_CHARGER_REQUESTS, request)])
    _charges(world, B, PORTER)
    _shown(world, fleets, B, f"CHARGING porter/{PORTER}, by an operator")
    _charges(world, A, TWO)
    _shown(world, fleets, A, f"CHARGING tiny/{TWO}, by the robot")
    full = "both are full, and their chargers have released them"
    world.shows(full, lambda: world.charger_is(A, "IDLE") and world.charger_is(B, "RELEASED"))


def _stacked(world: World, fleets: DemoFleets) -> None:
    fleets.needs(ONE, 40)
    _sent(world, ONE, f"charge at {A}")
    fleets.needs(TWO, 40)
    _waits(world, fleets, TWO, f"porter/{PORTER} stands at {B}")
    _sent(world, TWO, "wait at wait_2")
    blocks = f"porter/{PORTER} stands at {B}, and tiny/{TWO} waits for that station"
    _alerted(world, "PAD_BLOCKED", blocks)
    fleets.leaves(PORTER)
    _charges(world, B, TWO)
    _sent(world, ONE, "wait at wait_1")
    _sent(world, TWO, "wait at wait_2")
    _free(world)


def _wrong_station(world: World, fleets: DemoFleets) -> None:
    fleets.needs(ONE, 60)
    _sent(world, ONE, f"charge at {A}")
    fleets.strays(ONE, "dock_b")
    _error(world, B, f"wrong docking: tiny/{ONE}", ONE)
    world.shows(f"{A} is kept for {ONE}", lambda: world.charger_is(A, "ASSIGNED", ONE), 2)
    _sent(world, ONE, "wait at wait_1")
    _sent(world, ONE, f"charge at {A}")
    _charges(world, A, ONE)
    _sent(world, ONE, "wait at wait_1")
    _free(world)


def _stations_faulty(world: World, fleets: DemoFleets) -> None:
    world.press(A, "over_temperature", True)
    fleets.needs(ONE, 40)
    _error(world, A, "station: over temperature", ONE)
    _alerted(world, "STATION_OUT_OF_SERVICE", f"{A}: station: over temperature")
    _charges(world, B, ONE)
    world.shows(f"{A} stays out of service", lambda: world.charger_is(A, "ERROR"), 1)
    _mended(world, A)
    world.press(B, "over_temperature", True)
    _error(world, B, "station: over temperature", ONE)
    _alerted(world, "STATION_OUT_OF_SERVICE", f"{B}: station: over temperature")
    _charges(world, A, ONE)
    good = f"{ONE} is not counted as defective"
    world.shows(good, lambda: not world.alerted("ROBOT_FAULTY"), 1)
    _mended(world, B)
    _free(world)


def _robot_faulty(world: World, fleets: DemoFleets) -> None:
    for charger in (A, B):
        world.fail(charger, "receiver", "wrong")
    fleets.needs(TWO, 40)
    for charger in (A, B):
        _error(world, charger, "robot: authentication timeout", TWO)
    faulty = f"tiny/{TWO} failed at {A} and at {B}: not tried again"
    _alerted(world, "ROBOT_FAULTY", faulty)
    _sent(world, TWO, "wait at wait_2")
    for charger in (A, B):
        world.fail(charger, "receiver", "ok")
    fleets.needs(ONE, 60)
    _charges(world, A, ONE)
    _sent(world, ONE, "wait at wait_1")
    _free(world)


# --- the check of the day, from the journal alone ------------------------------------------------

CHARGED: Final = {A: [ONE, TWO, ONE, ONE, ONE, ONE], B: [PORTER, TWO, ONE]}
"""The only charges that are allowed. Each charger has its robots in the order of their charges."""


def problems(journal: Journal) -> list[str]:
    """Return all errors of the day. The list is empty after a correct day."""
    states = [state for state in journal.states if isinstance(state, d.ChargerState)]
    return [*_charged(states), *_shared(states), *_unverified(states)]


def _charged(states: list[d.ChargerState]) -> Iterable[str]:
    for charger, expected in CHARGED.items():
        seen = [(_charging(s), s.robot_name) for s in states if s.charger_name == charger]
        robots = [who for (charging, who), _ in groupby(seen) if charging]
        if robots != expected:
            yield f"{charger} charged {' '.join(robots) or 'nobody'}, expected {' '.join(expected)}"


def _shared(states: list[d.ChargerState]) -> Iterable[str]:
    """Yield an error if a robot is charged at two chargers at once, according to the chargers'
    states."""
    latest: dict[str, d.ChargerState] = {}
    for state in states:
        latest[state.charger_name] = state
        charging = [s.robot_name for s in latest.values() if _charging(s)]
        if len(set(charging)) != len(charging):
            yield f"{state.robot_name} was charged at two chargers at once"
            return


def _unverified(states: list[d.ChargerState]) -> Iterable[str]:
    """Yield an error for the first charge that the coordinator did not request."""
    for state in states:
        if _charging(state) and not state.request_id.startswith("charger_coordinator/"):
            yield f"{state.charger_name} charged for {state.request_id or 'no request'}"
            return


def _charging(state: d.ChargerState) -> bool:
    return words.word(d.ChargerStateValue, state.state) == "CHARGING"


DEMO: Final = Demo(
    files={A: HERE / "charging_a.yaml", B: HERE / "charging_b.yaml", "coordinator": COORDINATOR},
    dawn=f"{A} and {B} idle, and each robot has an assigned place",
    dawns=dawns,
    live=live,
    problems=problems,
    right="each scenario went as planned; never two robots at one charger.",
    outcomes={
        "1 scheduled": f"{ONE} came home at 92 %, and the schedule sent it to a charger",
        "2 ad-hoc": f"{TWO}'s fleet and an operator (for {PORTER}) requested a charge: both charged",
        "3 stacked": f"{TWO} waited, a person was told who blocks {B}, and {TWO} was next at {B}",
        "4 wrong station": f"{B} gave {ONE} no power; {ONE} was sent to {A} and charged there",
        "5a station faulty": f"{ONE} was charged at the other charger each time, and counts as good",
        "5b robot faulty": f"{TWO} failed at two chargers, and no third try came; {ONE} was charged",
    },
)
