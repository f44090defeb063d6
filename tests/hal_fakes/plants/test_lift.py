"""The simulated lift (the plant) in virtual time. Tests compare all edges at the lift's terminals."""

from collections.abc import Callable
from typing import Any

import pytest

from hal_fakes.plants.lift import LiftPlant, build
from hal_fakes.plants.plant import Edge, FailureMode
from tests.drivers.lift.wirings import coil, inputs, line
from tests.hal_fakes.virtual_lift import history, lift, shipped

REAR = {
    "floors": {"B1": {}, "G": {}, "1": {}, "G_r": {"level": "G", "side": "rear"}},
    "outputs": {"agv_mode_request": coil(0), "door_open": coil(1), "rear_door_open": coil(2)},
    "inputs": inputs(rear_door_opened=line(50), rear_door_closed=line(51)),
}


def in_agv_mode(**changes: Any) -> LiftPlant:
    plant = lift(**changes)
    plant.drive("agv_mode_request", True, 0.0)
    plant.advance(0.5)
    plant.edges.clear()
    return plant


def test_a_lift_starts_at_the_lowest_landing_with_its_door_closed() -> None:
    plant = lift()
    now = {s: plant.sense(s) for s in ("floor_B1", "floor_G", "door_opened", "door_closed")}
    assert (now, plant.edges, plant.next_at()) == (
        {"floor_B1": True, "floor_G": False, "door_opened": False, "door_closed": True},
        [],
        float("inf"),
    )


def test_a_robots_calls_bring_the_car_and_hold_its_door() -> None:
    plant = lift()
    plant.drive("agv_mode_request", True, 1.0)
    plant.drive("call_1", True, 2.0)
    plant.drive("call_1", False, 7.0)
    plant.drive("door_open", True, 7.5)
    plant.drive("door_open", False, 20.0)
    plant.drive("agv_mode_request", False, 20.5)
    plant.advance(60.0)
    assert history(plant) == [
        (1.0, "agv_mode_request", True),
        (1.5, "agv_mode", True),
        (2.0, "call_1", True),
        (2.55, "floor_B1", False),
        (3.55, "floor_G", True),
        (4.55, "floor_G", False),
        (5.55, "floor_1", True),
        (6.05, "door_closed", False),
        (7.0, "call_1", False),
        (7.05, "door_opened", True),
        (7.5, "door_open", True),
        (20.0, "door_open", False),
        (20.0, "door_opened", False),
        (20.5, "agv_mode_request", False),
        (20.5, "agv_mode", False),
        (21.0, "door_closed", True),
    ]


def test_without_a_hold_the_door_closes_after_its_dwell_time() -> None:
    plant = in_agv_mode()
    plant.drive("call_B1", True, 1.0)
    plant.advance(60.0)
    assert history(plant) == [
        (1.0, "call_B1", True),
        (1.05, "door_closed", False),
        (2.05, "door_opened", True),
        (4.05, "door_opened", False),
        (5.05, "door_closed", True),
    ]


def test_a_pulse_calls_the_car_and_a_glitch_does_not() -> None:
    plant = in_agv_mode()
    plant.drive("call_G", True, 1.0)
    plant.drive("call_G", False, 1.02)
    plant.drive("call_1", True, 2.0)
    plant.drive("call_1", False, 2.3)
    plant.advance(7.0)
    assert (plant.car.floor, history(plant)[-1]) == (2, (6.05, "door_closed", False))


def test_a_held_door_keeps_the_car() -> None:
    plant = in_agv_mode()
    plant.drive("door_open", True, 1.0)
    plant.drive("call_G", True, 2.0)
    plant.advance(30.0)
    standing = plant.car.standing
    plant.drive("door_open", False, 30.0)
    plant.advance(31.0)
    assert (standing, plant.car.leg) == (True, "leaving")


def test_calls_and_door_relays_do_nothing_outside_agv_mode() -> None:
    plant = lift()
    plant.drive("call_G", True, 1.0)
    plant.drive("door_open", True, 1.0)
    plant.advance(60.0)
    assert history(plant) == [(1.0, "call_G", True), (1.0, "door_open", True)]


def test_calls_of_people_come_first_but_are_ignored_in_agv_mode() -> None:
    plant = lift()
    plant.press("hall_G", True, 0.0)
    plant.drive("agv_mode_request", True, 0.1)
    plant.advance(60.0)
    plant.press("hall_1", True, 60.0)
    plant.advance(90.0)
    assert history(plant) == [
        (0.1, "agv_mode_request", True),
        (0.5, "floor_B1", False),
        (1.5, "floor_G", True),
        (2.0, "door_closed", False),
        (2.5, "agv_mode", True),
        (3.0, "door_opened", True),
        (5.0, "door_opened", False),
        (6.0, "door_closed", True),
    ]


