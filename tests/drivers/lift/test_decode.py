"""Truth tables of a lift driver. They turn signals into a sample, and outputs into the levels of
lines."""

from itertools import product
from typing import Any

import pytest

from bridges.kinds.lift.signals import DoorReading, Hazard, LiftOutputs, LiftSample, Motion, Side
from drivers.lift.dry_contact import DryContactLiftSettings, debounce, decode, encode, wires
from drivers.lift.table import conditional
from tests.drivers.lift.wirings import bits, coil, inputs, line, settings, whole


def sample(wired: DryContactLiftSettings, *asserted: str) -> LiftSample:
    shown = {w.signal: w.signal in asserted for w in wires(wired) if w.direction == "in"}
    assert set(asserted) <= shown.keys()
    return decode(wired, shown, conditional(wired))


def test_without_an_asserted_line_the_car_is_between_floors() -> None:
    assert sample(settings()) == LiftSample(level=None, door=DoorReading.BETWEEN, agv=False)


def test_a_sample_with_every_line_asserted() -> None:
    wired = settings(
        inputs=inputs(up=line(50), down=line(51), overload=line(52), code_blue=line(53))
    )
    asserted = ("agv_mode", "door_opened", "floor_G", "down", "overload", "code_blue")
    assert sample(wired, *asserted) == LiftSample(
        level="G",
        door=DoorReading.OPEN,
        motion=Motion.DOWN,
        agv=True,
        hazards=frozenset({Hazard.OVERLOAD, Hazard.CODE_BLUE}),
    )


def test_each_hazard_line_is_its_hazard() -> None:
    wired = settings(inputs=inputs(**{h.value: line(60 + i) for i, h in enumerate(Hazard)}))
    assert {h: sample(wired, h.value).hazards for h in Hazard} == {
        h: frozenset({h}) for h in Hazard
    }


@pytest.mark.parametrize("prefix", ["door", "rear_door"])
def test_two_contacts_tell_four_door_positions(prefix: str) -> None:
    rear = {"rear_door_opened": line(50), "rear_door_closed": line(51)}
    wired = settings(floors={"G": {}, "G_r": {"level": "G", "side": "rear"}}, inputs=inputs(**rear))
    ends = [f"{prefix}_opened", f"{prefix}_closed"]
    seen = {}
    for states in product((False, True), repeat=2):
        asserted = [end for end, state in zip(ends, states, strict=True) if state]
        one = sample(wired, *asserted)
        seen[states] = one.door if prefix == "door" else one.rear_door
    assert seen == {
        (False, False): DoorReading.BETWEEN,
        (False, True): DoorReading.CLOSED,
        (True, False): DoorReading.OPEN,
        (True, True): DoorReading.BOTH,
    }


def test_one_contact_tells_one_end() -> None:
    def ends(proves: str) -> tuple[DoorReading, DoorReading]:
        one = inputs(door_opened=None, door_closed=None, door=line(9, proves=proves))
        wired = settings(inputs=one)
        return sample(wired).door, sample(wired, "door").door

    assert ends("open") == (DoorReading.NOT_OPEN, DoorReading.OPEN)
    assert ends("closed") == (DoorReading.NOT_CLOSED, DoorReading.CLOSED)


def test_a_lift_without_a_rear_door_says_nothing_of_one() -> None:
    assert sample(settings()).rear_door is None


MOTION: list[tuple[dict[str, Any], dict[tuple[str, ...], Motion]]] = [
    ({"moving": line(50)}, {(): Motion.STOPPED, ("moving",): Motion.MOVING}),
    ({"stopped": line(50)}, {(): Motion.MOVING, ("stopped",): Motion.STOPPED}),
    (
        {"up": line(50), "down": line(51)},
        {
            (): Motion.STOPPED,
            ("up",): Motion.UP,
            ("down",): Motion.DOWN,
            ("up", "down"): Motion.CONTRADICTORY,
        },
    ),
    (
        {"motion": {"bits": bits(2, 50), "codes": {1: "up", 2: "down", 3: "stopped"}}},
        {
            (): Motion.CONTRADICTORY,
            ("motion_bit0",): Motion.UP,
            ("motion_bit1",): Motion.DOWN,
            ("motion_bit0", "motion_bit1"): Motion.STOPPED,
        },
    ),
    ({}, {(): None}),  # type: ignore[dict-item]
]


@pytest.mark.parametrize(("lines", "table"), MOTION)
def test_motion_is_read_from_lines_or_from_a_code(
    lines: dict[str, Any], table: dict[tuple[str, ...], Motion]
) -> None:
    wired = settings(inputs=inputs(**lines))
    assert {asserted: sample(wired, *asserted).motion for asserted in table} == table


SERVICE = {
    "bits": bits(2, 50),
    "codes": {0: "out_of_service", 1: "normal", 2: "agv_mode", 3: "fire_alarm"},
}


def test_service_by_code_gives_agv_mode_and_hazards() -> None:
    wired = settings(inputs=inputs(agv_mode=None, fire_alarm=None, service=SERVICE))
    states = {}
    for number in range(4):
        lines = [f"service_bit{i}" for i in range(2) if number >> i & 1]
        one = sample(wired, *lines)
        states[number] = (one.agv, one.hazards)
    assert states == {
        0: (False, frozenset({Hazard.OUT_OF_SERVICE})),
        1: (False, frozenset()),
        2: (True, frozenset()),
        3: (False, frozenset({Hazard.FIRE})),
    }


