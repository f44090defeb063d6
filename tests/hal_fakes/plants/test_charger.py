"""The simulated charger in virtual time: how it charges, and how each of its parts fails."""

import pytest

from bridges.kinds.charger.signals import Activity
from hal_fakes.plants.charger import ChargerPlant, Reading
from hal_fakes.plants.plant import Edge, FailureMode, Plant

NEVER = float("inf")


def states(plant: ChargerPlant, until: float) -> list[tuple[float, object]]:
    plant.advance(until)
    return [(round(e.at, 2), e.value) for e in plant.edges if e.signal == "state"]


def at(plant: ChargerPlant, now: float) -> Reading:
    plant.advance(now)
    return plant.reading()


def parked(*failures: tuple[str, FailureMode]) -> ChargerPlant:
    """Return a station with these failures, after a robot has driven onto the station's pad at 1 s."""
    plant = ChargerPlant("a")
    for part, mode in failures:
        plant.fail(part, mode)
    plant.press("robot", True, 1.0)
    return plant


def commanded(asked: bool = False, cleared: bool = True) -> ChargerPlant:
    """Return a station that charges only on command, and knows two robots."""
    robots = {"7": "tiny/AMR01", "8": "tiny/AMR02"}
    return ChargerPlant("a", robots, commanded=True, asked=asked, cleared=cleared)


def powered(cleared: bool = True) -> ChargerPlant:
    """Return a station after a robot has driven onto its pad and its power was ordered on, both at 1
    s."""
    plant = commanded(cleared=cleared)
    plant.press("robot", True, 1.0)
    plant.drive("power", True, 1.0)
    return plant


def test_a_plant_has_every_part_of_its_protocol() -> None:
    plant: Plant = ChargerPlant("charger_a")
    assert (plant.name, plant.edges, plant.next_at()) == ("charger_a", [], NEVER)


def test_a_robot_is_charged_until_it_is_full_and_not_longer() -> None:
    plant = parked()
    assert states(plant, 1000.0) == [
        (1.0, "handshake"),
        (3.0, "charging"),
        (39.0, "stopping"),
        (40.0, "released"),
        (41.5, "idle"),
    ]
    assert (plant.battery, plant.pressed["robot"]) == (1.0, True)


def test_a_robot_that_leaves_is_disconnected_and_the_next_robot_starts_afresh() -> None:
    plant = parked()
    plant.press("robot", False, 10.0)
    assert plant.battery == 0.0
    plant.press("robot", True, 20.0)
    plant.press("robot", False, 21.0)
    assert states(plant, 30.0) == [
        (1.0, "handshake"),
        (3.0, "charging"),
        (10.0, "released"),
        (11.5, "idle"),
        (20.0, "handshake"),
        (21.0, "idle"),
    ]


def test_the_handshake_shows_its_progress() -> None:
    reading = at(parked(), 2.0)
    assert (reading.activity, reading.progress) == (Activity.HANDSHAKE, 0.5)


def test_the_pad_rises_to_a_robot_and_sinks_when_it_leaves() -> None:
    plant = ChargerPlant("a")
    gaps = [plant.pad.gap_mm()]
    plant.press("robot", True, 1.0)
    for now in (1.2, 1.5):
        plant.advance(now)
        gaps.append(plant.pad.gap_mm())
    plant.press("robot", False, 2.0)
    assert [*gaps, plant.pad.gap_mm()] == [60.0, 60.0, 20.0, 60.0]


@pytest.mark.parametrize(
    ("mode", "gaps"),
    [
        ("off", [20.0, 60.0, 20.0, 60.0]),
        ("stuck", [20.0, 20.0, 20.0, 20.0]),
        ("garbage", [20.0, 40.0, 20.0, 60.0]),
        ("wrong", [20.0, 8.0, 20.0, 60.0]),
    ],
)
def test_a_raised_pad_moves_when_it_fails_and_when_it_is_repaired(
    mode: FailureMode, gaps: list[float]
) -> None:
    plant = parked()
    seen = []
    for now, failure in ((2.0, None), (3.0, mode), (4.0, None)):
        plant.advance(now)
        plant.fail("pad", failure)
        plant.advance(now + 0.5)
        seen.append(plant.pad.gap_mm())
    plant.fail("pad", mode)
    plant.press("robot", False, 6.0)
    assert [*seen, plant.pad.gap_mm()] == gaps


