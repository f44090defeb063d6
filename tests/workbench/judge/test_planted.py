"""Wrong nodes among correct nodes. In a play, the judge moves each device, as RMF would. The judge must
convict each wrong node, and only by the law that the node breaks. The judge must convict no correct
node, even under load, during an outage of the network, or after a restart.

`pytest -s` prints for each planted defect the law that convicts the node, and the false alarms. Each
defect breaks a rule of RMF's messages, of RMF's supervisors or of RMF's fleet adapters.
"""

from collections.abc import Callable, Sequence
from random import Random

import pytest

from tests.depth import part
from tests.site.network import CLEAR, Weather
from tests.workbench.judge.nodes import wrong_charger, wrong_door, wrong_lift
from tests.workbench.judge.nodes.different import (
    ChargerInError,
    DoorOnChange,
    EagerLift,
    LeasedDoor,
    LiftInFire,
    LiftWithoutModes,
    SimulatedLift,
    SlowLift,
)
from tests.workbench.judge.nodes.right_charger import RightCharger
from tests.workbench.judge.nodes.right_door import RightDoor
from tests.workbench.judge.nodes.right_lift import RightLift
from tests.workbench.judge.test_limits import Line, is_broken, leaf, to_door
from tests.workbench.judge.world import Seat, World, told
from workbench.judge.charge_scenario import ChargeScenario
from workbench.judge.judge import JudgedKind
from workbench.judge.scenarios import PassageScenario, RideScenario, Scenario
from workbench.rmf_model import Party

Make = Callable[[], Party]


class NextLift(RightLift):
    """A second lift beside the judged node. If the states of the second lift stop too, the network is
    at fault, and not the judged node."""

    name = "Lift9"


def play_for(node: Party, restarts: bool) -> tuple[JudgedKind, str, Scenario]:
    if isinstance(node, RightLift):
        ride = RideScenario("Lift1", ("L1", "L3"), 1, 60.0, restarts=restarts)
        return "lift", "Lift1", ride
    if isinstance(node, RightDoor):
        return "door", "ward", PassageScenario("ward", 3, 60.0, restarts=restarts)
    return "charger", "bay1", ChargeScenario("bay1", "fleet/red", "r1", 20.0)


def convicted(
    *makes: Make,
    weather: Weather = CLEAR,
    seed: int = 1,
    cut: tuple[float, float] | None = None,
    restarts: float | None = None,
) -> set[str]:
    """Let the judge play with these nodes, and return the laws that the nodes break. The nodes publish
    under one name, 0.3 s apart.

    `cut` has the time (s) at which the judge loses the network, and the duration (s). At `restarts` (s)
    the node and RMF restart.
    """
    world = World(Random(seed))
    world.air.weather = weather
    world.add(NextLift())
    seats: list[Seat] = []
    again: list[Seat] = []
    for n, make in enumerate(makes):
        world.timeline.run(0.3 * n)
        seats += world.add(make())
    kind, name, scenario = play_for(seats[0].party, restarts is not None)
    if cut is not None:
        world.timeline.at(cut[0], lambda: world.air.cut_off("judge", sum(cut)))
    if restarts is not None:
        world.timeline.at(restarts, seats[0].leave)
        world.timeline.at(restarts + 2.9, lambda: again.extend(world.add(makes[0]())))
    judging = world.judge(kind, name, scenario)
    return told(judging, world.timeline.now)["broken"]


