"""The simulated door (the plant) in virtual time. It moves, waits and fails like a real door
operator."""

import pytest

from drivers.door.dry_contact import wires
from drivers.hal.points import Wire
from hal_fakes.plants.door import DoorPlant, build
from tests.kinds.door.virtual import settings

WIRES = [
    Wire("opened", "in", "unit 1 discrete input 0", "high"),
    Wire("closed", "in", "unit 1 discrete input 1", "high"),
    Wire("obstruction", "in", "unit 1 discrete input 2", "high"),
    Wire("fire", "in", "unit 1 discrete input 3", "high"),
    Wire("hold_open", "out", "unit 1 coil 0", "high"),
]


def plant() -> DoorPlant:
    return DoorPlant("door", WIRES, open_s=2.0, close_s=4.0, auto_close_s=1.0)


def edges(door: DoorPlant) -> list[tuple[float, str, object]]:
    return [(edge.at, edge.signal, edge.value) for edge in door.edges]


def test_a_door_opens_while_it_is_held_and_closes_by_itself_afterwards() -> None:
    door = plant()
    door.drive("hold_open", True, 1.0)
    door.drive("hold_open", False, 10.0)
    door.advance(60.0)
    assert edges(door) == [
        (1.0, "hold_open", True),
        (1.0, "closed", False),
        (3.0, "opened", True),
        (10.0, "hold_open", False),
        (11.0, "opened", False),
        (15.0, "closed", True),
    ]
    assert door.next_at() == float("inf")


def test_a_person_in_the_doorway_makes_the_door_reverse_half_way() -> None:
    door = plant()
    door.drive("hold_open", True, 0.0)
    door.drive("hold_open", False, 5.0)
    door.press("obstruction", True, 8.0)
    door.press("obstruction", False, 10.0)
    door.advance(60.0)
    assert edges(door)[4:] == [
        (6.0, "opened", False),
        (8.0, "obstruction", True),
        (9.0, "opened", True),
        (10.0, "obstruction", False),
        (11.0, "opened", False),
        (15.0, "closed", True),
    ]


def test_a_person_in_the_doorway_of_a_closed_door_does_not_open_it() -> None:
    door = plant()
    door.press("obstruction", True, 1.0)
    door.advance(60.0)
    assert edges(door) == [(1.0, "obstruction", True)]


def test_a_push_opens_the_door_without_a_relay() -> None:
    door = plant()
    door.press("push", True, 1.0)
    door.press("push", False, 4.0)
    door.advance(60.0)
    assert edges(door) == [
        (1.0, "closed", False),
        (3.0, "opened", True),
        (5.0, "opened", False),
        (9.0, "closed", True),
    ]


def test_a_fire_only_closes_a_contact() -> None:
    door = plant()
    door.press("fire", True, 1.0)
    assert edges(door) == [(1.0, "fire", True)]


@pytest.mark.parametrize("mode", ["off", "stuck"])
def test_a_dead_operator_stands_still_until_its_repair(mode: str) -> None:
    door = plant()
    door.drive("hold_open", True, 0.0)
    door.advance(1.0)
    door.fail("operator", mode)  # type: ignore[arg-type]
    door.advance(10.0)
    assert door.position == 0.5
    door.fail("operator", None)
    door.advance(60.0)
    assert edges(door)[-1] == (11.0, "opened", True)


def test_a_slow_operator_takes_five_times_as_long() -> None:
    door = plant()
    door.fail("operator", "slow")
    door.drive("hold_open", True, 0.0)
    door.advance(60.0)
    assert edges(door)[-1] == (10.0, "opened", True)


def test_a_confused_operator_stops_half_way() -> None:
    door = plant()
    door.fail("operator", "garbage")
    door.drive("hold_open", True, 0.0)
    door.advance(60.0)
    assert (door.position, door.next_at()) == (0.5, float("inf"))


def test_an_operator_with_wrong_wires_opens_when_it_is_released() -> None:
    door = plant()
    door.advance(0.0)
    door.fail("operator", "wrong")
    door.advance(5.0)
    door.drive("hold_open", True, 10.0)
    door.advance(60.0)
    assert edges(door) == [
        (0.0, "closed", False),
        (2.0, "opened", True),
        (10.0, "hold_open", True),
        (10.0, "opened", False),
        (14.0, "closed", True),
    ]


def test_an_unknown_press_or_failure_is_refused_with_the_known_names() -> None:
    with pytest.raises(ValueError, match="no 'bell' to press; there are fire, obstruction, push"):
        plant().press("bell", True, 0.0)
    with pytest.raises(ValueError, match=r"there are closed, fire, hold_open, .*, server, unit"):
        plant().fail("bell", "off")


def test_a_door_on_pins_has_no_module_to_fail() -> None:
    door = DoorPlant("door", [Wire("hold_open", "out", "BCM4", "high")])
    with pytest.raises(ValueError, match=r"there are hold_open, operator$"):
        door.fail("server", "off")


def test_an_operator_for_pulses_waits_for_the_next_pulse() -> None:
    pulsed = settings(pulse={"on_s": 0.5, "every_s": 3.0})
    door = build("door", pulsed, wires(pulsed))
    for second in range(0, 30, 3):
        door.drive("hold_open", True, float(second))
        door.drive("hold_open", False, second + 0.5)
    door.advance(30.0)
    assert [e.signal for e in door.edges if e.what == "sensor"] == ["closed", "opened"]