def test_a_fire_takes_the_car_to_the_lowest_landing_and_opens_its_door() -> None:
    plant = in_agv_mode()
    plant.drive("call_1", True, 1.0)
    plant.press("fire_alarm", True, 2.0)
    plant.advance(60.0)
    plant.press("fire_alarm", False, 60.0)
    plant.advance(90.0)
    assert history(plant) == [
        (1.0, "call_1", True),
        (1.55, "floor_B1", False),
        (2.0, "fire_alarm", True),
        (2.0, "agv_mode", False),
        (2.55, "floor_G", True),
        (3.55, "floor_G", False),
        (4.55, "floor_B1", True),
        (5.05, "door_closed", False),
        (6.05, "door_opened", True),
        (60.0, "fire_alarm", False),
        (60.0, "door_opened", False),
        (60.5, "agv_mode", True),
        (61.0, "door_closed", True),
        (61.5, "floor_B1", False),
        (62.5, "floor_G", True),
        (63.5, "floor_G", False),
        (64.5, "floor_1", True),
        (65.0, "door_closed", False),
        (66.0, "door_opened", True),
        (68.0, "door_opened", False),
        (69.0, "door_closed", True),
    ]


def test_a_car_at_the_recall_landing_stays_even_if_its_door_does_not_open() -> None:
    plant = in_agv_mode()
    plant.fail("door_operator", "stuck")
    plant.press("fire_alarm", True, 1.0)
    plant.advance(30.0)
    assert history(plant) == [(1.0, "fire_alarm", True), (1.0, "agv_mode", False)]


STAYS_OPEN: list[tuple[float, str, bool]] = []
CLOSES = [(6.05, "door_opened", False), (7.05, "door_closed", True)]


@pytest.mark.parametrize(
    ("hazard", "then"),
    [
        ("emergency", STAYS_OPEN),
        ("earthquake", STAYS_OPEN),
        ("code_blue", CLOSES),
        ("out_of_service", CLOSES),
        ("manual_mode", CLOSES),
    ],
)
def test_a_hazard_stops_the_car_at_the_next_landing_and_lets_people_out(
    hazard: str, then: list[tuple[float, str, bool]]
) -> None:
    plant = in_agv_mode(inputs=inputs(**{hazard: line(40)}))
    plant.drive("call_1", True, 1.0)
    plant.press(hazard, True, 2.0)
    plant.advance(60.0)
    assert history(plant, hazard) == [
        (1.0, "call_1", True),
        (1.55, "floor_B1", False),
        (2.0, "agv_mode", False),
        (2.55, "floor_G", True),
        (3.05, "door_closed", False),
        (4.05, "door_opened", True),
        *then,
    ]


def test_an_overloaded_car_stays_open_until_it_is_lighter() -> None:
    plant = in_agv_mode(inputs=inputs(overload=line(40)))
    plant.drive("call_B1", True, 1.0)
    plant.press("overload", True, 2.5)
    plant.drive("call_B1", False, 3.0)
    plant.drive("call_G", True, 3.5)
    plant.advance(30.0)
    plant.press("overload", False, 30.0)
    plant.advance(32.0)
    assert history(plant, "call_B1", "call_G") == [
        (1.05, "door_closed", False),
        (2.05, "door_opened", True),
        (2.5, "overload", True),
        (30.0, "overload", False),
        (30.0, "door_opened", False),
        (31.0, "door_closed", True),
        (31.5, "floor_B1", False),
    ]


def test_an_obstructed_door_opens_again() -> None:
    plant = in_agv_mode()
    plant.drive("call_B1", True, 1.0)
    plant.press("obstruction", True, 4.45)
    plant.press("obstruction", False, 6.0)
    plant.advance(20.0)
    assert history(plant, "call_B1") == [
        (1.05, "door_closed", False),
        (2.05, "door_opened", True),
        (4.05, "door_opened", False),
        (4.85, "door_opened", True),
        (6.0, "door_opened", False),
        (7.0, "door_closed", True),
    ]


def test_at_a_landing_with_two_doors_the_relay_chooses_the_door() -> None:
    plant = in_agv_mode(**REAR)
    plant.drive("call_G", True, 1.0)
    plant.drive("call_G", False, 4.0)
    plant.drive("rear_door_open", True, 5.0)
    plant.advance(10.0)
    assert history(plant) == [
        (1.0, "call_G", True),
        (1.55, "floor_B1", False),
        (2.55, "floor_G", True),
        (4.0, "call_G", False),
        (5.0, "rear_door_open", True),
        (5.0, "rear_door_closed", False),
        (6.0, "rear_door_opened", True),
    ]