@pytest.mark.parametrize(
    ("cause", "text"),
    [
        ("foreign_object", "foreign object detected"),
        ("over_temperature", "over temperature"),
        ("transmitter_fault", "transmitter fault"),
    ],
)
def test_an_error_stays_until_a_clearing_after_the_end_of_its_cause(cause: str, text: str) -> None:
    plant = parked()
    plant.press(cause, True, 5.0)
    assert (plant.reading().error_text, plant.pressed[cause]) == (text, True)
    plant.drive("clear_error", True, 6.0)
    plant.press(cause, False, 7.0)
    plant.advance(8.0)
    plant.drive("clear_error", True, 9.0)
    plant.advance(12.0)
    assert plant.reading().error_text == ""
    assert plant.edges == [
        Edge(1.0, "a", "sensor", "state", "handshake"),
        Edge(1.4, "a", "sensor", "gap_mm", 20.0),
        Edge(3.0, "a", "sensor", "state", "charging"),
        Edge(5.0, "a", "sensor", "state", "error"),
        Edge(6.0, "a", "relay", "clear_error", True),
        Edge(9.0, "a", "relay", "clear_error", True),
        Edge(9.0, "a", "sensor", "state", "idle"),
        Edge(9.0, "a", "sensor", "state", "handshake"),
        Edge(11.0, "a", "sensor", "state", "charging"),
    ]


@pytest.mark.parametrize("cause", ["foreign_object", "transmitter_fault"])
def test_an_error_without_a_clearing_ends_with_its_cause_and_the_power_off(
    cause: str,
) -> None:
    plant = powered(cleared=False)
    plant.press(cause, True, 10.0)
    assert at(plant, 11.0).faults == {cause}
    plant.drive("power", False, 12.0)
    assert at(plant, 13.0).activity is Activity.ERROR
    plant.press(cause, False, 14.0)
    assert at(plant, 14.0).activity is Activity.IDLE


def test_a_clearing_without_an_error_changes_nothing_and_a_cause_without_a_robot_neither() -> None:
    plant = ChargerPlant("a")
    plant.press("foreign_object", True, 1.0)
    plant.drive("clear_error", True, 2.0)
    assert states(plant, 100.0) == []


def test_a_robot_that_comes_to_a_faulty_station_is_not_charged() -> None:
    plant = ChargerPlant("a")
    plant.press("foreign_object", True, 1.0)
    plant.press("robot", True, 2.0)
    assert states(plant, 100.0) == [(2.0, "error")]


@pytest.mark.parametrize("mode", ["off", "stuck", "slow", "garbage", "wrong"])
def test_a_broken_thermometer_prevents_every_charge(mode: FailureMode) -> None:
    assert states(parked(("thermometer", mode)), 60.0) == [(1.0, "error")]


@pytest.mark.parametrize(
    ("mode", "history"),
    [
        ("off", []),
        ("stuck", [(1.0, "handshake")]),
        ("slow", [(1.0, "handshake"), (21.0, "charging")]),
        ("wrong", [(1.0, "handshake"), (3.0, "error")]),
        ("garbage", [(1.0, "handshake"), (3.0, "charging"), (4.0, "error")]),
    ],
)
def test_the_receiver_of_the_robot_fails_in_five_ways(
    mode: FailureMode, history: list[tuple[float, str]]
) -> None:
    assert states(parked(("receiver", mode)), 25.0) == history


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
    reading = at(parked(failure), 39.0)
    assert (reading.activity, reading.faults) == (Activity.ERROR, frozenset({shown}))


def test_a_hot_station_tells_its_cooling_time_and_then_recovers() -> None:
    plant = ChargerPlant("a", cleared=False)
    plant.fail("fan", "off")
    plant.press("robot", True, 1.0)
    at(plant, 4.0)
    hot_at = plant.next_at()
    shown = [at(plant, hot_at).activity]
    plant.press("robot", False, hot_at)
    shown += [plant.reading().activity, at(plant, plant.next_at()).activity]
    assert shown == [Activity.ERROR, Activity.ERROR, Activity.IDLE]
    assert plant.next_at() == float("inf")


def test_a_station_that_recovers_serves_the_robot_on_its_pad_without_another_event() -> None:
    plant = ChargerPlant("a", cleared=False)
    plant.press("robot", True, 1.0)
    plant.press("foreign_object", True, 6.0)
    plant.press("foreign_object", False, 7.0)
    assert [state for _, state in states(plant, 8.0)][-2:] == ["idle", "handshake"]


def test_a_fault_of_the_robot_ends_when_the_robot_leaves() -> None:
    plant = parked(("receiver", "wrong"))
    plant.press("robot", False, 10.0)
    assert states(plant, 20.0)[1:] == [(3.0, "error"), (10.0, "idle")]


def test_a_handshake_that_hangs_shows_no_progress_and_a_mended_receiver_is_recognised() -> None:
    assert at(parked(("receiver", "stuck")), 100.0).progress == 0.0
    silent = parked(("receiver", "off"))
    silent.advance(50.0)
    silent.fail("receiver", None)
    assert states(silent, 60.0) == [(50.0, "handshake"), (52.0, "charging")]


def test_a_commanded_station_charges_while_the_command_lasts() -> None:
    plant = commanded()
    plant.press("tiny/AMR02", True, 1.0)
    assert states(plant, 5.0) == []
    plant.drive("power", True, 5.0)
    plant.drive("power", True, 6.0)
    plant.drive("power", False, 10.0)
    assert states(plant, 20.0) == [
        (5.0, "handshake"),
        (7.0, "charging"),
        (10.0, "stopping"),
        (11.0, "released"),
        (12.5, "idle"),
    ]
    assert [(e.at, e.value) for e in plant.edges if e.signal == "power"] == [
        (5.0, True),
        (10.0, False),
    ]


