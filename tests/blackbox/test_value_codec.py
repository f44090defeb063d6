"""Values of a daemon's decision logic become trees of plain values, and the trees become the same
values again. Decoding a tree runs no code."""

from typing import Any

import msgspec
import pytest
from msgspec.structs import replace

from bridges.blackbox.value_codec import UnknownValue, first_difference, tree, value
from bridges.kinds.charger.settings import RobotName
from bridges.kinds.lift.memory import LiftMemory, LiftSenses, LiftSession
from bridges.kinds.lift.relays import Channel, Relays
from bridges.kinds.lift.signals import (
    DoorReading,
    Hazard,
    LiftOutputs,
    LiftRequested,
    LiftSample,
    Side,
)
from bridges.kinds.shared.decision import Fault, IoFailed, OperatorReset, Sampled
from bridges.kinds.shared.durations import NEVER
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages.constants import LiftDoor
from bridges.messages.definitions import LiftRequest, Time

VALUES: list[Any] = [
    None,
    True,
    1.5,
    NEVER,
    "text",
    (1, ("a", None)),
    frozenset({Hazard.FIRE, Hazard.MANUAL}),
    {Hazard.FIRE: 1, ("a", 2): "b"},
    DoorReading.OPEN,
    LiftDoor.DOOR_OPEN,
    RobotName("fleet", "r1"),
    Sampled(LiftSample("L1", DoorReading.OPEN, hazards=frozenset({Hazard.FIRE}))),
    IoFailed("no answer"),
    OperatorReset(),
    MaySpeak(True),
    Woken(),
    LiftRequest("Lift1", Time(3, 4)),
    LiftOutputs(True, "L1", Side.REAR),
    Fault("A", "b"),
    LiftRequested("r1", True, "L3"),
    LiftMemory(
        senses=LiftSenses(read_at=3.0),
        session=LiftSession("r1", True, "L3", 2.0, retry_at=NEVER, fault=Fault("A")),
        relays=Relays(agv=Channel(True, 1.0, (1.0, 2.0))),
    ),
]


@pytest.mark.parametrize("one", VALUES, ids=lambda one: type(one).__name__)
def test_a_value_comes_back_unchanged_even_through_bytes(one: Any) -> None:
    packed = msgspec.msgpack.decode(msgspec.msgpack.encode(tree(one)))

    assert value(packed) == one
    assert type(value(packed)) is type(one)


def test_a_field_that_a_version_lacks_is_left_out_and_a_missing_one_has_its_default() -> None:
    told: Any = {"": "core.decision.Fault", "code": "A", "colour": "red"}

    assert value(told) == Fault("A", "")


@pytest.mark.parametrize(
    "told",
    [
        {"": "os.system", "=": ["true"]},
        {"": "core.decision.os"},
        {"": "core.names.check_length"},
        {"": "serve.daemon.Daemon"},
        {"": "core..decision.Fault"},
        {"": "lift.memory.replace"},
        {"": "lift.signals.Nobody"},
        {"": "lift.signals.Door", "=": "AJAR"},
        {"": "core.decision.Fault"},
        {"": "map", "=": [[1]]},
        {"": "map", "=": [[[{"": "map", "=": []}], 2]]},
        {},
    ],
    ids=str,
)
def test_a_tree_that_holds_no_value_of_a_core_is_refused(told: Any) -> None:
    with pytest.raises(UnknownValue):
        value(told)


def test_an_object_that_no_core_uses_cannot_become_a_tree() -> None:
    with pytest.raises(TypeError, match="Exception is not a value of a core"):
        tree(Exception())


def test_two_trees_are_compared_in_the_fields_that_both_versions_know() -> None:
    memory = LiftMemory(session=LiftSession("r1", True, "L3", 2.0))
    was, now = tree(memory), tree(replace(memory, fire_latched=True))
    assert isinstance(was, dict)
    older = {name: part for name, part in was.items() if name != "fire_latched"}

    assert first_difference(was, was) is None
    assert first_difference(older, was) is None
    assert first_difference(was, now) == ("fire_latched", False, True)
    assert first_difference(tree((1, Fault("A"))), tree((1, Fault("B")))) == ("1.code", "A", "B")
    assert first_difference([1], [1, 2]) == ("", [1], [1, 2])
