"""The present inputs and outputs of a daemon. The page reads them from the ring, which is the file with
the daemon's latest events."""

from pathlib import Path

from bridges.blackbox.entries import Decided
from bridges.blackbox.value_codec import tree
from bridges.kinds.door.signals import DoorOutputs, DoorSample
from bridges.kinds.shared.decision import IoFailed, Sampled
from workbench.page.levels import Levels


def step(event: object, *outputs: object) -> Decided:
    return Decided(1.0, "ward_door", tree(event), None, outputs=[tree(one) for one in outputs])


def test_the_last_sample_and_the_last_outputs_are_shown_in_words() -> None:
    levels = Levels(Path("nowhere"))
    outputs = DoorOutputs(hold_open=True)
    levels.take([step(Sampled(DoorSample(opened=False, closed=True)), outputs)])
    levels.take([step(Sampled(DoorSample(opened=True, closed=False)))])
    assert levels.sensed["ward_door"] == {
        "opened": "on",
        "closed": "off",
        "obstruction": "-",
        "fire": "-",
        "lost": "-",
        "errors": "none",
    }
    assert levels.driven["ward_door"]["hold open"] == "on"


def test_a_failed_reading_is_shown_as_failed() -> None:
    levels = Levels(Path("nowhere"))
    levels.take([step(IoFailed("no answer"))])
    assert levels.sensed == {"ward_door": {"the last reading": "failed: no answer"}}


def test_without_a_ring_nothing_is_known(tmp_path: Path) -> None:
    levels = Levels(tmp_path)
    levels.take([step(IoFailed("no answer"))])
    levels.look()
    assert (levels.sensed, levels.driven) == ({}, {})
