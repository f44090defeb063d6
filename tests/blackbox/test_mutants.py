"""Commands on wrong recordings that the decoder still reads. Each command prints a sentence and gives
an exit code."""

import math
from pathlib import Path
from typing import Any

import pytest

from bridges.blackbox import entries
from bridges.blackbox.entries import DEEPEST, Clocks, Invalid, Known, Spoken
from bridges.blackbox.value_codec import UnknownValue, tree
from bridges.kinds.door.core import decide as decide_door
from bridges.kinds.lift.core import decide as decide_lift
from bridges.kinds.lift.signals import DoorReading
from bridges.kinds.shared.debounce import Settled
from bridges.kinds.shared.decision import IoFailed
from bridges.messages import definitions as d
from bridges.messages.heard import LONGEST_SENTENCE, MOST_PARTS, bounded
from tests.blackbox.mutants import Mutator, as_ring, corpus, ended, endings, write_file
from tests.depth import depth
from workbench.replay.typed import typed, types_of

LIFT, DOOR = types_of(decide_lift), types_of(decide_door)
ATTENDED = {"": "core.decision.Attended", "yes": True}


@pytest.mark.long(10)
@pytest.mark.parametrize("seed", range(depth(4, 40)))
def test_no_wrong_recording_ends_a_command_with_a_traceback(seed: int, tmp_path: Path) -> None:
    found = endings(Mutator(seed), 25, tmp_path)

    assert {"replay: 65", "replay: 66", "explain: 0", "plot: 66", "incident: 69"} <= set(found)


def test_unchanged_every_one_of_them_is_read(tmp_path: Path) -> None:
    for told in corpus():
        (tmp_path / "ring").write_bytes(as_ring(told))
        write_file(told, tmp_path / "a.mcap")
        for name in ("ring", "a.mcap"):
            assert ended(("replay", str(tmp_path / name))) == (0, "")
            heard = told.subject != "site"  # a coordinator is not a device, so `explain` finds none
            assert ended(("explain", str(tmp_path / name), told.subject)) == (int(not heard), "")


@pytest.mark.parametrize(
    "entry",
    [
        Clocks(math.nan, 0.0),
        Clocks(math.inf, 0.0),
        Clocks(0.0, -1e300),
        Spoken(0.0, True, "lift_states", "rmf_lift_msgs/msg/LiftState", "rolling", b""),
        Spoken(0.0, True, "lift_states", "rmf_lift_msgs/msg/Lift", "jazzy", b""),
        Spoken(0.0, True, "x", "rmf_fleet_msgs/msg/EmergencySignal", "jazzy", b""),
    ],
)
def test_an_entry_with_a_time_or_a_message_that_cannot_be_is_none(entry: entries.AnyEntry) -> None:
    with pytest.raises(Invalid):
        entries.decode(entries.encode(entry))


def test_an_entry_is_nested_as_deep_as_any_core_needs_and_no_deeper() -> None:
    memory: Any = None
    for _ in range(DEEPEST):
        memory = [memory]
    entry = Known(0.0, "Lift1", memory, None, None, None)
    assert entries.decode(entries.encode(entry)) == entry
    with pytest.raises(Invalid, match="nested more than 60 deep"):
        entries.decode(entries.encode(Known(0.0, "Lift1", [memory], None, None, None)))


@pytest.mark.parametrize(
    ("told", "hint"),
    [
        (tree(IoFailed("no answer")), DOOR["memory"]),
        ({"": "core.decision.IoFailed", "reason": 7}, LIFT["event"]),
        ({"": "core.decision.Sampled", "sample": None}, LIFT["event"]),
        ({"": "core.decision.Sampled", "sample": ATTENDED}, LIFT["event"]),
        ({"": "door.signals.DoorSample"}, LIFT["event"]),
        ({"": "rmf.definitions.LiftState", "=": 3}, LIFT["event"]),
        (True, int),
        (math.nan, float),
        (["a"], tuple[str, str]),
        (["a", "b", "c"], tuple[str, str]),
        (["a", 1], tuple[str, ...]),
        ({"": "map", "=": [["a", 1]]}, dict[str, str]),
        ({"": "set", "=": [1]}, frozenset[str]),
        (tree(Settled("x", "x", 0.0)), Settled[DoorReading]),
    ],
)  # fmt: skip
def test_a_value_of_another_type_than_a_core_takes_is_refused(told: Any, hint: Any) -> None:
    with pytest.raises(UnknownValue):
        typed(told, hint)


def test_only_what_is_too_long_of_a_message_is_cut_and_it_says_how_long_it_was() -> None:
    state = d.LiftState(lift_name="L" * 1_000_000, available_floors=("a",) * 9_000, session_id="x")
    kept = bounded(state)
    assert kept.lift_name == "L" * 256 + "… (1000000 characters)"
    assert (len(kept.available_floors), kept.session_id) == (MOST_PARTS, "x")
    said = bounded(d.ChargerState(error_message="e" * 2_000)).error_message
    assert said == "e" * LONGEST_SENTENCE + "… (2000 characters)"
    robots = tuple(d.RobotState(name=f"robot_{n}", path=(d.Location(),)) for n in range(200))
    fleet = d.FleetState("fleet", robots)
    assert bounded(fleet) is fleet