def test_a_lift_may_be_called_by_a_code() -> None:
    code = {"bits": [coil(20), coil(21)], "codes": {1: "B1", 2: "G", 3: "1"}}
    plant = in_agv_mode(calls={}, call_code=code)
    plant.drive("call_bit1", True, 1.0)
    plant.drive("call_bit0", True, 1.001)
    plant.advance(20.0)
    assert plant.car.floor == 2


def test_lines_that_are_valid_only_in_agv_mode_are_off_in_other_modes() -> None:
    only = {"valid_when": "agv_mode"}
    wired = inputs(
        door_opened=line(2, **only), door_closed=line(3, **only), stopped=line(40, **only)
    )
    plant = lift(inputs=wired)
    plant.drive("agv_mode_request", True, 1.0)
    plant.drive("agv_mode_request", False, 2.0)
    plant.advance(3.0)
    assert history(plant) == [
        (1.0, "agv_mode_request", True),
        (1.5, "agv_mode", True),
        (1.5, "door_closed", True),
        (1.5, "stopped", True),
        (2.0, "agv_mode_request", False),
        (2.0, "agv_mode", False),
        (2.0, "door_closed", False),
        (2.0, "stopped", False),
    ]


MOTION = {"bits": [line(40), line(41)], "codes": {0: "stopped", 1: "up", 2: "down"}}
SERVICE = {
    "bits": [line(45), line(46)],
    "codes": {0: "normal", 1: "agv_mode", 2: "fire_alarm", 3: "out_of_service"},
}


def test_motion_and_service_are_shown_by_lines_or_codes() -> None:
    coded = inputs(agv_mode=None, fire_alarm=None, motion=MOTION, service=SERVICE)
    shown = []
    for wired in (coded, inputs(up=line(40), down=line(41)), inputs(moving=line(40))):
        plant = in_agv_mode(inputs=wired)
        plant.drive("call_G", True, 1.0)
        plant.advance(5.0)
        plant.press("fire_alarm", True, 5.0)
        plant.advance(7.0)
        watched = (
            "motion_bit0",
            "motion_bit1",
            "service_bit0",
            "service_bit1",
            "up",
            "down",
            "moving",
        )
        shown.append([e for e in history(plant) if e[1] in watched])
    assert shown == [
        [
            (1.05, "motion_bit0", True),
            (3.05, "motion_bit0", False),
            (5.0, "service_bit0", False),
            (5.0, "service_bit1", True),
            (6.0, "motion_bit1", True),
        ],
        [(1.05, "up", True), (3.05, "up", False), (6.0, "down", True)],
        [(1.05, "moving", True), (3.05, "moving", False), (6.0, "moving", True)],
    ]


def test_a_controller_without_a_code_for_between_floors_shows_the_last_floor() -> None:
    bits = [line(20), line(21)]
    code = {
        "encoding": "binary",
        "bits": bits,
        "codes": {0: "B1", 1: "G", 2: "1"},
        "between_floors": [],
    }
    plant = in_agv_mode(floor_code=code)
    plant.drive("call_1", True, 1.0)
    plant.advance(20.0)
    assert [e for e in history(plant) if e[1].startswith("floor")] == [
        (2.55, "floor_bit0", True),
        (4.55, "floor_bit0", False),
        (4.55, "floor_bit1", True),
    ]


def called(
    plant: LiftPlant, level: str, at: float, until: float
) -> list[tuple[float, str, object]]:
    plant.drive(f"call_{level}", True, at)
    plant.advance(until)
    return history(plant, f"call_{level}")


PARTS: list[tuple[str, FailureMode, list[tuple[float, str, object]]]] = [
    ("car", "off", []),
    ("car", "stuck", []),
    ("car", "slow", [(3.55, "floor_B1", False), (8.55, "floor_G", True)]),
    (
        "car",
        "wrong",
        [
            (1.55, "floor_B1", False),
            (2.55, "floor_G", True),
            (3.55, "floor_G", False),
            (4.55, "floor_1", True),
            (5.05, "door_closed", False),
            (6.05, "door_opened", True),
            (8.05, "door_opened", False),
            (9.05, "door_closed", True),
        ],
    ),
    ("door_operator", "off", [(1.55, "floor_B1", False), (2.55, "floor_G", True)]),
    ("door_operator", "stuck", [(1.55, "floor_B1", False), (2.55, "floor_G", True)]),
    (
        "door_operator",
        "slow",
        [
            (1.55, "floor_B1", False),
            (2.55, "floor_G", True),
            (3.05, "door_closed", False),
            (9.05, "door_closed", True),
        ],
    ),
    ("controller", "off", [(0.6, "agv_mode", False)]),
    (
        "controller",
        "slow",
        [
            (1.55, "floor_B1", False),
            (2.55, "floor_G", True),
            (3.05, "door_closed", False),
            (4.05, "door_opened", True),
            (6.05, "door_opened", False),
            (7.05, "door_closed", True),
        ],
    ),
]


