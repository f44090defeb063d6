"""`make demo-page`: a page that shows two lifts, two doors, two chargers, and five robots that ride
endlessly.

The daemons and the page are processes of their own. This process plays the fleet adapters. It lets a
part fail every minute, and ends with Ctrl-C.
"""

import secrets
import time
from collections.abc import Callable, Iterator, Mapping
from itertools import count, cycle
from pathlib import Path
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import duration
from hal_fakes.demo.demo_run import Demo
from hal_fakes.demo.world import World
from workbench.rmf_model.phases import DoorClose, DoorOpen, EndLiftSession, RequestLift
from workbench.rmf_model.robot import Phase, RobotContext

CONFIG = Path(__file__).parents[2] / "config"
HERE = Path(__file__).parent
FLEET: Final = "porter"
LIFT1, LIFT2, WARD, SIDE, PAD_A, PAD_E = (
    "Lift1",
    "Lift2",
    "ward_door",
    "side_door",
    "charger_a",
    "charger_e",
)
FAULTS: Final = (
    (WARD, "fail", "unit", "off", "ok"),
    (LIFT1, "press", "fire_alarm", "on", "off"),
    (PAD_A, "fail", "server", "off", "ok"),
    (LIFT2, "fail", "unit", "off", "ok"),
)
"""The faults, in the order in which they happen. Each fault has a device, `fail` or `press`, and a part
or signal. It also has the mode that begins the fault, and the mode that ends the fault."""
FAULT_EVERY_S, FAULT_LASTS_S = 60.0, 15.0
DRIVES_S: Final = 3.0
CHARGES_S: Final = 20.0

Step = Phase | float | Callable[[], bool]
"""One step of a robot. It is a phase of RMF's task, a number of seconds to wait, or a condition to
await."""


class Rider:
    """One robot that repeats its steps."""

    def __init__(self, world: World, robot: RobotContext, errands: Iterator[Step]) -> None:
        self.robot = robot
        self._world = world
        self._errands = errands
        self._step: Step = 0.0
        self._until = 0.0

    def go_on(self, now: float) -> None:
        """Begin the next step, if the present step is over."""
        match self._step:
            case Phase():
                done = self.robot.done
            case float():
                done = now >= self._until
            case ready:
                done = ready()
        if not done:
            return
        self._step = next(self._errands)
        if isinstance(self._step, Phase):
            self._world.say(self.robot.begin(self._step, self._world.wall()))
        elif isinstance(self._step, float):
            self._until = now + self._step


def errands(
    robot: RobotContext, lift: str, door: str, floors: tuple[str, str], levels: dict[str, str]
) -> Iterator[Step]:
    """Yield the robot's steps endlessly. The robot goes through a door, rides up or down in a lift, and
    rests. `levels` holds each robot's level."""
    there = cycle((floors, floors[::-1]))
    for start, goal in there:
        yield DoorOpen(door)
        yield DRIVES_S
        yield DoorClose(door)
        yield RequestLift(lift, start, inside=False)
        yield DRIVES_S
        robot.in_car = True
        yield RequestLift(lift, goal, inside=True)
        yield DRIVES_S
        robot.in_car = False
        levels[robot.requester_id] = goal
        yield EndLiftSession(lift)
        yield DRIVES_S


def charges(world: World, robot: str, charger: str) -> Iterator[Step]:
    """Yield the robot's steps endlessly. The robot drives onto the pad, charges for some time, and
    leaves the pad."""
    numbers = count(1)
    request_at = [0.0]

    def asked(request: d.ChargerRequest) -> Callable[[], bool]:
        def assigned() -> bool:
            if world.charger_is(charger, "ASSIGNED"):
                return True
            if time.monotonic() >= request_at[0]:
                request_at[0] = time.monotonic() + 1.0
                world.say([(topics.CHARGER_REQUESTS, request)])
            return False

        return assigned

    for number in numbers:
        wanted = duration(30.0)
        yield asked(d.ChargerRequest(charger, FLEET, robot, wanted, f"{robot}-{number}"))
        yield DRIVES_S
        world.press(charger, "robot", True)
        yield CHARGES_S
        world.press(charger, "robot", False)
        yield DRIVES_S


