"""Events that come too late: AGV mode, the car, the open door, RMF's next request, and reads or writes
of the driver."""

from itertools import pairwise

import pytest
from msgspec.structs import replace

from bridges.kinds.lift.signals import (
    DoorReading,
    LiftOutputs,
    LiftSample,
    Motion,
    Side,
)
from bridges.kinds.shared.decision import (
    Fault,
    OperatorReset,
    WriteFailed,
)
from bridges.messages.stamps import in_seconds
from tests.kinds.lift.alone import ASKED, AT_L1, CLOSED, Alone
from tests.kinds.lift.story import WALL, Building, Controller, Story

HELD = LiftOutputs(agv_request=True, hold_door=Side.FRONT)
OFF = LiftOutputs()


def lift(level: str, door: DoorReading, *, agv: bool, **limits: object) -> Story:
    """Return a story in which robot A requests L1 at 1 s and the car stands still. The lift is scanned
    twice a second."""
    building = Building(LiftSample(level, door, motion=Motion.STOPPED, agv=agv))
    story = Story(building, scan_s=0.5, **limits)  # type: ignore[arg-type]
    story.run(1.0)
    story.asks("A", "L1")
    return story


def keep_asking(story: Story, until: float) -> None:
    """Repeat RMF's request from now until the time `until`."""
    while story.now < until:
        story.asks("A", "L1")
        story.run(min(until, story.now + 5.0))


def tries(story: Story, output: str) -> list[float]:
    """Return the times at which an output was switched on."""
    return [at for at, name, value in story.edges if name == output and value]


CASES = [
    (
        "AGV_MODE_NOT_GRANTED",
        ("L2", DoorReading.CLOSED, False),
        "agv_timeout_s",
        600.0,
        "agv_request",
    ),
    ("RUNTIME_LIMIT_EXCEEDED", ("L2", DoorReading.CLOSED, True), "floor_timeout_s", 120.0, "call"),
    ("DOOR_OPENING_FAULT", ("L1", DoorReading.CLOSED, True), "door_timeout_s", 10.0, "hold_door"),
]


# ---- LIFT-DRIVE-5: AGV mode, the floor and the open door


@pytest.mark.parametrize(("fault", "inputs", "limit", "default_s", "output"), CASES)
def test_a_step_that_times_out_is_a_fault_with_outputs_off(
    fault: str, inputs: tuple[str, DoorReading, bool], limit: str, default_s: float, output: str
) -> None:
    story = lift(inputs[0], inputs[1], agv=inputs[2])
    keep_asking(story, 1.0 + default_s - 0.5)
    assert story.faults == []
    assert tries(story, output) == [1.0]
    keep_asking(story, 1.0 + default_s)
    assert story.faults == [fault]
    assert story.outputs == OFF
    assert story.told[-1][1].session_id == "A"


@pytest.mark.parametrize(("fault", "inputs", "limit", "default_s", "output"), CASES)
def test_a_failed_step_is_tried_three_times_more_and_then_latched(
    fault: str, inputs: tuple[str, DoorReading, bool], limit: str, default_s: float, output: str
) -> None:
    story = lift(inputs[0], inputs[1], agv=inputs[2], **{limit: 4.0})
    keep_asking(story, 500.0)
    assert tries(story, output) == [1.0, 15.0, 49.0, 113.0]
    offs = [at for at, name, value in story.edges if name == output and not value]
    assert offs == [5.0, 19.0, 53.0, 117.0]
    assert (story.faults, story.outputs) == ([fault], OFF)


def latched() -> Story:
    """Return a story in which the door at L1 has not opened in four tries."""
    story = lift("L1", DoorReading.CLOSED, agv=True, door_timeout_s=4.0)
    keep_asking(story, 200.0)
    assert (story.faults, story.outputs) == (["DOOR_OPENING_FAULT"], OFF)
    return story


def test_a_latched_fault_ends_with_the_session() -> None:
    story = latched()
    story.ends("A")
    assert story.faults == []
    story.asks("B", "L1")
    assert story.outputs == HELD


def test_a_latched_fault_ends_with_an_end_even_if_the_session_returns_at_once() -> None:
    """An operator ends the session. Within a second the fleet adapter repeats its request for this
    session."""
    story = lift("L1", DoorReading.OPEN, agv=True, door_timeout_s=4.0)
    story.run(3.0)
    story.building.set(door=DoorReading.CLOSED)
    keep_asking(story, 200.0)
    assert (story.faults, story.outputs) == (["DOOR_OPENING_FAULT"], OFF)
    story.ends("A")
    story.run(200.5)
    story.asks("A", "L1")
    assert (story.faults, story.outputs) == ([], HELD)
    story.building.set(agv=False, door=DoorReading.OPEN)  # the robot is inside, so it may see OPEN
    story.run(202.0)
    assert story.state == "HUMAN, open at L1, A to L1"