@pytest.mark.parametrize(("part", "mode", "events"), PARTS)
def test_each_part_fails_in_its_own_way(
    part: str, mode: FailureMode, events: list[tuple[float, str, object]]
) -> None:
    plant = in_agv_mode()
    plant.advance(0.6)
    plant.fail(part, mode)
    assert called(plant, "G", 1.0, 10.0) == events


def test_a_door_operator_that_is_wired_wrongly_closes_when_it_should_open() -> None:
    plant = in_agv_mode()
    plant.fail("door_operator", "wrong")
    plant.drive("call_B1", True, 3.0)
    plant.advance(5.0)
    assert history(plant, "call_B1") == [
        (0.5, "door_closed", False),
        (1.5, "door_opened", True),
        (3.05, "door_opened", False),
        (4.05, "door_closed", True),
    ]


def test_a_stuck_controller_keeps_agv_mode() -> None:
    plant = in_agv_mode()
    plant.fail("controller", "stuck")
    plant.drive("agv_mode_request", False, 1.0)
    plant.advance(10.0)
    kept = plant.sense("agv_mode")
    plant.fail("controller", None)
    assert (kept, plant.sense("agv_mode")) == (True, False)


def test_a_car_that_is_stuck_half_way_goes_on_after_its_repair() -> None:
    plant = in_agv_mode()
    plant.drive("call_G", True, 1.0)
    plant.advance(2.0)
    plant.fail("car", "stuck")
    plant.advance(30.0)
    plant.fail("car", None)
    plant.advance(31.0)
    assert history(plant, "call_G") == [
        (1.55, "floor_B1", False),
        (30.0, "floor_G", True),
        (30.5, "door_closed", False),
    ]


def broken(do: Callable[[LiftPlant], None]) -> str:
    with pytest.raises(ValueError, match=r"^\w") as refused:
        do(lift())
    return str(refused.value)


def test_an_unknown_part_or_signal_is_refused_with_the_known_names() -> None:
    assert broken(lambda p: p.press("fire", True, 0.0)) == (
        "lift has no 'fire' to press; there are fire_alarm, hall_B1, hall_G, hall_1, obstruction"
    )
    assert broken(lambda p: p.fail("motor", "off")).startswith(
        "lift has no part 'motor'; there are agv_mode, agv_mode_request, call_1,"
    )
    assert broken(lambda p: p.fail("car", "garbage")) == (
        "car does not fail by 'garbage', but by off, stuck, slow, wrong"
    )
    assert broken(lambda p: p.fail("door_opened", "odd")) == (  # type: ignore[arg-type]
        "no failure 'odd'; there are off, stuck, slow, garbage, wrong"
    )


def test_every_edge_is_reported_as_it_happens() -> None:
    plant = lift()
    told: list[Edge] = []
    plant.on_edge = told.append
    plant.drive("agv_mode_request", True, 1.0)
    plant.advance(3.0)
    assert told == [
        Edge(1.0, "lift", "relay", "agv_mode_request", True),
        Edge(1.5, "lift", "sensor", "agv_mode", True),
    ]


def test_a_contact_that_sticks_before_the_first_movement_keeps_its_first_state() -> None:
    plant = build("Lift1", shipped())
    plant.fail("floor_bit0", "stuck")
    plant.advance(1.0)
    assert (plant.sense("floor_bit0"), plant.edges) == (True, [])


def test_time_never_goes_back() -> None:
    plant = lift()
    plant.drive("agv_mode_request", True, 5.0)
    plant.drive("agv_mode_request", False, 4.0)
    assert history(plant) == [(5.0, "agv_mode_request", True), (5.0, "agv_mode_request", False)]


def test_many_small_steps_give_the_same_edges_as_one_large_one() -> None:
    one, many = in_agv_mode(), in_agv_mode()
    for plant in (one, many):
        plant.drive("call_1", True, 1.0)
    one.advance(20.0)
    for i in range(1900):
        many.advance(1.0 + i * 0.01)
    assert history(many) == history(one)


def test_the_shipped_lift_can_be_built() -> None:
    plant = LiftPlant("Lift1", shipped())
    plant.advance(0.0)
    assert [plant.sense(f"floor_bit{i}") for i in range(3)] == [True, False, False]
