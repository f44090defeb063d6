"""The simulated robot in virtual time. It drives, turns, drains its battery, charges, rides a lift and
fails."""

import msgspec
import pytest

from bridges.kinds.fleet.signals import Pose
from hal_fakes.plants.plant import FailureMode
from hal_fakes.plants.robot import RIDE_S, SPEED, RobotOrder, RobotPlant

START = Pose("L1", 0.0, 0.0)
CHARGER = Pose("L1", 7.0, 0.0)


def robot() -> RobotPlant:
    made = RobotPlant(
        "AMR01", START, (CHARGER,), {"Lift1": (Pose("L1", 0.0, 7.0), Pose("L2", 0.0, 7.0))}
    )
    made.advance(100.0)
    made.reading()
    return made


def order(plant: RobotPlant, doing: str, at: Pose | None = None, number: str = "7") -> None:
    text = msgspec.json.encode(RobotOrder(number, doing, at)).decode()
    plant.drive(text, True, plant.now)


def after(plant: RobotPlant, seconds: float) -> Pose:
    plant.advance(plant.now + seconds)
    at = plant.reading().at
    return Pose(at.map, round(at.x, 3), round(at.y, 3), round(at.yaw, 3))


def test_a_robot_drives_straight_and_reports_the_order_at_its_arrival() -> None:
    plant = robot()
    order(plant, "go", CHARGER)
    assert after(plant, 5.0) == Pose("L1", 5 * SPEED, 0.0)
    assert (plant.reading().moving, plant.reading().completed) == (True, "")
    assert after(plant, 5.1) == CHARGER
    assert (plant.reading().moving, plant.reading().completed) == (False, "7")


def test_a_robot_drains_during_a_drive_and_charges_at_a_charger() -> None:
    plant = robot()
    order(plant, "go", CHARGER)
    after(plant, 9.0)
    drained = plant.reading().battery
    assert drained < 0.8
    after(plant, 30.0)
    assert plant.reading().charging
    assert plant.reading().battery > drained


def test_a_stop_ends_the_drive() -> None:
    plant = robot()
    order(plant, "go", CHARGER)
    after(plant, 5.0)
    order(plant, "stop", number="8")
    assert after(plant, 60.0) == Pose("L1", 5 * SPEED, 0.0)


@pytest.mark.parametrize(
    ("mode", "x"), [("off", 0.0), ("stuck", 0.0), ("slow", 1.4), ("wrong", 3.5), ("garbage", 3.5)]
)
def test_wheels_fail_as_the_table_says(mode: FailureMode, x: float) -> None:
    plant = robot()
    plant.fail("wheels", mode)
    order(plant, "go", CHARGER)
    assert after(plant, 10.1).x == pytest.approx(x, abs=0.05)


def test_localiser_and_battery_fail_as_the_table_says() -> None:
    plant = robot()
    plant.fail("localiser", "wrong")
    plant.fail("battery", "wrong")
    assert (plant.reading().at.map, plant.reading().battery) == ("unmapped", 2.5)
    plant.fail("localiser", "garbage")
    plant.fail("battery", "garbage")
    assert (plant.reading().at.x, plant.reading().battery) == (500.0, -0.03)


def test_a_lost_robot_repeats_its_report_and_a_lying_robot_reports_its_order_done() -> None:
    plant = robot()
    plant.press("lost", True, plant.now)
    before = plant.reading()
    order(plant, "go", CHARGER)
    after(plant, 5.0)
    assert plant.reading() == before
    plant.press("lost", False, plant.now)
    plant.press("lies", True, plant.now)
    order(plant, "go", START, "8")
    assert plant.reading().completed == "8"


def test_a_car_carries_the_robot_to_its_floors_in_turn() -> None:
    plant = robot()
    order(plant, "go", Pose("L1", 0.0, 7.0))
    after(plant, 13.2)
    assert plant.reading().at.map == "L1"
    floors = [after(plant, RIDE_S).map for _ in range(3)]
    assert floors == ["L2", "L1", "L2"]
