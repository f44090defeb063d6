"""Rides of RMF's robots on a simulated lift, in which one wire or one part is broken.

The node, the driver and the wires take part. A robot may wait for ever at a broken part, but the lift
must not show OPEN while its door is closed. After the repair the robot gives up, and another robot must
complete a ride.
"""

from dataclasses import dataclass

import pytest

from bridges.kinds.lift.signals import LiftOutputs
from bridges.messages.definitions import LiftState
from drivers.lift.dry_contact import wires
from hal_fakes.plants.lift import FAILS
from hal_fakes.plants.plant import FailureMode
from tests.depth import part
from tests.kinds.lift.rmf_world import World
from tests.kinds.lift.wired import WiredStory, shipped
from workbench.rmf_model.robot import RobotContext

LATE_S = 0.3
"""The longest time (s) for which a state may still show an open door. It consists of the debounce, one
scan, and the least time between two states."""

WIRES = [w.signal for w in wires(shipped())]
WIRE_FAILURES: list[FailureMode] = ["off", "stuck", "wrong"]
LIES = {("door", "wrong")}
"""The failures after which the lift may wrongly show OPEN. The only contact of the door reports
"open"."""

BREAKS = [(w, mode) for w in WIRES for mode in WIRE_FAILURES if (w, mode) not in LIES]
BREAKS += [(p, m) for p, modes in FAILS.items() for m in modes if p != "rear_door_operator"]


@dataclass
class Witness:
    """A check of each published state against the simulated car. It remembers the landing at which the
    car last stood with an open door."""

    story: WiredStory
    open_at: str | None = None
    until: float = -1.0

    def looks(self) -> None:
        standing = self.story.building.standing_open_at
        if standing:
            self.open_at, self.until = standing, self.story.now + LATE_S

    def hears(self, state: LiftState) -> None:
        self.looks()
        if state.door_state == 2:
            assert self.story.now <= self.until, "OPEN is shown for a closed door"
            assert state.current_floor == self.open_at


def ride(broken: str, mode: FailureMode, broken_at: float) -> WiredStory:
    """Let a robot ride while this part fails. After the repair the robot gives up, and another robot
    rides."""
    story = WiredStory(scan_s=0.1, agv_timeout_s=5, floor_timeout_s=10, door_timeout_s=5)
    robot, other = RobotContext("fleet/a"), RobotContext("fleet/b")
    rmf = World(story, robot, other)
    witness = Witness(story)
    to_rmf = story.hear

    def hear(state: LiftState) -> None:
        witness.hears(state)
        to_rmf(state)

    story.hear = hear
    advance = story.building.advance

    def advanced(now: float) -> None:
        advance(now)
        witness.looks()

    story.building.advance = advanced  # type: ignore[method-assign]
    rmf.run(1.0)
    rmf.asks(robot, "L3")
    rmf.run(broken_at)
    story.fail(broken, mode)
    rmf.run(30.0)
    story.fail(broken, None)
    rmf.run(31.0)
    rmf.releases(robot)
    rmf.until_done(robot)
    story.resets()
    rmf.run(story.now + 10.0)
    assert story.outputs == LiftOutputs()
    rmf.rides(other, "L1", "L2")
    return story


@pytest.mark.parametrize(("broken", "mode"), part(BREAKS, 3))
def test_no_part_broken_before_the_ride_shows_a_closed_door_as_open(
    broken: str, mode: FailureMode
) -> None:
    ride(broken, mode, broken_at=1.0)


@pytest.mark.parametrize(("broken", "mode"), part(BREAKS, 3, 1))
def test_no_part_that_breaks_on_the_way_shows_a_closed_door_as_open(
    broken: str, mode: FailureMode
) -> None:
    ride(broken, mode, broken_at=3.0)


@pytest.mark.parametrize("signal", [w for w in WIRES if w.startswith("floor")])
def test_a_broken_floor_line_is_an_illegal_floor_code(signal: str) -> None:
    story = WiredStory()
    story.run(1.0)
    story.fail(signal, "wrong")
    story.run(2.0)
    assert story.faults == ["FLOOR_CODE_ILLEGAL"]
    assert story.state == "HUMAN, moving at ?"


@pytest.mark.parametrize(
    ("signal", "state"),
    [("fire_alarm", "FIRE, moving at L1"), ("code_blue", "EMERGENCY, moving at L1")],
)
def test_a_cut_alarm_loop_is_an_alarm(signal: str, state: str) -> None:
    story = WiredStory()
    story.run(1.0)
    story.fail(signal, "off")
    story.run(2.0)
    assert story.state == state
