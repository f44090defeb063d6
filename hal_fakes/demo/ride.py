"""`make demo`: a robot's day. A fleet adapter drives the robot through a door, up in a lift and to a
charger. The check of the day reads only the journal of events."""

from collections.abc import Iterable
from itertools import groupby
from pathlib import Path
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import topics, words
from bridges.messages.stamps import duration
from hal_fakes.demo.demo_run import Demo
from hal_fakes.demo.journal import Journal
from hal_fakes.demo.world import World
from workbench.rmf_model.phases import DoorClose, DoorOpen, EndLiftSession, RequestLift
from workbench.rmf_model.robot import Phase, RobotContext
from workbench.rmf_model.supervisors import DoorSupervisor, LiftSupervisor

FLEET, ROBOT = "demo", "robot"
SESSION = f"{FLEET}/{ROBOT}"
DOOR, LIFT, FROM, TO, CHARGER = "ward_door", "Lift1", "L1", "L3", "charger_a"
REQUEST_ID: Final = "demo-1"
DRIVE_S: Final = 2.0
CHARGE_S: Final = 3.0


def dawns(world: World) -> bool:
    """Is every daemon up and listening, and has every daemon published its sensors' state?"""
    lift = world.journal.latest(LIFT)
    return (
        world.listened_to(topics.LIFT_REQUESTS, topics.DOOR_REQUESTS, topics.CHARGER_REQUESTS)
        and isinstance(lift, d.LiftState)
        and lift.current_floor == FROM
        and world.door_is(DOOR, d.DoorModeValue.MODE_CLOSED)
        and world.charger_is(CHARGER, "IDLE")
    )


def live(world: World) -> None:
    """Play the whole day."""
    robot = RobotContext(SESSION)
    world.join(LiftSupervisor(), DoorSupervisor(), robot)
    with world.leg("door"):
        _through_the_door(world, robot)
    with world.leg("lift"):
        _up_in_the_lift(world, robot)
    with world.leg("charge"):
        _charge(world)
    with world.leg("rest"):
        world.until(lambda: _at_rest(world), 15, "all relays to be off and the door to be closed")


def _phase(
    world: World, robot: RobotContext, phase: Phase, text: str, within_s: float, what: str
) -> None:
    """Let the robot's fleet adapter begin a phase, and wait for the end of the phase."""
    world.note(text, SESSION)
    world.say(robot.begin(phase, world.wall()))
    world.until(lambda: robot.done, within_s, what)


def _drive(world: World, text: str) -> None:
    world.note(text, SESSION)
    world.pause(DRIVE_S)


def _through_the_door(world: World, robot: RobotContext) -> None:
    listed = f"{DOOR} to be open, and the heartbeat to list the robot"
    _phase(world, robot, DoorOpen(DOOR), f"asks for {DOOR}", 20, listed)
    _drive(world, "drives through")
    dropped = "the heartbeat to list the robot no longer"
    _phase(world, robot, DoorClose(DOOR), f"is through, releases {DOOR}", 5, dropped)


def _up_in_the_lift(world: World, robot: RobotContext) -> None:
    for floor, inside, text, drives in (
        (FROM, False, f"asks for {LIFT} at {FROM}", "drives in"),
        (TO, True, f"is in the car, asks for {TO}", "drives out"),
    ):
        there = f"{LIFT} at {floor}, door open, held by {SESSION}"
        _phase(world, robot, RequestLift(LIFT, floor, inside=inside), text, 20, there)
        _drive(world, drives)
        robot.in_car = not inside
    text = f"is out, ends the session of {LIFT}"
    _phase(world, robot, EndLiftSession(LIFT), text, 5, f"{LIFT} to be held by {SESSION} no longer")


def _charge(world: World) -> None:
    request = d.ChargerRequest(CHARGER, FLEET, ROBOT, duration(30), REQUEST_ID)
    world.note(f"asks for {CHARGER}", SESSION)
    world.until(
        lambda: world.charger_is(CHARGER, "ASSIGNED"),
        10,
        f"{CHARGER} to be assigned",
        repeat=(topics.CHARGER_REQUESTS, request),
    )
    world.note("drives onto the pad", SESSION)
    world.press(CHARGER, "robot", True)
    world.until(lambda: world.charger_is(CHARGER, "CHARGING"), 15, f"{CHARGER} to charge")
    world.pause(CHARGE_S)
    world.note("leaves the pad", SESSION)
    world.press(CHARGER, "robot", False)
    world.until(lambda: world.charger_is(CHARGER, "IDLE"), 15, f"{CHARGER} to be idle")


