"""The robot's day: through a door, up in a lift, to a charger; as a fleet adapter would drive it."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from bridges.rmf import definitions as d
from bridges.rmf import topics
from bridges.rmf.stamps import duration
from hal_fakes.demo.world import World
from hal_fakes.rmf.phases import DoorClose, DoorOpen, EndLiftSession, RequestLift

FLEET, ROBOT = "demo", "robot"
DOOR, LIFT, FROM, TO, CHARGER = "ward_door", "Lift1", "L1", "L3", "charger_a"
REQUEST_ID: Final = "demo-1"
DRIVE_S: Final = 2.0
CHARGE_S: Final = 3.0
Press = Callable[[str, str, bool], None]
"""press(device, signal, on) at a plant."""


def dawns(world: World) -> bool:
    """Every daemon is up, listens, and has said what its sensors see."""
    lift = world.journal.latest(LIFT)
    return (
        world.nodes_listen()
        and isinstance(lift, d.LiftState)
        and lift.current_floor == FROM
        and _door_is(world, d.DoorModeValue.MODE_CLOSED)
        and _charger_is(world, d.ChargerStateValue.CHARGER_IDLE)
    )


def live(world: World, press: Press) -> None:
    """All of it. Raises Wrong when something does not come about in time."""
    with _leg(world, "door"):
        _through_the_door(world)
    with _leg(world, "lift"):
        _up_in_the_lift(world)
    with _leg(world, "charge"):
        _charge(world, press)
    with _leg(world, "rest"):
        world.until(lambda: _at_rest(world), 15, "all relays to be off and the door to be closed")


@contextmanager
def _leg(world: World, name: str) -> Iterator[None]:
    began_at = time.monotonic()
    yield
    world.journal.legs[name] = time.monotonic() - began_at


def _through_the_door(world: World) -> None:
    world.begin(DoorOpen(DOOR), f"asks for {DOOR}")
    world.until(lambda: world.robot.done, 20, f"{DOOR} to be open, and the heartbeat to list us")
    world.note("drives through")
    world.pause(DRIVE_S)
    world.begin(DoorClose(DOOR), f"is through, lets {DOOR} go")
    world.until(lambda: world.robot.done, 5, "the heartbeat to list us no more")


def _up_in_the_lift(world: World) -> None:
    robot = world.robot
    world.begin(RequestLift(LIFT, FROM, inside=False), f"asks for {LIFT} at {FROM}")
    world.until(lambda: robot.done, 20, f"{LIFT} at {FROM}, open, with our session")
    world.note("drives in")
    world.pause(DRIVE_S)
    robot.in_car = True
    world.begin(RequestLift(LIFT, TO, inside=True), f"is in the car, asks for {TO}")
    world.until(lambda: robot.done, 20, f"{LIFT} at {TO}, open, with our session")
    world.note("drives out")
    world.pause(DRIVE_S)
    robot.in_car = False
    world.begin(EndLiftSession(LIFT), f"is out, ends the session of {LIFT}")
    world.until(lambda: robot.done, 5, f"{LIFT} to show our session no more")


def _charge(world: World, press: Press) -> None:
    request = d.ChargerRequest(CHARGER, FLEET, ROBOT, duration(30), REQUEST_ID)
    world.note(f"asks for {CHARGER}")
    world.until(
        lambda: _charger_is(world, d.ChargerStateValue.CHARGER_ASSIGNED),
        10,
        f"{CHARGER} to be ASSIGNED",
        repeat=(topics.CHARGER_REQUESTS, request),
    )
    world.note("drives onto the pad")
    press(CHARGER, "robot", True)
    world.until(
        lambda: _charger_is(world, d.ChargerStateValue.CHARGER_CHARGING),
        15,
        f"{CHARGER} to be CHARGING",
    )
    world.pause(CHARGE_S)
    world.note("leaves the pad")
    press(CHARGER, "robot", False)
    world.until(
        lambda: _charger_is(world, d.ChargerStateValue.CHARGER_IDLE), 15, f"{CHARGER} to be IDLE"
    )


def _charger_is(world: World, state: d.ChargerStateValue) -> bool:
    latest = world.journal.latest(CHARGER)
    return isinstance(latest, d.ChargerState) and latest.state == state


def _door_is(world: World, mode: d.DoorModeValue) -> bool:
    latest = world.journal.latest(DOOR)
    return isinstance(latest, d.DoorState) and latest.current_mode.value == mode


def _at_rest(world: World) -> bool:
    return _door_is(world, d.DoorModeValue.MODE_CLOSED) and not world.journal.relays_on()