LOADED = Weather(lost=0.0, states_lost=0.0, late=0.3, twice=0.0, latest_s=0.8)
PLANTED: list[tuple[str, Sequence[Make], set[str]]] = [
    ("L END is refused without a floor", [wrong_lift.EndNeedsAFloor], {"L5.ends"}),
    ("L END of anybody ends the session", [wrong_lift.AnyEndEnds], {"L5.foreign"}),
    ("L states come on change only", [wrong_lift.LiftOnlyOnChange], {"L2.rate"}),
    ("L each request is answered by a state", [wrong_lift.LiftAnswers], {"L2.answer"}),
    ("L the session is over when the car leaves", [wrong_lift.LeavesWithoutSession], {"L4.ends"}),
    ("L a second session takes the lift", [wrong_lift.LastOneWins], {"L4.ends"}),
    ("L the session ends by a timeout", [wrong_lift.SessionTimesOut], {"L4.ends"}),
    ("L another lift's request counts", [wrong_lift.OtherLiftsRequest], {"L1.other"}),
    ("L adapters' requests count too", [wrong_lift.HearsBothTopics], {"L1.bypass"}),
    ("L the session has the vendor's name", [wrong_lift.OwnSessionName], {"L4.own"}),
    ("L two nodes publish one lift", [RightLift, RightLift], {"B0.one"}),
    ("L states have no stamp", [wrong_lift.LiftWithoutStamps], {"L3.stamp"}),
    ("L an old OPEN is repeated", [wrong_lift.LiftStaleOpen], {"L7.fresh"}),
    (
        "L an old OPEN is stamped anew",
        [wrong_lift.LiftReadsDoorOnce],
        {"L7.stopped", "L7.jump"},
    ),
    ("L OPEN is shown while the car moves", [wrong_lift.OpenWhileMoving], {"L7.stopped"}),
    ("L AGV mode is shown as HUMAN", [wrong_lift.LiftModeMixed], {"L7.agv"}),
    ("L floors are not listed", [wrong_lift.LiftListsOtherFloors], {"L8.floor"}),
    ("L an unknown floor is the first one", [wrong_lift.GoesToTheDefaultFloor], {"L8.destination"}),
    (
        "L an unknown floor is accepted",
        [wrong_lift.ShowsWhatItWasAsked],
        {"L9.unserved", "L8.destination"},
    ),
    ("D OPEN is shown before the door is open", [wrong_door.OpenAsAsked], {"D3.travel"}),
    ("D silence closes the door", [wrong_door.SilenceCloses], {"D2.stays"}),
    ("D the operator's timer closes the door", [wrong_door.DoorPulses], {"D2.stays"}),
    ("D another door's CLOSE counts", [wrong_door.DoorHearsEveryName], {"D2.stays"}),
    ("D adapters' CLOSE counts", [wrong_door.DoorHearsAdapters], {"D1.bypass"}),
    ("D the held door flaps", [wrong_door.DoorFlaps], {"D2.holds"}),
    ("D states come on change only", [wrong_door.DoorOnlyOnChange], {"D1.rate"}),
    ("D an old OPEN is repeated", [wrong_door.DoorStaleOpen], {"D3.fresh"}),
    ("D two nodes publish one door", [RightDoor, RightDoor], {"B0.one"}),
    ("C start_timeout is ignored", [wrong_charger.ChargerWaitsForEver], {"C2.start"}),
    ("C a cancel is ignored", [wrong_charger.ChargerIgnoresCancels], {"C3.cancel"}),
    ("C any cancel cancels", [wrong_charger.AnyCancelCancels], {"C3.foreign"}),
    ("C the wrong robot is named", [wrong_charger.ChargerNamesAnotherRobot], {"C5.robot"}),
    ("C another station's request counts", [wrong_charger.ChargerHearsEveryName], {"C5.robot"}),
    ("C a second request takes the promise", [wrong_charger.PromiseIsTakenOver], {"C1.keeps"}),
    ("C a vendor's code is shown", [wrong_charger.ChargerVendorCodes], {"C1.numbers"}),
    ("C two nodes publish one station", [RightCharger, RightCharger], {"B0.one"}),
]


@pytest.mark.parametrize(("defect", "nodes", "laws"), PLANTED, ids=[one[0] for one in PLANTED])
def test_a_planted_defect_is_convicted_by_its_law_alone(
    defect: str, nodes: Sequence[Make], laws: set[str]
) -> None:
    found = convicted(*nodes)
    alarms = ", ".join(sorted(found - laws)) or "none"
    convicts = ", ".join(sorted(found & laws)) or "acquitted"
    print(f"\n{defect} · {convicts} · false alarms: {alarms}", end="")  # noqa: T201
    assert found == laws