def _at_rest(world: World) -> bool:
    return world.door_is(DOOR, d.DoorModeValue.MODE_CLOSED) and not world.journal.relays_on()


# --- the check of the day, from the journal alone ------------------------------------------------

RELAYS = {
    DOOR: [("hold_open", True), ("hold_open", False)],
    LIFT: [
        ("agv_mode_request", True),
        ("door_open", True),
        ("door_open", False),
        (f"call_{TO}", True),
        (f"call_{TO}", False),
        ("door_open", True),
        ("door_open", False),
        ("agv_mode_request", False),
    ],
}
"""The relay edges that each device must have on this day. Other edges are errors."""
CHARGING = ["IDLE", "ASSIGNED", "CHARGING", "RELEASED", "IDLE"]


def problems(journal: Journal) -> list[str]:
    """Return all errors of the day. The list is empty after a correct day."""
    return [*_relays(journal), *_door(journal), *_lift(journal), *_charger(journal)]


def _relays(journal: Journal) -> Iterable[str]:
    for device, expected in RELAYS.items():
        seen = [
            (e.signal, e.value) for e in journal.edges if (e.device, e.what) == (device, "relay")
        ]
        if seen != expected:
            yield f"{device}'s relays: {_edges(seen)}; expected {_edges(expected)}"


def _edges(edges: Iterable[tuple[str, object]]) -> str:
    return ", ".join(f"{signal} {'on' if value else 'off'}" for signal, value in edges) or "none"


def _door(journal: Journal) -> Iterable[str]:
    states = [s for s in journal.states if isinstance(s, d.DoorState) and s.door_name == DOOR]
    modes = _in_order(words.word(d.DoorModeValue, s.current_mode.value) for s in states)
    if modes != ["CLOSED", "MOVING", "OPEN", "MOVING", "CLOSED"]:
        yield f"{DOOR} was {' '.join(modes)}"


def _lift(journal: Journal) -> Iterable[str]:
    states = [s for s in journal.states if isinstance(s, d.LiftState) and s.lift_name == LIFT]
    ours = [s for s in states if s.session_id == SESSION]
    opened = _in_order(s.current_floor for s in ours if s.door_state == d.LiftDoor.DOOR_OPEN)
    if opened != [FROM, TO]:
        yield (
            f"{LIFT} was open for the robot at {' '.join(opened) or 'no floor'}, expected"
            f" {FROM} {TO}"
        )
    sessions = _in_order(s.session_id for s in states)
    if sessions != ["", SESSION, ""]:
        seen = ", ".join(session or "none" for session in sessions)
        yield f"{LIFT}'s sessions were: {seen}"


def _charger(journal: Journal) -> Iterable[str]:
    states = [s for s in journal.states if isinstance(s, d.ChargerState)]
    states = [s for s in states if s.charger_name == CHARGER]
    order = _in_order(words.word(d.ChargerStateValue, s.state) for s in states)
    if order != CHARGING:
        yield f"{CHARGER} was {' '.join(order)}, expected {' '.join(CHARGING)}"
    for state in states:
        idle = state.state == d.ChargerStateValue.CHARGER_IDLE
        expected = "" if idle else f"{SESSION} (request {REQUEST_ID})"
        if words.holder(state) != expected:
            yield (
                f"{CHARGER} was {words.plain(d.ChargerStateValue, state.state)} for"
                f" {words.holder(state) or 'nobody'}, expected {expected or 'nobody'}"
            )
            return


def _in_order(values: Iterable[str]) -> list[str]:
    """Return the items in their order. Leave out an item that only repeats the item before it."""
    return [value for value, _ in groupby(values)]


CONFIG = Path(__file__).parents[2] / "config"
DEMO: Final = Demo(
    files={
        LIFT: CONFIG / "lift_dry_contact.yaml",
        DOOR: CONFIG / "door_modbus.yaml",
        CHARGER: CONFIG / "charger_http.yaml",
    },
    dawn=f"{LIFT} at {FROM}, {DOOR} closed and {CHARGER} idle",
    dawns=dawns,
    live=live,
    problems=problems,
    right=(
        f"the robot went through the door, rode from {FROM} to {TO} and charged; every relay is off."
    ),
)
