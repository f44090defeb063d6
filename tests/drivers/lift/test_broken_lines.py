"""Codes on several lines, of which one line is cut or shorted.

The driver must not accept a code that then reads as a less safe state than the true state.
"""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridges.kinds.lift.signals import Hazard
from drivers.lift.broken_lines import floor_warnings
from drivers.lift.dry_contact import DryContactLiftSettings, debounce, wires
from tests.drivers.lift.test_checks import found, warned
from tests.drivers.lift.test_decode import sample
from tests.drivers.lift.wirings import alarm, bits, inputs, line
from tests.drivers.lift.wirings import settings as wired


def service(
    codes: dict[int, str], lines: list[dict[str, Any]] | None = None
) -> DryContactLiftSettings:
    """Return a lift whose AGV mode and hazards are read as one number (the service code)."""
    width = max(codes).bit_length()
    code = {"bits": lines or bits(width, 60), "codes": codes}
    return wired(inputs=inputs(agv_mode=None, fire_alarm=None, service=code))


def motion(codes: dict[int, str]) -> DryContactLiftSettings:
    return wired(inputs=inputs(motion={"bits": bits(2, 40), "codes": codes}))


def refused(signal: str, text: str) -> str:
    return f"unsafe: {text}; or accept_unsafe: {{{signal}: <why it is safe here>}}"


TWO_LINES = {0: "normal", 1: "agv_mode", 2: "out_of_service", 3: "fire_alarm"}


def test_a_fire_that_a_cut_wire_turns_into_agv_mode_is_refused_with_its_siblings() -> None:
    assert found(service(TWO_LINES)) == [
        (
            "inputs.service.bits.0",
            refused("service_bit0", "with service_bit0 shorted, normal reads as agv_mode"),
        ),
        (
            "inputs.service.bits.1",
            refused(
                "service_bit1",
                "with service_bit1 cut, fire_alarm reads as agv_mode and out_of_service reads as"
                " normal",
            ),
        ),
    ]


def test_which_break_it_is_follows_from_what_a_cut_wire_reads_as() -> None:
    turned = [{**line(60), "active": "low"}, {**line(61), "pull": "none"}]
    texts = [text for _, text in found(service(TWO_LINES, turned))]
    assert texts == [
        refused("service_bit0", "with service_bit0 cut, normal reads as agv_mode"),
        refused(
            "service_bit1",
            "with service_bit1 cut, fire_alarm reads as agv_mode and out_of_service reads as normal",
        ),
    ]


APART = dict.fromkeys(range(8), "fault") | {0: "normal", 3: "agv_mode", 5: "fire_alarm"}


def test_codes_that_are_two_lines_apart_are_safe_and_what_is_between_them_is_a_fault() -> None:
    assert found(service(APART)) == []
    lift = service(APART)
    cut = sample(lift, "service_bit2")
    assert (cut.hazards, cut.agv) == (frozenset({Hazard.OUT_OF_SERVICE}), False)
    assert debounce(lift)[Hazard.OUT_OF_SERVICE] == debounce(lift)[Hazard.FIRE]


def test_an_overload_is_less_safe_as_agv_mode_and_no_worse_as_normal() -> None:
    assert found(service({0: "normal", 1: "overload", 2: "fault", 3: "agv_mode"})) == [
        (
            "inputs.service.bits.1",
            refused("service_bit1", "with service_bit1 shorted, overload reads as agv_mode"),
        )
    ]


@pytest.mark.parametrize(
    ("codes", "texts"),
    [
        (
            {0: "stopped", 1: "up", 2: "down"},
            {
                "motion_bit0": "with motion_bit0 cut, up reads as stopped",
                "motion_bit1": "with motion_bit1 cut, down reads as stopped",
            },
        ),
        (
            {3: "stopped", 1: "up", 2: "down"},
            {
                "motion_bit0": "with motion_bit0 shorted, down reads as stopped",
                "motion_bit1": "with motion_bit1 shorted, up reads as stopped",
            },
        ),
        ({3: "stopped", 0: "moving"}, {}),
    ],
)
def test_a_moving_car_that_a_broken_line_makes_stand_is_refused(
    codes: dict[int, str], texts: dict[str, str]
) -> None:
    assert [text for _, text in found(motion(codes))] == [
        refused(signal, text) for signal, text in texts.items()
    ]


def test_what_the_site_accepts_is_not_refused() -> None:
    accepted = dict.fromkeys(("service_bit0", "service_bit1"), "the controller watches its lines")
    code = {"bits": bits(2, 60), "codes": TWO_LINES}
    lift = wired(
        inputs=inputs(agv_mode=None, fire_alarm=None, service=code), accept_unsafe=accepted
    )
    assert (found(lift), warned(lift)) == ([], [])


SAFEST = ("agv_mode", "normal", "fire_alarm")
"""Three states of a service code. In the first a robot may use the lift, and in the last nobody may."""


@given(
    st.lists(st.sampled_from([*SAFEST, "fault"]), min_size=8, max_size=8),
    st.lists(st.sampled_from([line, alarm]), min_size=3, max_size=3),
)
def test_exactly_the_lines_that_can_make_it_less_safe_are_refused(
    states: list[str], polarity: list[Any]
) -> None:
    lift = service(dict(enumerate(states)), [wire(60 + i) for i, wire in enumerate(polarity)])
    worse = {
        bit
        for number, state in enumerate(states)
        for bit in range(3)
        if "fault" not in (state, states[number ^ 1 << bit])
        and SAFEST.index(states[number ^ 1 << bit]) < SAFEST.index(state)
    }
    paths = [path for path, _ in found(lift)]
    assert paths == [f"inputs.service.bits.{bit}" for bit in sorted(worse)]


def test_each_code_of_a_landing_is_judged_for_broken_lines() -> None:
    code = {"encoding": "binary", "bits": bits(3, 60), "codes": {1: "L1", 6: "L1", 4: "L2"}}
    lift = wired(floors=["L1", "L2"], floor_code=code)
    assert floor_warnings(lift.floor_code, {w.signal: w for w in wires(lift)}) == (
        "with floor_bit1 cut, L1 reads as L2; with floor_bit1 shorted, L2 reads as L1"
    )
