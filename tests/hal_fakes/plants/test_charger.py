"""The charging station's physics, in virtual time."""

import pytest

from bridges.charger.signals import Activity
from hal_fakes.plants.charger import ChargerPlant
from hal_fakes.plants.plant import Edge, FailureMode, Plant


def states(plant: ChargerPlant) -> list[tuple[float, bool | int | str | float]]:
    return [(e.at, e.value) for e in plant.edges if e.signal == "state"]


def parked(*failures: tuple[str, FailureMode]) -> ChargerPlant:
    """A station onto whose pad a robot comes at 1 s."""
    plant = ChargerPlant("a")
    for part, mode in failures:
        plant.fail(part, mode)
    plant.press("robot", True, 1.0)
    return plant


def test_a_plant_has_every_part_of_its_protocol() -> None:
    plant: Plant = ChargerPlant("charger_a")
    assert (plant.name, plant.edges, plant.next_at()) == ("charger_a", [], float("inf"))


def test_a_robot_is_charged_until_it_is_full_and_then_left_alone() -> None:
    plant = parked()
    plant.advance(1000.0)
    assert states(plant) == [
        (1.0, "handshake"),
        (3.0, "charging"),
        (39.0, "stopping"),
        (40.0, "released"),
        (41.5, "idle"),
    ]
    assert plant.battery == 1.0
    assert plant.sense("robot")


def test_a_robot_that_leaves_is_disconnected_and_the_next_one_starts_anew() -> None:
    plant = parked()
    plant.press("robot", False, 10.0)
    plant.press("robot", True, 20.0)
    plant.press("robot", False, 21.0)
    plant.advance(30.0)
    assert states(plant) == [
        (1.0, "handshake"),
        (3.0, "charging"),
        (10.0, "released"),
        (11.5, "idle"),
        (20.0, "handshake"),
        (21.0, "idle"),
    ]


def test_the_handshake_shows_how_far_it_is() -> None:
    plant = parked()
    plant.advance(2.0)
    reading = plant.reading()
    assert (reading.activity, reading.progress) == (Activity.HANDSHAKE, 0.5)


@pytest.mark.parametrize(
    ("cause", "text"),
    [("foreign_object", "foreign object detected"), ("over_temperature", "over temperature")],
)
def test_an_error_stays_until_it_is_cleared_after_its_cause_has_gone(cause: str, text: str) -> None:
    plant = parked()
    plant.press(cause, True, 5.0)
    assert (plant.reading().error_text, plant.sense(cause)) == (text, True)
    plant.drive("clear_error", True, 6.0)
    plant.press(cause, False, 7.0)
    plant.advance(8.0)
    plant.drive("clear_error", True, 9.0)
    plant.advance(12.0)
    assert plant.reading().error_text == ""
    assert plant.edges == [
        Edge(1.0, "a", "sensor", "state", "handshake"),
        Edge(3.0, "a", "sensor", "state", "charging"),
        Edge(5.0, "a", "sensor", "state", "error"),
        Edge(6.0, "a", "relay", "clear_error", True),
        Edge(9.0, "a", "relay", "clear_error", True),
        Edge(9.0, "a", "sensor", "state", "idle"),
        Edge(9.0, "a", "sensor", "state", "handshake"),
        Edge(11.0, "a", "sensor", "state", "charging"),
    ]


def test_a_clearing_without_an_error_and_a_cause_without_a_robot_change_nothing() -> None:
    plant = ChargerPlant("a")
    plant.press("foreign_object", True, 1.0)
    plant.drive("clear_error", True, 2.0)
    plant.advance(100.0)
    assert states(plant) == []


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
def test_the_robots_receiver_fails_in_five_ways(
    mode: FailureMode, history: list[tuple[float, str]]
) -> None:
    plant = parked(("receiver", mode))
    plant.advance(25.0)
    assert states(plant) == history


def test_a_handshake_that_hangs_shows_no_progress_and_a_mended_receiver_is_recognised() -> None:
    plant = parked(("receiver", "stuck"))
    plant.advance(100.0)
    assert plant.reading().progress == 0.0
    silent = parked(("receiver", "off"))
    silent.advance(50.0)
    silent.fail("receiver", None)
    silent.advance(60.0)
    assert states(silent) == [(50.0, "handshake"), (52.0, "charging")]


def commanded(asked: bool = False) -> ChargerPlant:
    """A station that charges only when it is told to, and knows two robots."""
    return ChargerPlant("a", {"7": "tiny/AMR01", "8": "tiny/AMR02"}, commanded=True, asked=asked)


def test_a_station_that_is_commanded_charges_while_it_is_told_to() -> None:
    plant = commanded()
    plant.press("tiny/AMR02", True, 1.0)
    plant.advance(5.0)
    assert states(plant) == []
    plant.drive("power", True, 5.0)
    plant.drive("power", True, 6.0)
    plant.drive("power", False, 10.0)
    plant.advance(20.0)
    assert states(plant) == [
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


def test_power_taken_in_the_handshake_ends_it() -> None:
    plant = commanded()
    plant.press("robot", True, 1.0)
    plant.drive("power", True, 2.0)
    plant.drive("power", False, 3.0)
    plant.advance(20.0)
    assert states(plant) == [(2.0, "handshake"), (3.0, "idle")]


def test_the_station_sees_the_receiver_of_who_came_last_and_nobodys_when_it_is_silent() -> None:
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
    assert seen == ["7", "8", "9999", "8", "7", ""]
    plant.press("robot", True, 2.0)
    plant.fail("receiver", "off")
    assert plant.reading().receiver == ""


def test_a_battery_fills_and_the_station_says_how_long_it_takes() -> None:
    plant = parked()
    readings = []
    for at in (2.0, 3.0, 21.0, 39.5):
        plant.advance(at)
        reading = plant.reading()
        left_s = reading.time_to_full_s
        whole = left_s if left_s is None else round(left_s)
        readings.append((reading.battery, reading.volts, reading.amps, whole))
    assert readings == [
        (0.4, 48.0, 0.0, None),
        (0.4, 48.0, 12.0, 36),
        (0.7, 51.0, 12.0, 18),
        (1.0, 54.0, 12.0, 0),
    ]


def test_a_robot_out_of_range_is_seen_so_and_cannot_be_charged() -> None:
    plant = parked()
    assert plant.reading().in_range is True
    plant.press("out_of_range", True, 2.0)
    assert plant.reading().in_range is False
    plant.advance(4.0)
    assert plant.reading().error_text == "the gap is too wide"


def test_a_range_check_takes_a_moment() -> None:
    plant = commanded(asked=True)
    plant.press("robot", True, 1.0)
    seen = [plant.reading().in_range]
    plant.drive("range_check", True, 2.0)
    for at in (2.2, 2.4):
        plant.advance(at)
        seen.append(plant.reading().in_range)
    assert seen == [None, None, True]


def test_an_unknown_part_or_signal_cannot_be_pressed_driven_or_broken() -> None:
    plant = ChargerPlant("a")
    with pytest.raises(
        ValueError, match=r"there are foreign_object, out_of_range, over_temp.*, robot, str"
    ):
        plant.press("door", True, 1.0)
    with pytest.raises(ValueError, match="there are body, headers, receiver, server"):
        plant.fail("car", "off")
    with pytest.raises(KeyError):
        plant.drive("light", True, 1.0)