def goes(story: Story, level: str) -> None:
    """Let the car go up to the next floor within two seconds."""
    for inputs in ({"level": None, "motion": Motion.UP}, {"level": level}):
        story.building.set(**inputs)
        story.run(story.now + 1.0)
    story.building.set(motion=Motion.STOPPED)


def test_between_two_tries_the_robot_inside_is_shown_no_open_door_that_nobody_holds() -> None:
    """A fault stops the car at L2, and a person takes it to L3 in the pause before the next try."""
    story = lift("L1", DoorReading.OPEN, agv=True, floor_timeout_s=4.0)
    keep_asking(story, 3.0)
    story.asks("A", "L3")
    story.building.set(door=DoorReading.CLOSED)
    goes(story, "L2")
    story.run(8.0)
    assert (story.faults, story.outputs) == (["RUNTIME_LIMIT_EXCEEDED"], OFF)
    goes(story, "L3")
    story.building.set(door=DoorReading.OPEN, agv=False)
    story.run(16.5)
    assert story.state == "HUMAN, moving at L3, A to L3"
    story.building.set(agv=True)
    story.run(18.0)
    assert (story.state, story.outputs) == ("AGV, open at L3, A to L3", HELD)


def test_after_the_last_try_the_robot_inside_is_shown_the_door_as_it_is() -> None:
    story = lift("L1", DoorReading.OPEN, agv=True, door_timeout_s=4.0)
    keep_asking(story, 3.0)
    story.building.set(door=DoorReading.CLOSED)
    keep_asking(story, 200.0)
    assert (story.faults, story.outputs) == (["DOOR_OPENING_FAULT"], OFF)
    story.building.set(door=DoorReading.OPEN)
    story.run(201.0)
    assert story.state == "AGV, open at L1, A to L1"


def test_a_latched_fault_ends_with_another_destination() -> None:
    story = latched()
    story.asks("A", "L3")
    assert (story.faults, story.outputs) == ([], LiftOutputs(agv_request=True, call="L3"))


def test_a_latched_fault_ends_with_an_operators_reset() -> None:
    story = latched()
    story.resets()
    assert (story.faults, story.outputs) == ([], HELD)
    keep_asking(story, 215.0)
    assert tries(story, "hold_door")[-2:] == [200.0, 214.0]


def test_a_reset_during_a_retry_lets_the_request_wait_for_agv_mode_again() -> None:
    def history(reset_at: float) -> list[tuple[float, bool, list[str]]]:
        """Return (s, whether AGV mode is requested, faults) for each change. The lift is scanned twice
        a second."""
        alone = Alone(agv_timeout_s=5.0)
        alone(0.0, replace(CLOSED, agv=False), ASKED)
        shown: list[tuple[float, bool, list[str]]] = []
        for n in range(1, 60):
            now = n / 2
            alone(now, replace(CLOSED, agv=False), *[OperatorReset()] * (now == reset_at))
            line = (alone.decision.outputs.agv_request, [fault.code for fault in alone.faults])
            if not shown or shown[-1][1:] != line:
                shown.append((now, *line))
        return shown

    failed = "AGV_MODE_NOT_GRANTED"
    before = [(0.5, True, []), (5.0, False, [failed]), (15.0, True, [failed])]
    assert history(reset_at=99.0) == [*before, (20.0, False, [failed])]
    assert history(reset_at=17.0) == [*before, (17.0, True, []), (22.0, False, [failed])]


def test_during_a_fault_an_open_door_is_not_offered() -> None:
    story = latched()
    story.building.set(door=DoorReading.OPEN)
    keep_asking(story, 210.0)
    assert story.state == "AGV, moving at L1, A to L1"


def test_a_later_try_that_succeeds_ends_the_fault_and_resets_the_count() -> None:
    story = lift("L1", DoorReading.CLOSED, agv=True, door_timeout_s=4.0)
    keep_asking(story, 16.0)
    assert story.faults == ["DOOR_OPENING_FAULT"]
    story.building.set(door=DoorReading.OPEN)
    keep_asking(story, 17.0)
    assert (story.faults, story.state) == ([], "AGV, open at L1, A to L1")
    story.building.set(door=DoorReading.CLOSED)
    keep_asking(story, 200.0)
    starts = tries(story, "hold_door")
    assert [round(b - a, 1) for a, b in pairwise(starts[2:])] == [34.0, 64.0]


def test_the_core_wakes_at_the_end_of_a_wait_for_the_lift() -> None:
    alone = Alone(stale_after_s=900.0, request_timeout_s=30.0, door_timeout_s=4.0)
    alone(0.0, CLOSED)(1.0, ASKED)
    assert alone.decision.outputs == LiftOutputs(agv_request=True, hold_door=Side.FRONT)
    assert alone(1.0, CLOSED).decision.wake_at == 5.0


