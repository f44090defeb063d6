"""The plant of a charger with a pad: physics in virtual time, each part failing as it is told."""

import pytest

from bridges.charger.signals import Activity
from hal_fakes.plants.pad import PadPlant, PadReading
from hal_fakes.plants.plant import FailureMode, Plant


def parked(*failures: tuple[str, FailureMode], enabled: bool = True) -> PadPlant:
    """A robot comes onto the pad at 1 s, and may be charged from 2 s on."""
    plant = PadPlant("a")
    for part, mode in failures:
        plant.fail(part, mode)
    plant.press("robot", True, 1.0)
    plant.drive("enable", enabled, 2.0)
    return plant


def at(plant: PadPlant, now: float) -> PadReading:
    plant.advance(now)
    return plant.reading()


def states(plant: PadPlant, until: float) -> list[tuple[float, object]]:
    plant.advance(until)
    return [(round(e.at, 2), e.value) for e in plant.edges if e.signal == "state"]


def test_a_plant_has_every_part_of_its_protocol() -> None:
    plant: Plant = PadPlant("a")
    assert plant.name == "a"


def test_a_robot_shakes_hands_charges_until_it_is_full_and_is_released() -> None:
    assert states(parked(), 100.0) == [
        (2.0, "handshake"),
        (3.0, "charging"),
        (39.0, "stopping"),
        (39.5, "released"),
        (40.5, "idle"),
    ]


def test_a_robot_that_may_not_charge_is_not_charged() -> None:
    assert states(parked(enabled=False), 100.0) == []


def test_the_pad_rises_to_a_robot_and_sinks_when_it_leaves() -> None:
    plant = PadPlant("a")
    gaps = [at(plant, 0.5).gap_mm]
    plant.press("robot", True, 1.0)
    gaps += [at(plant, now).gap_mm for now in (1.2, 1.5)]
    plant.press("robot", False, 2.0)
    assert [*gaps, at(plant, 2.0).gap_mm] == [60.0, 60.0, 20.0, 60.0]


def test_taking_power_away_ramps_down_and_releases() -> None:
    plant = parked()
    plant.advance(10.0)
    plant.drive("enable", False, 10.0)
    assert states(plant, 20.0)[2:] == [(10.0, "stopping"), (10.5, "released"), (11.5, "idle")]


def test_the_battery_fills_while_current_flows_and_stays_as_it_is() -> None:
    plant = parked()
    filled = [round(at(plant, now).battery, 2) for now in (2.5, 3.0, 21.0)]
    plant.drive("enable", False, 21.0)
    assert [*filled, round(at(plant, 30.0).battery, 2)] == [0.4, 0.4, 0.7, 0.7]


def test_the_coil_warms_while_current_flows_and_cools_again() -> None:
    plant = parked()
    warm = [round(at(plant, now).coil_c) for now in (3.0, 13.0, 33.0)]
    plant.drive("enable", False, 33.0)
    assert [*warm, round(at(plant, 200.0).coil_c)] == [25, 39, 52, 25]


@pytest.mark.parametrize(
    ("failure", "shown"),
    [
        (("pad", "off"), "too_far"),
        (("pad", "stuck"), "too_far"),
        (("pad", "slow"), "too_far"),
        (("pad", "garbage"), "too_far"),
        (("pad", "wrong"), "too_near"),
        (("receiver", "wrong"), "authentication"),
        (("receiver", "garbage"), "contact_lost"),
        (("fan", "off"), "over_temperature"),
    ],
)
def test_a_part_that_fails_ends_in_its_error(failure: tuple[str, FailureMode], shown: str) -> None:
    plant = parked(failure)
    reading = at(plant, 60.0)
    assert (reading.activity, reading.faults) == (Activity.ERROR, frozenset({shown}))


