"""RMF's phase DispenseItem must not count an undelivered item as done if the daemon dies or messages
are lost.

DISPENSER-1, DISPENSER-2, DISPENSER-3, DISPENSER-7: in these tests the daemon dies at each effect of a
dispensing. `world.py` explains effects.
"""

from collections.abc import Callable, Iterable

import pytest

from tests.depth import depth
from tests.kinds.dispenser.world import World
from workbench.rmf_model.workcells import WorkcellPhase

WHOLE_S = 6.0


def told(world: World) -> str:
    """If the outcome of the request is in doubt, let a person look at the machine and decide.

    Return the person's decision, or "" without a doubt.
    """
    if "OUTCOME_UNKNOWN" not in world.faults:
        return ""
    world.run(4.0)
    assert world.results()[-1:] in ([], ["ACKNOWLEDGED"])
    verdict = "done" if world.plant.moved else "failed" if world.plant.failures else "again"
    world.decide(verdict)
    return verdict


def effects(jam: str = "") -> list[str]:
    """Return the names of all effects of one dispensing in which the daemon does not die."""
    world = World()
    dispensed(world, jam)
    return world.effects


def dispensed(world: World, jam: str = "", seconds: float = 12.0) -> WorkcellPhase:
    """Let RMF repeat its request until its phase ends or the outcome is in doubt.

    If `jam` is not "", the conveyor is stuck.
    """
    if jam:
        world.plant.fail("conveyor", "stuck")
    phase = world.ask()
    world.run(seconds, until=lambda: bool(phase.outcome) or "OUTCOME_UNKNOWN" in world.faults)
    return phase


def test_a_request_and_its_start_are_on_disk_before_they_are_published() -> None:
    every = effects()
    asked = every.index("before the disk", every.index("after dispenser_states"))
    assert every[asked : asked + 10] == [
        *("before the disk", "after the disk"),  # the daemon writes the request to its disk
        *("before dispenser_states", "after dispenser_states"),
        *("before dispenser_results", "after dispenser_results"),
        *("before the disk", "after the disk"),  # the daemon writes to its disk that it starts
        *("before the outputs", "after the outputs"),
    ]


@pytest.mark.parametrize("jam", ["", "stuck"])
def test_wherever_the_daemon_dies_rmf_goes_on_only_with_exactly_one_item(jam: str) -> None:
    doubts = 0
    for place in range(len(effects(jam)) + 4):
        world = World(die_at=place)
        phase = dispensed(world, jam)
        said = told(world)
        doubts += bool(said)
        world.run(20.0, until=is_over(phase))
        what = (place, world.effects[place : place + 1], said, phase.outcome, phase.why)
        assert world.plant.moved == (0 if jam else 1), what
        assert phase.outcome == ("failed" if jam else "completed"), what
    assert doubts > 4  # these deaths fell between the start and the outcome


def is_over(phase: WorkcellPhase) -> Callable[[], bool]:
    return lambda: bool(phase.outcome)


def losing(topic: str, first: int, last: int) -> Callable[[str, int], bool]:
    return lambda name, number: name == topic and first <= number <= last


def losses(most: int) -> Iterable[tuple[str, int, int]]:
    """Yield (topic, first, last). The test loses the messages of this topic from number `first` to
    number `last`."""
    for topic in ("dispenser_requests", "dispenser_states", "dispenser_results"):
        for first in range(most):
            for last in range(first, most):
                yield topic, first, last


@pytest.mark.parametrize("jam", ["", "stuck"])
def test_no_run_of_lost_messages_sends_the_robot_off_without_its_item(jam: str) -> None:
    for topic, first, last in losses(depth(8, 24)):
        world = World(lose=losing(topic, first, last))
        if jam:
            world.plant.fail("conveyor", "stuck")
        phase = world.ask()
        world.run(60.0, until=is_over(phase))
        what = (topic, first, last, phase.outcome, phase.why)
        assert phase.outcome == ("failed" if jam else "completed"), what
        assert world.plant.moved == (0 if jam else 1), what


def every_third(first: int) -> Callable[[str, int], bool]:
    return lambda name, number: "request" not in name and number % 3 == first % 3


def test_a_death_and_lost_messages_together_send_no_robot_off_without_its_item() -> None:
    """Only states that the daemon publishes after its restart could wrongly complete RMF's phase."""
    for place in range(0, len(effects()) + 4, depth(3, 1)):
        for first in range(3):
            world = World(die_at=place, lose=every_third(first))
            phase = world.ask()
            world.run(12.0, until=is_over(phase))
            assert not phase.outcome or world.plant.moved == 1, (place, first, phase.why)
