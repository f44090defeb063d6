"""Tests of the rules in every state within some steps. RMF must not go on without its item, and no item
may leave the machine twice."""

from typing import Any

from tests.depth import depth
from tests.kinds.dispenser.walk import GUID, WALKER, World, start

BEGUN = (
    (),
    ("RMF asks",),
    ("RMF asks", 0.5),
    ("RMF asks", 0.5, "finishes"),
    ("RMF asks", 0.5, "finishes", 0.5),
    ("RMF asks", 0.5, "dies"),
    ("RMF asks", 0.5, "stops", 2.0),
    ("RMF hears or not", "RMF asks", 0.5, "stops", 2.0, "RMF hears or not"),
    ("RMF asks", "disk full or not", 0.5),
    ("RMF asks", 0.5, "bus down or not", 2.0),
)
"""The steps to the states from which the walk begins."""


def checked(step: Any) -> None:
    """Check the rules DISPENSER-1, DISPENSER-2, DISPENSER-3 and DISPENSER-7 in one step."""
    world: World = step.world
    phase, moved = world.phase, world.moved
    assert not (phase.outcome == "completed" and moved == 0 and not world.decided), world
    assert moved <= 1 or world.decided, world
    if step.outputs.start:
        assert f'"guid":"{GUID}","phase":"running"'.encode() in world.disk, world
    in_doubt = world.memory.lost or world.memory.doubtful()
    assert not (in_doubt and step.outputs.start), world


def test_every_state_within_some_steps_keeps_the_promises_to_rmf() -> None:
    roots = [WALKER.path(start(), *steps, seen=checked) for steps in BEGUN]
    states = WALKER.walk(roots, depth(3, 5), seen=checked)
    outcomes = {world.phase.outcome for world in states}
    assert outcomes == {"", "completed", "failed"}
    assert {world.moved for world in states} >= {0, 1}
    assert any(world.memory.doubtful() for world in states)
    assert len(states) > 500