ACQUITTED = {"D OPEN is shown before the door is open"}
"""The defect that the judge may miss on a busy network. The judge detects this defect only if OPEN
comes within 0.3 s after the request."""


@pytest.mark.parametrize(("defect", "nodes", "laws"), PLANTED, ids=[one[0] for one in PLANTED])
def test_under_load_a_planted_defect_is_convicted_by_no_other_law(
    defect: str, nodes: Sequence[Make], laws: set[str]
) -> None:
    """Messages are up to 0.8 s late, and then arrive together."""
    found = [convicted(*nodes, weather=LOADED, seed=seed) for seed in range(4)]
    assert set().union(*found) <= laws
    assert sum(map(bool, found)) >= (0 if defect in ACQUITTED else 3)


RIGHT: list[Make] = [
    *(RightLift, SimulatedLift, SlowLift, EagerLift, LiftWithoutModes, LiftInFire),
    *(RightDoor, DoorOnChange, LeasedDoor),
    *(RightCharger, lambda: RightCharger(2.0), ChargerInError),
]
NAMES = [make().__class__.__name__ for make in RIGHT]


@pytest.mark.parametrize("make", RIGHT, ids=NAMES)
def test_no_right_node_is_convicted_under_load(make: Make) -> None:
    """Messages are up to 0.8 s late, and then arrive together."""
    assert [convicted(make, weather=LOADED, seed=seed) for seed in range(5)] == [set()] * 5


@pytest.mark.parametrize("for_s", [3.0, 8.0, 10.5, 60.0])
@pytest.mark.parametrize("make", RIGHT, ids=NAMES)
def test_no_right_node_is_convicted_for_the_silence_of_the_network(
    make: Make, for_s: float
) -> None:
    """After a short outage all messages arrive. After a longer outage the messages are lost."""
    for at in part((5.0, 12.0, 19.0, 26.0, 33.0), 2, first=int(for_s) % 2):
        assert convicted(make, cut=(at, for_s)) == set(), at


@pytest.mark.parametrize("at", [6.0, 14.0, 21.0, 29.0])
@pytest.mark.parametrize("make", RIGHT, ids=NAMES)
def test_no_right_node_is_convicted_for_a_restart(make: Make, at: float) -> None:
    assert convicted(make, restarts=at) == set()


@pytest.mark.parametrize("at", [4.5, 9.0, 14.0, 21.0, 29.0])
@pytest.mark.parametrize("make", RIGHT, ids=NAMES)
def test_no_right_node_is_convicted_by_a_judge_that_is_killed_and_started_again(
    make: Make, at: float
) -> None:
    """The killed judge leaves its session or its hold behind. The second judge first listens, then
    plays."""
    world = World()
    seats = world.add(NextLift(), make())
    kind, name, scenario = play_for(seats[1].party, False)
    world.judge(kind, name, scenario, most_s=at)
    for again in (None, play_for(seats[1].party, False)[2]):
        judging = world.judge(kind, name, again, for_s=20.0)
        assert told(judging, world.timeline.now)["broken"] == set()


@pytest.mark.parametrize("jitter_s", [0.1, 0.2, 0.4])
def test_jitter_is_no_answer_to_requests_that_arrive_together_with_states(jitter_s: float) -> None:
    """States jitter by up to `jitter_s`, and a request comes just before each state. Check that the
    judge does not take such a state for an answer to the request."""
    for seed in range(30):
        random = Random(seed)
        lines: list[Line] = []
        for n in range(120):
            at = n + jitter_s * random.uniform(-1.0, 1.0)
            lines.append(leaf(at, read_at=float(n)))
            lines += [to_door(at - 0.05, 0)] if n > 5 + 10 * random.random() else []
        assert not is_broken("door", "D1.answer", lines)
