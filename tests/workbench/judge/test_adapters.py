"""The verdicts of the judge on fleet adapters. The judge must acquit RMF's own adapter. The judge must
convict each wrong adapter, and only by the law that the adapter breaks.

`pytest -s` prints for each planted defect the law that convicts the adapter, and the false alarms.
"""

from collections.abc import Callable
from random import Random

import pytest

from tests.depth import part
from tests.site.network import CLEAR, Weather
from tests.workbench.judge.nodes import adapters
from tests.workbench.judge.nodes.adapters import JazzyAdapter, LateToEnd, OtherFleet, RightAdapter
from tests.workbench.judge.nodes.right_door import RightDoor
from tests.workbench.judge.nodes.right_lift import RightLift
from tests.workbench.judge.world import Seat, Verdicts, World, told
from workbench.rmf_model import Party
from workbench.rmf_model.supervisors import DoorSupervisor, LiftSupervisor

LONG_S = 240.0
ROUGH = Weather()
TIMES = range(5, 75, 7)
"""The times (s) at which a party dies or loses the network: before, in and after the ride."""
Again = tuple[type[Party], float, float]


class SlowDoor(RightDoor):
    """The door takes up to 12 s to open."""

    def moves(self, now: float, age_s: float) -> None:
        for _ in range(4 if round(now * 4) % 24 == 0 else 0):
            super().moves(now, age_s)


def judged(
    adapter: RightAdapter,
    *beside: Party,
    name: str = "fleet",
    lift: RightLift | None = None,
    door: RightDoor | None = None,
    weather: Weather = CLEAR,
    seed: int = 1,
    cut: tuple[str, float, float] | None = None,
    again: Again | None = None,
    begins_at: float = 0.0,
) -> Verdicts:
    """Return the verdict after LONG_S seconds.

    `cut` has the name of a party that loses the network, the time (s), and the duration (s). `again`
    has a type of party that dies, the time (s), and the seconds until it returns. The judge starts at
    `begins_at` (s).
    """
    world = World(Random(seed))
    world.air.weather = weather
    world.air.best_effort = {"RightAdapter", "JazzyAdapter"}
    jazzy = adapter.jazzy
    nodes = [lift or RightLift(), door or RightDoor(), LiftSupervisor(jazzy), DoorSupervisor()]
    seats = world.add(*nodes, adapter, *beside)
    if cut is not None:
        who, at, for_s = cut
        world.timeline.at(at, lambda: world.air.cut_off(who, at + for_s))
    returned: list[Seat] = []
    if again is not None:
        kind, at, for_s = again
        [seat] = [seat for seat in seats if type(seat.party) is kind]
        fresh = kind(jazzy) if kind is LiftSupervisor else kind()
        world.timeline.at(at, seat.leave)
        world.timeline.at(at + for_s, lambda: returned.extend(world.add(fresh)))
    world.timeline.run(begins_at)
    judging = world.judge("adapter", name, for_s=LONG_S, most_s=LONG_S + 1.0)
    return told(judging, world.timeline.now)


Make = Callable[[], RightAdapter]
RIGHT: list[type[RightAdapter]] = [RightAdapter, JazzyAdapter]
OCCURS = {
    *("T1.numbers", "A7.id", "A7.stamp", "A7.floor", "A7.repeats", "A7.enters", "A7.rides"),
    *("A7.ends", "A7.stops", "A8.repeats", "A8.closes", "A8.stops"),
}


@pytest.mark.parametrize("make", RIGHT)
def test_rmfs_own_adapter_keeps_every_law(make: Make) -> None:
    found = judged(make(), door=SlowDoor())
    assert (found["broken"], found["kept"] - {"A7.again"}) == (set(), OCCURS)
    found = judged(make(), lift=LateToEnd())
    assert (found["broken"], "A7.again" in found["kept"]) == (set(), True)


@pytest.mark.parametrize("make", RIGHT)
def test_a_robot_is_judged_alone(make: type[RightAdapter]) -> None:
    found = judged(make("red", "blue"), name="fleet/blue")
    assert found["broken"] == set()
    assert judged(make("red"), name="fleet/blue")["kept"] == set()


