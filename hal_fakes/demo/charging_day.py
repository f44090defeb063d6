"""The charging demo's day: a robot that cannot be charged, an operator, two robots too many, a robot at
the wrong charger, and a charger that overheats."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from hal_fakes.demo.charging_yard import FLEET, Yard

ONE, TWO, THREE = "AMR01", "AMR02", "AMR03"
A, B = "charger_a", "charger_b"


def live(yard: Yard) -> None:
    """All of it. Raises Wrong when something does not come about in time."""
    with _leg(yard, "failure of a robot", "AMR02's receiver is defective"):
        _robot_fails(yard)
    with _leg(yard, "ad-hoc", "AMR02 is mended, and an operator wants it charged now"):
        yard.operator_wants(TWO)
        yard.needs(TWO, 55)
        yard.until(lambda: yard.shows(A, "CHARGING", TWO), 10, f"{TWO} to be charged at {A}")
    with _leg(
        yard, "scheduled and stacked", "AMR01 and AMR03 come too: two chargers, three robots"
    ):
        _three_at_two(yard)
    with _leg(yard, "wrong station", "AMR01 drives to the wrong charger"):
        _strays(yard)
    with _leg(yard, "failure of a charger", "charger_a overheats"):
        _charger_fails(yard)


@contextmanager
def _leg(yard: Yard, name: str, text: str) -> Iterator[None]:
    began_at = time.monotonic()
    yard.stage.note(f"-- {name}: {text}")
    yield
    yard.journal.legs[name] = time.monotonic() - began_at


def _robot_fails(yard: Yard) -> None:
    for charger in (A, B):
        yard.stage.order(charger, f"fail {charger} receiver wrong")
    yard.needs(TWO, 40)
    robot_side = "robot: authentication timeout"
    yard.until(lambda: yard.shows(A, "ERROR", TWO, robot_side), 10, f"{A}'s self-check")
    yard.until(lambda: yard.shows(B, "ERROR", TWO, robot_side), 10, f"{B}'s self-check")
    yard.until(lambda: yard.alerted("ROBOT_FAULTY"), 3, "the technician to be called")
    yard.until(lambda: _idle(yard), 10, "both chargers to be free again")
    for charger in (A, B):
        yard.stage.order(charger, f"fail {charger} receiver ok")


def _three_at_two(yard: Yard) -> None:
    yard.needs(ONE, 60)
    yard.until(lambda: yard.places[ONE] == "charge at dock_b", 6, f"{ONE} to be sent to {B}")
    yard.needs(THREE, 70)
    yard.until(lambda: yard.shows(B, "CHARGING", ONE), 8, f"{ONE} to be charged at {B}")
    yard.until(lambda: yard.shows(B, "RELEASED"), 10, f"{B} to release {ONE}")
    yard.leaves(ONE)
    yard.until(lambda: yard.shows(B, "CHARGING", THREE), 10, f"{THREE} to be called to {B}")
    yard.leaves(TWO)
    yard.until(lambda: yard.shows(A, "IDLE"), 6, f"{A} to be free")


def _strays(yard: Yard) -> None:
    yard.needs(ONE, 50)
    yard.until(lambda: yard.places[ONE] == "charge at charger_a", 8, f"{ONE} to be sent to {A}")
    yard.leaves(THREE)
    yard.strays(ONE, "dock_b")
    wrong = f"wrong docking: {FLEET}/{ONE}"
    yard.until(lambda: yard.shows(B, "ERROR", error=wrong), 8, f"{B} to refuse {ONE}")
    yard.until(lambda: yard.alerted("WRONG_STATION"), 3, "somebody to be told")
    yard.until(lambda: yard.shows(A, "ASSIGNED", ONE), 2, f"{A} to be kept for {ONE}")
    yard.note("is sent to its own charger by a person", ONE)
    yard.strays(ONE, "charger_a")
    yard.until(lambda: yard.shows(A, "CHARGING", ONE), 8, f"{ONE} to be charged at {A}")


def _charger_fails(yard: Yard) -> None:
    yard.stage.press(A, "over_temperature", True)
    yard.until(lambda: yard.shows(A, "ERROR", error="over temperature"), 5, f"{A}'s self-check")
    yard.until(lambda: yard.alerted("STATION_OUT_OF_SERVICE"), 3, "the technician to be called")
    yard.until(lambda: yard.shows(B, "CHARGING", ONE), 10, f"{ONE} to be charged at {B} instead")
    yard.until(lambda: yard.shows(A, "ERROR"), 1, f"{A} to stay out of service")
    yard.note("the technician has cooled it, and resets it", A)
    yard.stage.press(A, "over_temperature", False)
    yard.stage.daemons[A].reset()
    yard.until(lambda: yard.shows(A, "IDLE"), 8, f"{A} to be in service again")
    yard.leaves(ONE)
    yard.until(lambda: _idle(yard), 8, "both chargers to be free")


def _idle(yard: Yard) -> bool:
    return yard.shows(A, "IDLE") and yard.shows(B, "IDLE")