def test_agv_mode_that_is_lost_on_the_way_is_requested_again() -> None:
    story = Story(Building(LiftSample("L2", DoorReading.CLOSED, motion=Motion.STOPPED, agv=True)))
    story.run(1.0)
    story.asks("A", "L1")
    story.run(2.0)
    story.building.set(agv=False)
    story.run(3.0)
    assert story.edges == [
        (1.0, "agv_request", True),
        (1.0, "call", "L1"),
        (2.1, "call", None),
        (2.1, "agv_request", False),
    ]
    assert (story.state, story.faults) == ("HUMAN, closed at L2, A to L1", ["AGV_MODE_LOST"])
    story.run(13.0)
    assert story.edges[4:] == [(12.1, "agv_request", True)]
    story.building.set(agv=True)
    story.run(14.0)
    assert story.outputs == LiftOutputs(agv_request=True, call="L1")


def test_agv_mode_lost_with_the_robot_at_the_open_door_shows_the_true_door() -> None:
    story = lift("L1", DoorReading.OPEN, agv=True)
    story.run(5.0)
    story.building.set(agv=False)
    story.run(6.0)
    assert (story.faults, story.outputs) == (["AGV_MODE_LOST"], OFF)
    assert story.state == "HUMAN, open at L1, A to L1"


def test_the_call_stays_on_while_people_take_the_car_first() -> None:
    """Without a status line for AGV mode, people may take the car before the robot."""
    building = Building(LiftSample("L2", DoorReading.CLOSED, motion=Motion.STOPPED, agv=None))
    story = Story(building)
    story.run(1.0)
    story.asks("A", "L1")
    building.set(level=None, motion=Motion.UP)
    story.run(3.0)
    building.set(level="L4", motion=Motion.STOPPED, door=DoorReading.OPEN)
    story.run(6.0)
    assert story.state == "AGV, open at L4, A to L1"
    assert story.outputs == LiftOutputs(agv_request=True, call="L1")
    building.set(level=None, motion=Motion.DOWN, door=DoorReading.CLOSED)
    story.run(9.0)
    building.set(level="L1", motion=Motion.STOPPED)
    story.run(10.0)
    assert story.outputs == HELD
    building.set(level=None, motion=Motion.UP)  # people take the car before the robot enters
    story.run(12.0)
    assert story.outputs == LiftOutputs(agv_request=True)
    building.set(level="L2", motion=Motion.STOPPED)
    story.run(13.0)
    assert story.outputs == LiftOutputs(agv_request=True, call="L1")
    assert story.faults == []


# ---- LIFT-DRIVE-1: a silent RMF


def test_if_rmf_is_silent_with_the_robot_outside_the_session_stays_without_outputs() -> None:
    story = lift("L1", DoorReading.CLOSED, agv=True, door_timeout_s=600)
    story.run(30.5)
    assert story.outputs == HELD
    story.run(31.0)
    assert (story.outputs, story.faults) == (OFF, ["RMF_SILENT"])
    story.building.set(agv=False)
    story.run(100.0)
    assert story.state == "HUMAN, closed at L1, A to L1"
    assert story.faults == ["RMF_SILENT"]
    story.asks("A", "L1")
    assert (story.outputs, story.faults) == (LiftOutputs(agv_request=True), [])
    story.building.set(agv=True)
    story.run(101.0)
    assert (story.outputs, story.faults) == (HELD, [])


def test_if_rmf_is_silent_with_a_robot_inside_the_outputs_stay_on_with_a_warning() -> None:
    story = lift("L1", DoorReading.OPEN, agv=True)
    story.run(300.0)
    assert (story.outputs, story.faults) == (HELD, ["RMF_SILENT"])
    assert story.state == "AGV, open at L1, A to L1"
    story.asks("A", "L1")
    assert story.faults == []


def test_the_core_wakes_for_a_silence_of_rmf_and_for_the_next_try() -> None:
    alone = Alone(stale_after_s=900.0, request_timeout_s=30.0)(0.0, AT_L1)(1.0, ASKED, AT_L1)
    assert alone.decision.wake_at == 31.0
    alone = Alone(stale_after_s=900.0, request_timeout_s=30.0, door_timeout_s=4.0)
    alone(0.0, CLOSED)(1.0, ASKED)(5.0, CLOSED, CLOSED)
    assert alone.decision.outputs == LiftOutputs()
    assert alone.decision.wake_at == 15.0


# ---- LIFT-4, LIFT-5: outputs that cannot be written


