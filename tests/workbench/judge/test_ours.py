"""The verdicts of the judge on our own daemons, each with its driver and a simulated device. The judge
must accuse no daemon."""

import pytest

from tests.site.building import CHARGERS, DOORS, LIFTS, devices
from tests.site.daemons import DeviceDaemon
from tests.workbench.judge.world import World, told
from workbench.judge.charge_scenario import ChargeScenario
from workbench.judge.judge import JudgedKind
from workbench.judge.scenarios import PassageScenario, RideScenario, Scenario

CASES: list[tuple[JudgedKind, str, Scenario]] = [
    *(
        ("lift", name, RideScenario(name, ("L1", "L3"), robots, 90.0, restarts=restarts))
        for name in LIFTS
        for robots in (1, 2)
        for restarts in (False, True)
    ),
    *(
        ("door", name, PassageScenario(name, 3, 60.0, restarts=r))
        for name in DOORS
        for r in (False, True)
    ),
    *(("charger", name, ChargeScenario(name, "fleet/red", "r1", 20.0)) for name in CHARGERS),
]


@pytest.mark.parametrize(("kind", "name", "scenario"), CASES)
def test_ours_keep_every_law(kind: JudgedKind, name: str, scenario: Scenario) -> None:
    world = World()
    daemon = DeviceDaemon(world.timeline, world.air, devices(world.timeline)[name])
    daemon.start()
    judging = world.judge(kind, name, scenario)
    daemon.kill()
    found = told(judging, world.timeline.now)
    assert (found["broken"], judging.note) == (set(), "")