def live(world: World) -> None:
    """Let the robots ride and charge endlessly. Let a fault begin and end every minute."""
    rides = (
        ("R1", LIFT1, WARD, ("L1", "L3")),
        ("R2", LIFT1, SIDE, ("L2", "L4")),
        ("R3", LIFT2, WARD, ("L4", "L1")),
    )
    robots = [RobotContext(f"{FLEET}/{name}") for name, *_ in rides]
    levels = {f"{FLEET}/{name}": start for name, _, _, (start, _) in rides}
    world.join(*robots)
    riders = [
        Rider(world, robot, errands(robot, lift, door, floors, levels))
        for robot, (_, lift, door, floors) in zip(robots, rides, strict=True)
    ]
    riders.append(Rider(world, RobotContext(f"{FLEET}/R4"), charges(world, "R4", PAD_A)))
    riders.append(Rider(world, RobotContext(f"{FLEET}/R5"), charges(world, "R5", PAD_E)))
    trouble = Rider(world, RobotContext("nobody"), _troubles(world))
    fleet_at = [0.0]

    def turn() -> bool:
        now = time.monotonic()
        for rider in (*riders, trouble):
            rider.go_on(now)
        if now >= fleet_at[0]:
            fleet_at[0] = now + 1.0
            world.say([(topics.FLEET_STATES, _fleet(riders, levels, now))])
            world.journal.forget()
        return False

    world.until(turn, float("inf"), "Ctrl-C")


def _troubles(world: World) -> Iterator[Step]:
    for device, verb, part, begins, ends in cycle(FAULTS):
        yield FAULT_EVERY_S - FAULT_LASTS_S
        act = world.fail if verb == "fail" else _press(world)
        world.note(f"{part} of {device}: {begins}")
        world.note(world.page)
        act(device, part, begins)
        yield FAULT_LASTS_S
        world.note(f"{part} of {device}: {ends}")
        act(device, part, ends)
        if verb == "press":
            world.daemons[device].reset()


def _press(world: World) -> Callable[[str, str, str], None]:
    return lambda device, part, how: world.press(device, part, how == "on")


def _fleet(riders: list[Rider], levels: Mapping[str, str], now: float) -> d.FleetState:
    robots = []
    for number, rider in enumerate(riders):
        name = rider.robot.requester_id
        charges = name not in levels
        mode = d.RobotModeValue.MODE_CHARGING if charges else d.RobotModeValue.MODE_MOVING
        level = "car" if rider.robot.in_car else levels.get(name, "L1")
        robots.append(
            d.RobotState(
                name.removeprefix(f"{FLEET}/"),
                mode=d.RobotMode(mode),
                battery_percent=60 + (now + 9 * number) % 40,
                location=d.Location(level_name=level),
            )
        )
    return d.FleetState(FLEET, tuple(robots))


def dawns(world: World) -> bool:
    """Is every daemon up, and has every daemon published a state from its sensors?"""
    devices = (LIFT1, LIFT2, WARD, SIDE, PAD_A, PAD_E)
    return all(world.journal.latest(device) is not None for device in devices)


PASSWORD: Final = secrets.token_urlsafe(9)
DEMO: Final = Demo(
    files={
        LIFT1: CONFIG / "lift_dry_contact.yaml",
        LIFT2: HERE / "page_lift2.yaml",
        WARD: CONFIG / "door_modbus.yaml",
        SIDE: CONFIG / "door_http.yaml",
        PAD_A: CONFIG / "charger_http.yaml",
        PAD_E: CONFIG / "charger_contacts.yaml",
        "lift_supervisor": CONFIG / "lift_supervisor.yaml",
        "door_supervisor": CONFIG / "door_supervisor.yaml",
    },
    dawn="every device has published its state",
    dawns=dawns,
    live=live,
    problems=lambda journal: (),
    right="",
    page_password=PASSWORD,
    publishes=(
        topics.ADAPTER_LIFT_REQUESTS,
        topics.ADAPTER_DOOR_REQUESTS,
        topics.CHARGER_REQUESTS,
        topics.FLEET_STATES,
    ),
)