def test_a_service_code_without_agv_mode_does_not_show_it() -> None:
    two = {"bits": bits(1, 50), "codes": {0: "normal", 1: "manual_mode"}}
    wired = settings(inputs=inputs(agv_mode=None, service=two))
    assert sample(wired, "service_bit0") == LiftSample(
        level=None, door=DoorReading.BETWEEN, agv=None, hazards=frozenset({Hazard.MANUAL})
    )


def test_lines_that_count_only_in_agv_mode_are_not_known_outside_it() -> None:
    only = {"valid_when": "agv_mode"}
    hot = whole()["floor_code"]["lines"]
    wired = settings(
        inputs=inputs(
            door_opened=line(2, **only),
            door_closed=line(3, **only),
            moving=line(50, **only),
            overload=line(51, **only),
            code_blue=line(52),
        ),
        floor_code={"encoding": "one_hot", "lines": {f: {**v, **only} for f, v in hot.items()}},
    )
    asserted = ("door_opened", "moving", "overload", "code_blue", "floor_G", "floor_1")
    assert sample(wired, *asserted) == LiftSample(
        level=None,
        door=DoorReading.BETWEEN,
        code_fault="",
        motion=None,
        agv=False,
        hazards=frozenset({Hazard.CODE_BLUE}),
        floor_valid=False,
    )
    assert sample(wired, "agv_mode", *asserted) == LiftSample(
        level=None,
        door=DoorReading.OPEN,
        code_fault="the lines of G and 1 are on at once",
        motion=Motion.MOVING,
        agv=True,
        hazards=frozenset({Hazard.CODE_BLUE, Hazard.OVERLOAD}),
    )


def test_a_call_is_its_line_and_no_other() -> None:
    wired = settings()
    off = dict.fromkeys(encode(wired, LiftOutputs()), False)
    assert encode(wired, LiftOutputs()) == off
    assert encode(wired, LiftOutputs(call="G")) == {**off, "call_G": True}
    assert encode(wired, LiftOutputs(agv_request=True)) == {**off, "agv_mode_request": True}
    assert encode(wired, LiftOutputs(hold_door=Side.FRONT)) == {**off, "door_open": True}
    assert encode(wired, LiftOutputs(hold_door=Side.REAR)) == {**off, "rear_door_open": True}


def test_calls_may_be_given_as_a_code() -> None:
    wired = settings(
        calls={}, call_code={"bits": [coil(20), coil(21)], "codes": {1: "B1", 2: "G", 3: "1"}}
    )
    lines = {}
    for level in ("B1", "G", "1", None):
        outputs = encode(wired, LiftOutputs(call=level))
        lines[level] = (outputs["call_bit1"], outputs["call_bit0"])
    assert lines == {
        "B1": (False, True),
        "G": (True, False),
        "1": (True, True),
        None: (False, False),
    }


def test_each_signal_has_its_debounce_and_a_group_its_longest() -> None:
    wired = settings(
        inputs=inputs(
            fire_alarm={**line(0), "debounce_s": 0.2},
            code_blue=line(52),
            door_closed=line(3, debounce_s=0.3),
            up=line(50),
            down=line(51, debounce_s=0.0),
        )
    )
    assert debounce(wired) == {
        "fire_alarm": 0.2,
        "code_blue": 0.05,
        "agv_mode": 0.05,
        "door": 0.3,
        "motion": 0.05,
        "floor": 0.08,
    }


def test_states_of_the_service_code_are_debounced_as_its_lines_are() -> None:
    slow = {**SERVICE, "bits": [line(50), line(51, debounce_s=0.4)]}
    wired = settings(inputs=inputs(agv_mode=None, service=slow))
    assert debounce(wired) == {
        "fire_alarm": 0.4,
        "out_of_service": 0.4,
        "agv_mode": 0.4,
        "door": 0.1,
        "floor": 0.08,
    }


def test_the_table_says_where_the_yaml_has_each_line() -> None:
    wired = settings(
        inputs=inputs(service=SERVICE, agv_mode=None),
        floor_code={
            "encoding": "binary",
            "bits": bits(2),
            "codes": {1: "B1", 2: "G", 3: "1"},
            "parity": line(30, total="even"),
        },
    )
    assert {w.signal: ".".join(w.path) for w in wires(wired)} == {
        "fire_alarm": "inputs.fire_alarm",
        "service_bit0": "inputs.service.bits.0",
        "service_bit1": "inputs.service.bits.1",
        "door_opened": "inputs.door_opened",
        "door_closed": "inputs.door_closed",
        "floor_bit0": "floor_code.bits.0",
        "floor_bit1": "floor_code.bits.1",
        "floor_parity": "floor_code.parity",
        "agv_mode_request": "outputs.agv_mode_request",
        "door_open": "outputs.door_open",
        "call_B1": "calls.B1",
        "call_G": "calls.G",
        "call_1": "calls.1",
    }
