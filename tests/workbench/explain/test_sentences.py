"""The exact text of `explain` for each common situation, in `golden/*.txt`.

`python -m tests.workbench.explain` writes the texts again. Read the differences before you commit them.
"""

from datetime import UTC
from pathlib import Path

import pytest

from bridges.messages.definitions import LiftDoor, LiftState
from bridges.runtime.faults import for_explain
from tests.workbench.explain.situations import SCENES
from workbench.explain.heard_devices import HeardDevices
from workbench.explain.lift_facts import LiftFacts
from workbench.explain.text import SCREEN_LINES, lines

GOLDEN = Path(__file__).parent / "golden"


def told(name: str) -> list[str]:
    """Return the lines that `explain` prints for this situation."""
    heard, kind, device = SCENES[name]()
    site = HeardDevices(device)
    for one in heard:
        site.take(one)
    known = for_explain()
    return lines(site.explain(kind, device, UTC, known), UTC)


@pytest.mark.parametrize("name", SCENES)
def test_a_situation_is_explained_on_one_screen(name: str) -> None:
    screen = told(name)
    assert len(screen) <= SCREEN_LINES
    assert screen == (GOLDEN / f"{name}.txt").read_text(encoding="utf-8").splitlines()


def test_a_robot_that_has_just_been_shown_the_open_door_may_be_in_the_car() -> None:
    heard, _, name = SCENES["holder_alone_is_dead"]()
    site = HeardDevices(name)
    for one in heard:
        site.take(one)
        state = getattr(one, "message", None)
        if isinstance(state, LiftState) and state.door_state == LiftDoor.DOOR_OPEN:
            break
    lift = site.known["lift", name]
    assert isinstance(lift, LiftFacts)
    assert lift.told("boarded", site.now) == "no", "the daemon tells it a second later"
    assert lift.in_car("fleet/red", site.now) == "fleet/red may be in the car."
