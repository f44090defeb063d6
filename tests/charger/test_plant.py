"""The charging station's physics, in virtual time."""

import pytest

from bridges.charger.signals import Activity
from hal_fakes.charger_plant import ChargerPlant, build
from hal_fakes.plant import Edge, FailureMode, Plant


def states(plant: ChargerPlant) -> list[tuple[float, bool | int | str | float]]:
    return [(e.at, e.value) for e in plant.edges if e.signal == "state"]


def parked(*failures: tuple[str, FailureMode]) -> ChargerPlant:
    """A station onto whose pad a robot comes at 1 s."""
    plant = build("a", None)
    for part, mode in failures:
        plant.fail(part, mode)
    plant.press("robot", True, 1.0)
    return plant


def test_a_plant_is_one() -> None:
    plant: Plant = build("charger_a", None)
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
    reading = plant.sense("reading")
    assert (reading.activity, reading.progress) == (Activity.HANDSHAKE, 0.5)


@pytest.mark.parametrize(
    ("cause", "text"),
    [("foreign_object", "foreign object detected"), ("over_temperature", "over temperature")],
)
def test_an_error_stays_until_it_is_cleared_after_its_cause_has_gone(cause: str, text: str) -> None:
    plant = parked()
    plant.press(cause, True, 5.0)
    assert (plant.sense("reading").error_text, plant.sense(cause)) == (text, True)
    plant.drive("clear_error", True, 6.0)
    plant.press(cause, False, 7.0)
    plant.advance(8.0)
    plant.drive("clear_error", True, 9.0)
    plant.advance(12.0)
    assert plant.sense("reading").error_text == ""
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
    plant = build("a", None)
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
    assert plant.sense("reading").progress == 0.0
    silent = parked(("receiver", "off"))
    silent.advance(50.0)
    silent.fail("receiver", None)
    silent.advance(60.0)
    assert states(silent) == [(50.0, "handshake"), (52.0, "charging")]


def test_what_does_not_exist_cannot_be_pressed_driven_or_broken() -> None:
    plant = build("a", None)
    with pytest.raises(ValueError, match="there are foreign_object, over_temperature, robot"):
        plant.press("door", True, 1.0)
    with pytest.raises(ValueError, match="there are body, headers, receiver, server"):
        plant.fail("car", "off")
    with pytest.raises(KeyError):
        plant.drive("power", True, 1.0)
