"""LIFT-SENSING-3, LIFT-SENSING-4: floor codes, and readings of floors that the car cannot have
reached."""

from msgspec.structs import replace

from bridges.kinds.lift.sensing import MOTION_MEMORY_S
from bridges.kinds.lift.signals import (
    DoorReading,
    LiftOutputs,
    LiftSample,
    Motion,
)
from bridges.kinds.shared.decision import (
    OperatorReset,
)
from tests.kinds.lift.alone import AT_L1, CLOSED, Alone
from tests.kinds.lift.story import OPEN_AT_L1, Building, Controller, Story, boarding

# ---- LIFT-SENSING-3: a floor that the car cannot have reached


def test_passing_a_floor_is_not_an_arrival() -> None:
    story = Story(Controller())
    story.run(1.0)
    story.asks("A", "L3")
    story.until(lambda: story.state == "AGV, closed at L2, A to L3")
    story.asks("A", "L2")
    story.run(story.now + 1.0)
    assert story.outputs.hold_door is None
    assert [state for _, state in story.states if "open" in state] == []


def test_a_floor_code_that_jumps_over_a_floor_is_not_believed() -> None:
    story = boarding()
    story.building.set(level="L3")
    story.run(5.0)
    assert story.state == "AGV, moving at ?, A to L1"
    assert story.node.status()["faults"] == [
        {
            "code": "POSITION_LOST",
            "detail": "the floor code shows L3, but no ride there from L1 was seen",
        }
    ]
    assert story.outputs == LiftOutputs(agv_request=True)
    story.building.set(level="L1")
    story.run(6.0)
    assert story.state == "AGV, open at L1, A to L1"
    assert story.faults == []


def test_a_floor_code_that_changes_while_the_car_stands_is_not_believed() -> None:
    story = boarding()
    story.run(5.0)
    story.building.set(level="L2")
    story.run(6.0)
    assert story.state == "AGV, moving at ?, A to L1"
    assert story.faults == ["POSITION_LOST"]


def test_an_impossible_floor_code_stays_doubted_after_time_between_floors() -> None:
    story = boarding()
    story.building.set(level="L3")
    story.run(3.0)
    story.building.set(level=None, motion=Motion.UP)
    story.run(6.0)
    story.building.set(level="L3", motion=Motion.STOPPED)
    story.run(7.0)
    assert story.faults == ["POSITION_LOST"]


def test_a_doubted_floor_is_believed_after_the_car_has_gone_there() -> None:
    story = boarding()
    story.building.set(level="L3")
    story.run(3.0)
    story.building.set(level="L1")
    story.run(5.0)
    story.building.set(level=None, motion=Motion.UP)
    story.run(8.0)
    story.building.set(level="L3", motion=Motion.STOPPED)
    story.run(9.0)
    assert (story.faults, story.state) == ([], "AGV, open at L3, A to L1")


def test_a_doubted_floor_is_believed_after_a_ride_over_a_floor_that_only_one_reading_showed() -> (
    None
):
    alone = Alone(stale_after_s=60.0)(0.0, AT_L1)(0.1, replace(AT_L1, level="L3"))
    assert [fault.code for fault in alone.faults] == ["POSITION_LOST"]
    moving = replace(AT_L1, motion=Motion.UP)
    for now, level in ((1.0, None), (2.0, "L2"), (3.0, None), (4.0, "L3")):
        alone(now, replace(moving, level=level))
    assert (alone.decision.report.floor, alone.faults) == ("L3", ())


def test_a_rejected_floor_is_believed_after_the_car_has_gone_there() -> None:
    alone = Alone(stale_after_s=60.0)(0.0, AT_L1)(0.1, replace(AT_L1, level="L3"))(0.2, AT_L1)
    moving = replace(AT_L1, motion=Motion.UP)
    for now, level in ((1.0, None), (2.0, "L2"), (3.0, None), (4.0, "L3")):
        alone(now, replace(moving, level=level))
    assert (alone.decision.report.floor, alone.faults) == ("L3", ())


def test_a_floor_code_that_changes_long_after_the_car_stopped_is_not_believed() -> None:
    story = boarding()
    story.building.set(motion=Motion.UP)
    story.run(3.0)
    story.building.set(motion=Motion.STOPPED)
    story.run(5.5)
    story.building.set(level="L2")
    story.run(6.0)
    assert story.faults == ["POSITION_LOST"]


def test_a_slowly_debounced_floor_code_still_belongs_to_the_last_movement() -> None:
    building = Building(OPEN_AT_L1)
    story = Story(building, debounce={"floor": 3.0})
    story.run(5.0)
    building.set(motion=Motion.UP)
    story.run(6.0)
    building.set(level="L2", motion=Motion.STOPPED)
    story.run(12.0)
    assert (story.faults, story.state) == ([], "AGV, open at L2")


def test_a_floor_may_change_within_its_debounce_after_the_last_movement() -> None:
    moving = replace(AT_L1, motion=Motion.UP)
    alone = Alone({"floor": 0.5}, stale_after_s=60.0)(0.0, moving)(1.0, moving)
    alone(1.1, AT_L1)(2.9, replace(AT_L1, level="L2"))(3.45, replace(AT_L1, level="L2"))
    assert (alone.decision.report.floor, alone.faults) == ("L2", ())


def test_the_next_floor_is_believed_until_a_movement_is_forgotten() -> None:
    alone = Alone(stale_after_s=60.0)(0.0, AT_L1)(1.0, replace(AT_L1, motion=Motion.UP))
    alone(1.0 + MOTION_MEMORY_S, replace(AT_L1, level="L2"))
    assert (alone.decision.report.floor, alone.faults) == ("L2", ())