def test_power_switched_off_during_the_handshake_ends_it() -> None:
    plant = commanded()
    plant.press("robot", True, 1.0)
    plant.drive("power", True, 2.0)
    plant.drive("power", False, 3.0)
    assert states(plant, 20.0) == [(2.0, "handshake"), (3.0, "idle")]


def test_the_station_sees_the_receiver_of_the_last_robot_unless_the_receiver_is_silent() -> None:
    plant = commanded()
    seen = []
    for robot, here in (
        ("robot", True),
        ("tiny/AMR02", True),
        ("stranger", True),
        ("stranger", False),
        ("tiny/AMR02", False),
        ("robot", False),
    ):
        plant.press(robot, here, 1.0)
        seen.append(plant.reading().receiver)
    assert seen == ["7", "8", "815", "8", "7", ""]
    plant.press("robot", True, 2.0)
    plant.fail("receiver", "off")
    assert plant.reading().receiver == ""


def test_a_battery_fills_and_the_station_tells_the_remaining_time() -> None:
    plant = parked()
    readings = []
    for now in (2.0, 3.0, 21.0, 39.5):
        reading = at(plant, now)
        left_s = reading.time_to_full_s
        whole = left_s if left_s is None else round(left_s)
        readings.append((reading.battery, round(reading.volts, 2), reading.amps, whole))
    assert readings == [
        (0.4, 26.08, 0.0, None),
        (0.4, 26.08, 30.0, 36),
        (0.7, 27.64, 30.0, 18),
        (1.0, 29.2, 30.0, 0),
    ]


def test_a_battery_keeps_its_level_when_the_power_goes() -> None:
    plant = powered()
    plant.advance(21.0)
    plant.drive("power", False, 21.0)
    assert at(plant, 30.0).battery == 0.7


@pytest.mark.parametrize(
    ("mode", "at_60"),
    [
        ("off", (Activity.CHARGING, 0.4, 0.0)),
        ("stuck", (Activity.CHARGING, 0.4, 30.0)),
        ("garbage", (Activity.CHARGING, 0.4, 0.0)),
        ("wrong", (Activity.IDLE, 1.0, 0.0)),
    ],
)
def test_a_broken_battery_shows_in_the_reading(
    mode: FailureMode, at_60: tuple[Activity, float, float]
) -> None:
    reading = at(parked(("battery", mode)), 60.0)
    assert (reading.activity, reading.battery, reading.amps) == at_60


def test_a_slow_battery_takes_ten_times_as_long() -> None:
    assert states(parked(("battery", "slow")), 1000.0)[2] == (363.0, "stopping")


def test_the_coil_warms_while_current_flows_and_cools_again() -> None:
    plant = powered()
    warm = [round(at(plant, now).celsius) for now in (3.0, 13.0, 33.0)]
    plant.drive("power", False, 33.0)
    assert [*warm, round(at(plant, 200.0).celsius)] == [25, 39, 52, 25]


def test_a_badly_parked_robot_is_reported_so_and_cannot_be_charged() -> None:
    plant = parked()
    assert at(plant, 1.5).in_range is True
    plant.press("misparked", True, 2.0)
    assert plant.reading().in_range is False
    assert at(plant, 4.0).error_text == "the gap is too wide"


def test_a_range_check_takes_a_moment() -> None:
    plant = commanded(asked=True)
    plant.press("robot", True, 1.0)
    seen = [plant.reading().in_range]
    plant.drive("range_check", True, 2.0)
    seen += [at(plant, now).in_range for now in (2.2, 2.4)]
    assert seen == [None, None, True]


def ranges(plant: ChargerPlant) -> list[str]:
    plant.drive("range_check", True, 5.0)
    return [at(plant, now).range_result for now in (5.1, 6.0)]


def test_a_range_check_shows_its_progress_and_then_its_result() -> None:
    assert ranges(parked()) == ["ongoing", "in"]
    assert ranges(parked(("receiver", "off"))) == ["ongoing", "failed"]
    badly = parked()
    badly.press("misparked", True, 2.0)
    assert ranges(badly) == ["ongoing", "out"]
    assert ranges(ChargerPlant("a")) == ["ongoing", "out"]


def test_an_unknown_part_or_signal_cannot_be_pressed_driven_or_broken() -> None:
    plant = ChargerPlant("a")
    with pytest.raises(
        ValueError,
        match=r"are foreign_object, misparked, over_temp.*, robot, stranger, transmitter_fault",
    ):
        plant.press("door", True, 1.0)
    with pytest.raises(ValueError, match="there are battery, fan, pad, receiver, thermometer"):
        plant.fail("car", "off")
    with pytest.raises(KeyError):
        plant.drive("light", True, 1.0)