@pytest.mark.parametrize("make", RIGHT)
def test_two_fleets_and_two_robots_at_one_lift_are_both_right(make: type[RightAdapter]) -> None:
    for name in ("fleet", "other"):
        assert judged(make("red", "blue"), OtherFleet("green"), name=name)["broken"] == set()


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("make", RIGHT)
def test_lost_and_late_messages_convict_nobody(make: type[RightAdapter], seed: int) -> None:
    adapter = make("red", "blue")
    assert judged(adapter, weather=ROUGH, seed=seed)["broken"] == set()


@pytest.mark.parametrize("for_s", [3.0, 8.0, 10.5, 60.0])
@pytest.mark.parametrize("who", ["judge", "adapter", "RightLift", "RightDoor", "LiftSupervisor"])
@pytest.mark.parametrize("make", RIGHT)
def test_a_lost_network_convicts_nobody(make: Make, who: str, for_s: float) -> None:
    for at in part(TIMES, 4, first=int(for_s) % 4):
        who = make().__class__.__name__ if who == "adapter" else who
        found = judged(make(), cut=(who, float(at), for_s), seed=at)
        assert found["broken"] == set(), at


@pytest.mark.parametrize("for_s", [1.0, 4.0, 20.0])
@pytest.mark.parametrize("who", ["adapter", LiftSupervisor, DoorSupervisor, RightLift, RightDoor])
@pytest.mark.parametrize("make", RIGHT)
def test_a_restart_convicts_nobody(
    make: type[RightAdapter], who: type[Party] | str, for_s: float
) -> None:
    kind = make if isinstance(who, str) else who
    for at in part(TIMES, 4, first=int(for_s) // 4 % 4):
        assert judged(make(), again=(kind, float(at), for_s))["broken"] == set(), at


@pytest.mark.parametrize("make", RIGHT)
def test_a_judge_that_is_started_again_in_a_ride_convicts_nobody(make: Make) -> None:
    for at in part(range(3, 75, 3), 4):
        assert judged(make(), begins_at=float(at))["broken"] == set(), at


PLANTED: list[tuple[str, Make, set[str]]] = [
    ("END is never sent", adapters.EndsNever, {"A7.ends"}),
    ("END is sent once only", adapters.EndsOnce, {"A7.again"}),
    ("END is sent for ever", adapters.EndsForEver, {"A7.stops"}),
    ("another floor is asked for on the ride", adapters.ChangesItsMind, {"A7.rides"}),
    ("the car is called back on the ride", adapters.CallsItBack, {"A7.rides"}),
    ("one robot has two ids", adapters.TwoIds, {"A7.id"}),
    ("CLOSE is never sent", adapters.NeverCloses, {"A8.closes"}),
    ("OPEN is requested for ever", adapters.OpensForEver, {"A8.stops"}),
    ("stamps go back", adapters.StampsGoBack, {"A7.stamp"}),
    ("the robot enters before OPEN", adapters.EntersEarly, {"A7.enters"}),
    ("the lift is requested once only", adapters.AsksOnce, {"A7.repeats"}),
    ("the door is requested once only", adapters.DoorAskedOnce, {"A8.repeats"}),
    ("AGV has the number of states", adapters.StateNumbers, {"T1.numbers"}),
    ("floors have other names", adapters.OtherFloorNames, {"A7.floor"}),
]


@pytest.mark.parametrize(("defect", "make", "laws"), PLANTED, ids=[one[0] for one in PLANTED])
def test_a_wrong_adapter_is_convicted_by_its_law(defect: str, make: Make, laws: set[str]) -> None:
    lift = LateToEnd() if make is adapters.EndsOnce else RightLift()
    lift.car, lift.floor_s = 2.0, 4.0
    found = judged(make(), lift=lift, door=SlowDoor())["broken"]
    alarms = ", ".join(sorted(found - laws)) or "none"
    convicts = ", ".join(sorted(found & laws)) or "acquitted"
    print(f"\n{defect} · {convicts} · false alarms: {alarms}", end="")  # noqa: T201
    assert found == laws


def test_nobody_is_convicted_by_another_fleets_wrong_adapter() -> None:
    for make in (adapters.EndsNever, adapters.NeverCloses, adapters.EndsForEver):
        assert judged(make(), OtherFleet("green"), name="other")["broken"] == set()