def test_an_operators_reset_confirms_the_floor_code() -> None:
    story = boarding()
    story.building.set(level="L3")
    story.run(5.0)
    story.resets()
    story.run(6.0)
    assert story.faults == []
    assert story.state == "AGV, open at L3, A to L1"
    assert story.outputs == LiftOutputs(agv_request=True, call="L1")


def test_after_a_reset_the_shown_floor_is_believed_at_once() -> None:
    alone = Alone()(0.0, AT_L1)(0.1, replace(AT_L1, level="L3"))
    assert (alone.decision.report.floor, alone(0.1, OperatorReset()).decision.report.floor) == (
        "",
        "L3",
    )


def test_a_reset_without_a_fault_moves_nothing() -> None:
    story = boarding()
    edges, states = list(story.edges), list(story.states)
    story.resets()
    story.run(3.0)
    assert (story.edges, story.states) == (edges, states)


def test_without_motion_lines_the_next_floor_is_believed_but_a_jump_is_not() -> None:
    story = boarding(motion=None)
    story.building.set(level="L2")
    story.run(3.0)
    assert story.faults == []
    story.building.set(level="L4")
    story.run(4.0)
    assert story.faults == ["POSITION_LOST"]


def test_a_fast_car_may_skip_the_code_of_a_floor_if_its_time_suffices() -> None:
    story = boarding(door=DoorReading.CLOSED)
    story.building.set(level=None, motion=Motion.UP)
    story.run(3.0)
    story.building.set(level="L3", motion=Motion.STOPPED)
    story.run(4.0)
    assert (story.faults, story.state) == ([], "AGV, closed at L3, A to L1")


def test_a_car_may_pass_a_floor_unseen_in_its_least_travel_time() -> None:
    moving = replace(AT_L1, motion=Motion.UP)
    alone = Alone(stale_after_s=60.0, floor_travel_min_s=2.0)(0.0, moving)
    alone(2.0, replace(moving, level="L3"))
    assert (alone.decision.report.floor, alone.faults) == ("L3", ())


def test_the_travel_is_timed_from_a_floor_that_only_one_reading_showed() -> None:
    alone = Alone(floor_travel_min_s=1.0)(0.0, CLOSED)
    between = replace(CLOSED, level=None, motion=Motion.UP)
    alone(0.5, between)(5.0, between)(9.0, replace(between, level="L2"))(9.5, between)
    alone(11.0, replace(between, level="L1"))(11.5, between)
    alone(11.9, replace(between, level="L3"))
    assert [fault.code for fault in alone.faults] == ["POSITION_LOST"]


def test_a_floor_that_is_passed_within_its_debounce_does_not_lose_the_car() -> None:
    building = Building(OPEN_AT_L1)
    story = Story(building, debounce={"floor": 0.7})
    story.run(2.0)
    building.set(motion=Motion.UP)
    story.run(3.0)
    building.set(level="L2")
    story.run(3.6)
    building.set(level="L3")
    story.run(4.0)
    building.set(motion=Motion.STOPPED)
    story.run(6.0)
    assert (story.state, story.faults) == ("AGV, open at L3", [])


def test_a_debounce_longer_than_the_travel_makes_no_jump_believable() -> None:
    building = Building(OPEN_AT_L1)
    story = Story(building, debounce={"floor": 0.7})
    story.run(2.0)
    building.set(level="L3", motion=Motion.UP)
    story.run(4.0)
    assert (story.state, story.faults) == ("AGV, moving at ?", ["POSITION_LOST"])


# ---- LIFT-SENSING-4: a floor code that is valid only in AGV mode


class FloorsInAgvMode(Controller):
    """A lift whose floor code is valid only in AGV mode (`valid_when`). Its motion lines are always
    valid."""

    def read(self) -> LiftSample:
        sample = super().read()
        return sample if sample.agv else replace(sample, level=None, floor_valid=False)


def test_a_floor_code_is_believed_after_a_time_in_which_it_was_invalid() -> None:
    lift = FloorsInAgvMode()
    story = Story(lift)
    story.run(1.0)
    story.asks("A", "L3")
    story.until(lambda: story.state == "AGV, open at L3, A to L3")
    story.ends("A")
    story.run(story.now + 10.0)
    lift.goal = 0
    story.until(lambda: lift.standing)
    story.run(story.now + 60.0)
    assert (story.state, story.faults) == ("HUMAN, closed at ?", [])
    story.asks("B", "L1")
    story.until(lambda: story.state == "AGV, open at L1, B to L1")
    assert story.faults == []


def test_a_jump_between_valid_floor_codes_is_not_believed() -> None:
    lift = FloorsInAgvMode()
    story = Story(lift)
    story.run(1.0)
    story.asks("A", "L1")
    story.until(lambda: story.state == "AGV, open at L1, A to L1")
    lift.height = 2.0
    story.run(story.now + 5.0)
    assert (story.state, story.faults) == ("AGV, closed at ?, A to L1", ["POSITION_LOST"])


def test_a_flicker_of_the_agv_line_does_not_make_a_jump_believable() -> None:
    lift = FloorsInAgvMode()
    story = Story(lift)
    story.run(1.0)
    story.asks("A", "L1")
    story.until(lambda: story.state == "AGV, open at L1, A to L1")
    lift.height = 2.0
    story.run(story.now + 5.0)
    lift.asked_at = story.now + 0.06
    story.run(story.now + 5.0)
    assert (story.state, story.faults) == ("AGV, closed at ?, A to L1", ["POSITION_LOST"])
