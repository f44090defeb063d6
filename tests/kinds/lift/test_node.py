"""The node around the core: its messages, its log, and failures of its driver."""

import logging

import pytest

from bridges.kinds.lift.signals import DoorReading, LiftOutputs, LiftSample, Motion
from bridges.messages.definitions import LiftState, Time
from bridges.messages.stamps import in_seconds
from tests.kinds.lift.story import WALL, Building, Controller, Story

OPEN_AT_L1 = LiftSample("L1", DoorReading.OPEN, motion=Motion.STOPPED, agv=True)


def times(story: Story) -> list[float]:
    return [round(at, 2) for at, _ in story.told]


def test_states_come_each_second_and_are_never_caused_by_a_request() -> None:
    quiet, asked = Story(Building(OPEN_AT_L1)), Story(Building(OPEN_AT_L1))
    for story in (quiet, asked):
        story.run(1.0)
        story.asks("A", "L1")
        story.run(5.0)
        for i in range(100):
            if story is asked:
                story.asks(("A", "B")[i % 2], "L1")
            story.run(5.0 + 0.1 * (i + 1))
    assert times(asked) == times(quiet)
    assert times(quiet) == [0.0, 0.1, 1.0, *range(2, 16)]


def test_a_change_is_published_at_once_and_many_changes_ten_times_a_second() -> None:
    story = Story(Building(OPEN_AT_L1), scan_s=0.01, debounce={})
    story.run(1.55)
    story.building.set(level="L2", motion=Motion.UP)
    story.run(1.6)
    assert times(story)[-1] == 1.56
    for i in range(200):
        story.building.set(door=(DoorReading.OPEN, DoorReading.CLOSED)[i % 2])
        story.run(story.now + 0.01)
    assert 18 <= len([at for at in times(story) if at > 1.6]) <= 21
    gaps = [round(b - a, 2) for a, b in zip(times(story), times(story)[1:], strict=False)]
    assert min(gaps) >= 0.1


def test_a_change_that_is_over_before_its_state_is_due_is_not_published() -> None:
    story = Story(Building(OPEN_AT_L1), scan_s=0.01, debounce={})
    story.run(1.55)
    for door in (DoorReading.CLOSED, DoorReading.OPEN, DoorReading.CLOSED):
        story.building.set(door=door)
        story.run(story.now + 0.02)
    story.building.set(door=DoorReading.CLOSED)
    story.run(3.5)
    assert [state for at, state in story.states if at > 1.5] == ["AGV, closed at L1"]


def test_the_stamp_of_a_state_is_the_time_of_its_reading() -> None:
    story = Story(Building(OPEN_AT_L1))
    story.run(2.0)
    story.building.unreadable = "timeout"
    story.run(6.0)
    ages = [round(at - (in_seconds(state.lift_time) - WALL), 2) for at, state in story.told]
    assert ages == [0.0, 0.0, 0.0, 0.1, 1.0, 2.0, 3.0, 4.0]


def test_a_lift_that_was_never_read_is_offline_with_stamp_zero_and_nothing_is_written() -> None:
    building = Building(OPEN_AT_L1)
    building.unreadable = "no such chip"
    story = Story(building)
    story.run(3.0)
    assert {state for _, state in story.told} == {
        LiftState(
            lift_time=Time(),
            lift_name="Lift1",
            available_floors=("L1", "L2", "L3", "L4"),
            door_state=1,
            motion_state=3,
            available_modes=(1, 2),
            current_mode=4,
        )
    }
    assert story.node.ready
    assert building.writes == 1  # opening the driver switches all outputs off
    assert story.faults == ["INPUTS_NOT_FRESH"]


def test_no_open_door_is_shown_before_the_inputs_have_been_read() -> None:
    story = Story(Building(OPEN_AT_L1))
    story.run(1.0)
    assert story.states == [(0.0, "OFFLINE, moving at ?"), (0.1, "AGV, open at L1")]


def test_the_log_has_one_line_for_a_lost_device_and_one_for_its_return(
    caplog: pytest.LogCaptureFixture,
) -> None:
    story = Story(Building(OPEN_AT_L1))
    story.run(1.0)
    for broken in ("unreadable", "unwritable"):
        caplog.clear()
        with caplog.at_level(logging.INFO):
            setattr(story.building, broken, "timeout")
            story.run(story.now + 10.0)
            setattr(story.building, broken, "")
            story.run(story.now + 10.0)
        lines = [r.getMessage().split()[0] for r in caplog.records]
        assert (lines.count("device_lost"), lines.count("device_back")) == (1, 1)
        assert (lines.count("fault"), lines.count("fault_over")) == (1, 1)
        assert len(lines) == 6  # also the line with the state, after the loss and after the return


def test_a_new_daemon_that_finds_agv_mode_waits_for_a_request() -> None:
    story = Story(Controller())
    story.run(1.0)
    story.asks("A", "L1")
    story.run(5.0)
    story.node.close()
    story.restart()
    story.run(8.0)
    assert story.outputs == LiftOutputs()
    assert story.state == "HUMAN, closed at L1"
    assert story.edges[-2:] == [(5.0, "hold_door", None), (5.0, "agv_request", False)]


def test_outputs_are_made_safe_and_a_failure_to_do_so_is_logged() -> None:
    story = Story(Building(OPEN_AT_L1))
    story.run(1.0)
    story.asks("A", "L1")
    story.building.unwritable = "timeout"
    assert not story.node.make_safe()
    story.building.unwritable = ""
    assert story.node.make_safe()
    assert story.outputs == LiftOutputs()


def test_a_door_whose_open_state_could_not_be_published_has_let_nobody_in() -> None:
    heard, unheard = Story(Building(OPEN_AT_L1)), Story(Building(OPEN_AT_L1))
    unheard.deaf = True
    for story in (heard, unheard):
        story.run(1.0)
        story.asks("A", "L1")
        story.run(40.0)
    assert [story.node.status()["boarded"] for story in (heard, unheard)] == ["yes", "no"]
    assert heard.building.driven.hold_door is not None
    assert unheard.building.driven == LiftOutputs()
    unheard.deaf = False
    unheard.asks("A", "L1")
    unheard.run(45.0)
    assert unheard.node.status()["boarded"] == "yes"