def test_no_open_is_shown_before_the_hold_is_written() -> None:
    story = Story(Building(LiftSample("L1", DoorReading.OPEN, motion=Motion.STOPPED, agv=True)))
    story.run(1.0)
    story.building.unwritable = "the gateway refuses the command"
    story.asks("A", "L1")
    story.run(1.9)
    assert story.state == "AGV, moving at L1, A to L1"
    why = "for its outputs to be written: the gateway refuses the command"
    assert story.node.status()["waits"] == why
    story.run(4.0)
    assert not any("open at L1, A" in state for _, state in story.states)
    assert story.node.status()["boarded"] == "no"
    story.building.unwritable = ""
    story.run(5.0)
    assert (story.state, story.outputs) == ("AGV, open at L1, A to L1", HELD)


def test_a_held_door_stays_shown_open_while_a_write_fails() -> None:
    story = lift("L1", DoorReading.OPEN, agv=True)
    story.run(5.0)
    states = list(story.states)
    story.building.unwritable = "no reply"
    story.run(5.5)
    story.building.unwritable = ""
    story.run(7.0)
    assert (story.states, story.outputs) == (states, HELD)


def test_outputs_that_cannot_be_written_cause_a_fault_and_all_outputs_off() -> None:
    story = lift("L1", DoorReading.OPEN, agv=True)
    story.run(5.0)
    story.building.unwritable = "no answer from the relay module"
    story.run(6.0)
    assert story.faults == []
    story.run(6.5)
    assert story.node.status()["faults"] == [
        {"code": "OUTPUTS_NOT_WRITTEN", "detail": "no answer from the relay module"}
    ]
    assert story.node.status()["outputs"] == "-"
    assert story.state == "OFFLINE, open at L1, A to L1"
    writes = story.building.writes
    story.run(10.0)
    assert story.building.writes >= writes + 6
    story.building.unwritable = ""
    story.run(11.0)
    assert story.edges[2:4] == [(10.5, "hold_door", None), (10.5, "agv_request", False)]
    story.run(13.0)
    assert (story.outputs, story.faults) == (HELD, [])


def test_a_failed_write_is_repaired_by_the_next_one() -> None:
    story = lift("L1", DoorReading.OPEN, agv=True)
    story.run(5.0)
    for _ in range(10):
        story.building.unwritable = "timeout"
        story.run(story.now + 0.5)
        story.building.unwritable = ""
        story.run(story.now + 0.5)
    assert story.edges == [(1.0, "agv_request", True), (1.0, "hold_door", "front")]
    assert story.faults == []


def test_inputs_are_believed_even_if_outputs_cannot_be_written() -> None:
    story = Story(Controller())
    story.run(1.0)
    story.asks("A", "L1")
    story.until(lambda: story.state == "AGV, open at L1, A to L1")
    story.building.unwritable = "timeout"
    story.building.driven = OFF  # the watchdog of the module has switched the relays off
    story.run(story.now + 5.0)
    assert story.state == "OFFLINE, closed at L1, A to L1"


def test_a_write_that_succeeds_again_leaves_no_fault_without_its_reason() -> None:
    """The fault lasts until the next reading. Until then the report must also keep the fault's text."""
    alone = Alone(stale_after_s=2.0)(0.0, AT_L1, WriteFailed("timeout"))
    alone(1.0, AT_L1, WriteFailed("timeout"))(2.5, AT_L1)
    assert alone.decision.report.faults == (Fault("OUTPUTS_NOT_WRITTEN", "timeout"),)
    assert alone(3.0, AT_L1).decision.report.faults == ()


def test_at_a_request_unwritten_outputs_are_judged_by_their_age() -> None:
    alone = Alone(stale_after_s=2.0)(0.0, AT_L1, WriteFailed("timeout"))
    assert alone(1.0, ASKED).decision.refused == ""
    alone = Alone(stale_after_s=2.0)(0.0, AT_L1, WriteFailed("timeout"))
    alone(1.9, AT_L1, WriteFailed("timeout"))
    assert alone(2.0, ASKED).decision.refused == "OUTPUTS_NOT_WRITTEN"


@pytest.mark.parametrize("step_s", [3600.0, -3600.0])
def test_a_jump_of_the_wall_clock_changes_neither_timeouts_nor_ages(step_s: float) -> None:
    straight, jumped = (
        lift("L1", DoorReading.CLOSED, agv=True, door_timeout_s=4.0),
        lift("L1", DoorReading.CLOSED, agv=True, door_timeout_s=4.0),
    )
    for story in (straight, jumped):
        story.run(3.0)
        story.wall_step_s = step_s if story is jumped else 0.0
        story.run(29.0)
    assert jumped.edges == straight.edges
    assert jumped.states == straight.states
    stamps = [in_seconds(state.lift_time) - WALL for at, state in jumped.told if at > 3.0]
    assert stamps == pytest.approx([at + step_s for at, _ in jumped.told if at > 3.0])