def test_a_pad_that_is_too_hot_says_when_it_will_have_cooled_and_is_well_then() -> None:
    plant = parked(("fan", "off"))
    at(plant, 3.0)
    hot_at = plant.next_at()
    shown = [at(plant, hot_at).activity]
    plant.drive("enable", False, hot_at)
    shown += [plant.reading().activity, at(plant, plant.next_at()).activity]
    assert shown == [Activity.ERROR, Activity.ERROR, Activity.IDLE]
    assert plant.next_at() == float("inf")


@pytest.mark.parametrize("mode", ["off", "stuck", "slow", "garbage", "wrong"])
def test_a_thermometer_that_fails_lets_nobody_charge(mode: FailureMode) -> None:
    assert states(parked(("thermometer", mode)), 60.0) == []


@pytest.mark.parametrize(
    ("mode", "at_60"),
    [
        ("off", (Activity.CHARGING, 0.4, 0.0)),
        ("stuck", (Activity.CHARGING, 0.4, 30.0)),
        ("garbage", (Activity.CHARGING, 0.4, 0.0)),
        ("wrong", (Activity.IDLE, 1.0, 0.0)),
    ],
)
def test_a_battery_that_fails_shows_in_the_reading(
    mode: FailureMode, at_60: tuple[Activity, float, float]
) -> None:
    reading = at(parked(("battery", mode)), 60.0)
    assert (reading.activity, reading.battery, reading.amps) == at_60


def test_a_slow_battery_takes_ten_times_as_long() -> None:
    assert states(parked(("battery", "slow")), 1000.0)[2] == (363.0, "stopping")


@pytest.mark.parametrize(
    ("mode", "found"),
    [("off", []), ("stuck", [(2.0, "handshake")]), ("slow", [(2.0, "handshake")])],
)
def test_a_receiver_that_does_not_answer_is_not_recognised(
    mode: FailureMode, found: list[object]
) -> None:
    assert states(parked(("receiver", mode)), 11.5) == found


@pytest.mark.parametrize("cause", ["foreign_object", "transmitter_fault"])
def test_a_fault_of_the_station_ends_a_charge_and_is_over_when_it_is_gone_and_power_is_off(
    cause: str,
) -> None:
    plant = parked()
    plant.press(cause, True, 10.0)
    assert at(plant, 11.0).faults == {cause}
    plant.drive("enable", False, 12.0)
    assert at(plant, 13.0).activity is Activity.ERROR
    plant.press(cause, False, 14.0)
    assert at(plant, 14.0).activity is Activity.IDLE


def test_an_error_whose_cause_has_gone_is_cleared_by_command() -> None:
    plant = parked()
    plant.press("foreign_object", True, 10.0)
    plant.drive("clear_error", True, 11.0)
    assert at(plant, 11.0).activity is Activity.ERROR
    plant.press("foreign_object", False, 12.0)
    plant.drive("clear_error", True, 13.0)
    assert at(plant, 13.0).activity is Activity.HANDSHAKE  # it is enabled still


def ranges(plant: PadPlant) -> list[str]:
    plant.drive("check_range", True, 5.0)
    return [at(plant, now).range_result for now in (5.1, 6.0)]


def test_a_range_check_is_under_way_and_then_says_what_is_so() -> None:
    assert ranges(parked(enabled=False)) == ["ongoing", "in"]
    assert ranges(parked(("receiver", "off"), enabled=False)) == ["ongoing", "failed"]
    badly = parked(enabled=False)
    badly.press("misparked", True, 3.0)
    assert ranges(badly) == ["ongoing", "out"]
    assert ranges(PadPlant("a")) == ["ongoing", "out"]


def test_a_robot_that_leaves_while_it_charges_is_released() -> None:
    plant = parked()
    plant.press("robot", False, 10.0)
    assert states(plant, 20.0)[2:] == [(10.0, "released"), (11.0, "idle")]
    assert at(plant, 20.0).battery == 0.0


def test_an_unknown_press_is_named() -> None:
    with pytest.raises(ValueError, match="there are foreign_object, misparked, robot, stranger"):
        PadPlant("a").press("door", True, 0.0)
