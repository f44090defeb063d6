"""When the core trusts its inputs. The inputs are broken, contradictory, old, unsteady, or from a
moving car."""

import pytest
from msgspec.structs import replace

from bridges.kinds.lift.core import decide, repeated
from bridges.kinds.lift.memory import LiftMemory
from bridges.kinds.lift.signals import (
    DoorReading,
    Hazard,
    LiftOutputs,
    LiftRequested,
    LiftSample,
    Motion,
)
from bridges.kinds.shared.decision import (
    Fault,
    IoFailed,
    Sampled,
    Suspended,
)
from bridges.messages.definitions import LiftMode, LiftMotion
from bridges.messages.stamps import in_seconds
from tests.kinds.lift.alone import AT_L1, DEBOUNCE, Alone
from tests.kinds.lift.story import OPEN_AT_L1, SCAN_S, WALL, Building, Story, boarding

# ---- LIFT-5: the open door, and inputs that contradict it


def test_an_open_door_is_offered_when_every_input_confirms_it() -> None:
    assert boarding().state == "AGV, open at L1, A to L1"


@pytest.mark.parametrize(
    ("inputs", "state", "faults"),
    [
        ({"door": DoorReading.BOTH}, "AGV, moving at L1", ["DOOR_CONTACTS_CONTRADICT"]),
        ({"door": DoorReading.UNKNOWN}, "AGV, moving at L1", ["DOOR_CODE_ILLEGAL"]),
        ({"door": DoorReading.BETWEEN}, "AGV, moving at L1", []),
        ({"door": DoorReading.NOT_OPEN}, "AGV, moving at L1", []),
        ({"level": None}, "AGV, moving at ?", []),
        (
            {"level": None, "code_fault": "the lines of L1 and L3 are on at once"},
            "AGV, moving at ?",
            ["FLOOR_CODE_ILLEGAL"],
        ),
        (
            {"level": None, "code_fault": "code 7 is not a floor's"},
            "AGV, moving at ?",
            ["FLOOR_CODE_ILLEGAL"],
        ),
        ({"motion": Motion.UP}, "AGV, moving at L1", []),
        ({"motion": Motion.DOWN}, "AGV, moving at L1", []),
        ({"motion": Motion.MOVING}, "AGV, moving at L1", []),
        ({"motion": Motion.CONTRADICTORY}, "AGV, moving at L1", ["MOTION_CONTRADICTORY"]),
        ({"agv": False}, "HUMAN, moving at L1", []),
    ],
)
def test_an_open_door_is_not_offered_against_one_contradicting_input(
    inputs: dict[str, object], state: str, faults: list[str]
) -> None:
    story = boarding(**inputs)
    assert story.state == f"{state}, A to L1"
    assert story.faults == faults


# ---- LIFT-SENSING-6: whether the car stands


@pytest.mark.parametrize(
    ("motion", "told"),
    [
        (Motion.UP, LiftMotion.MOTION_UP),
        (Motion.DOWN, LiftMotion.MOTION_DOWN),
        (Motion.STOPPED, LiftMotion.MOTION_STOPPED),
        (Motion.MOVING, LiftMotion.MOTION_UNKNOWN),
        (Motion.CONTRADICTORY, LiftMotion.MOTION_UNKNOWN),
    ],
)
def test_motion_is_read_from_the_motion_lines(motion: Motion, told: LiftMotion) -> None:
    assert boarding(motion=motion).motions[-1] is told


# ---- LIFT-SENSING-1: debounce


def test_glitches_of_a_door_contact_on_the_way_never_read_as_open() -> None:
    building = Building(replace(OPEN_AT_L1, door=DoorReading.CLOSED))
    story = Story(building)
    story.run(1.0)
    story.asks("A", "L3")
    for level in (None, "L2", None):
        building.set(level=level, motion=Motion.UP)
        story.run(story.now + 0.5)
        building.set(door=DoorReading.OPEN)
        story.run(story.now + 0.05)
        building.set(door=DoorReading.CLOSED)
        story.run(story.now + 0.5)
    assert [state for _, state in story.states if "open" in state] == []
    assert [edge for edge in story.edges if edge[1] == "hold_door"] == []


def test_a_short_door_contact_glitch_at_the_destination_does_not_read_as_an_open_door() -> None:
    story = boarding(door=DoorReading.CLOSED)
    story.run(2.01)
    story.building.set(door=DoorReading.OPEN)
    story._scan()
    story.run(2.03)
    story.building.set(door=DoorReading.CLOSED)
    story.run(4.0)
    assert [state for _, state in story.states if "open" in state] == []


def test_an_open_contact_while_the_car_moves_reads_as_a_moving_door() -> None:
    story = boarding(motion=Motion.UP)
    story.run(5.0)
    assert story.state == "AGV, moving at L1, A to L1"
    assert story.edges == [(1.0, "agv_request", True), (1.0, "call", "L1")]


# ---- LIFT-SENSING-4: lines that are valid only in AGV mode


def test_lines_that_are_valid_only_in_agv_mode_are_believed_in_agv_mode() -> None:
    building = Building(LiftSample(None, DoorReading.BETWEEN, motion=None, agv=False))
    story = Story(building)
    story.run(1.0)
    for floor in ("L1", "L3"):
        story.asks("A", floor)
        story.run(story.now + 1.0)
        building.set(agv=True, level=floor, door=DoorReading.OPEN, motion=Motion.STOPPED)
        story.run(story.now + 1.0)
        assert story.state == f"AGV, open at {floor}, A to {floor}"
        story.ends("A")
        story.run(story.now + 3.0)
        building.set(agv=False, level=None, door=DoorReading.BETWEEN, motion=None)
        story.run(story.now + 9.0)
        assert story.state == "HUMAN, moving at ?"
    assert story.edges == [
        (1.0, "agv_request", True),
        (2.13, "hold_door", "front"),
        (5.7, "hold_door", None),
        (6.0, "agv_request", False),
        (15.0, "agv_request", True),
        (16.13, "hold_door", "front"),
        (19.7, "hold_door", None),
        (20.0, "agv_request", False),
    ]


def test_a_code_that_becomes_valid_just_after_a_ride_may_still_change() -> None:
    moving = LiftSample(None, DoorReading.CLOSED, motion=Motion.UP, agv=True, floor_valid=False)
    story = Story(Building(moving))
    story.run(1.0)
    story.building.set(level="L1", motion=Motion.STOPPED, floor_valid=True)
    story.run(1.5)
    assert story.state == "AGV, closed at L1"
    story.building.set(level="L2")
    story.run(2.0)
    assert (story.state, story.faults) == ("AGV, closed at L2", [])


def test_a_movement_counts_at_once_after_invalid_motion_lines() -> None:
    building = Building(LiftSample("L1", DoorReading.OPEN, motion=None, agv=True))
    story = Story(building, debounce={"motion": 5.0})
    story.run(7.0)
    building.set(motion=Motion.UP)
    story.run(8.0)
    assert story.state == "AGV, moving at L1"


# ---- LIFT-SENSING-2, LIFT-4: gaps between readings


def test_one_missed_reading_changes_nothing() -> None:
    for inputs in ({}, {"motion": None, "agv": None}):
        story = boarding(**inputs)
        edges, states = list(story.edges), list(story.states)
        story.building.unreadable = "timeout"
        story.run(2.5)
        story.building.unreadable = ""
        story.run(4.0)
        assert (story.edges, story.states) == (edges, states)


def test_without_readings_the_lift_is_offline_with_outputs_off_and_still_publishes_states() -> None:
    story = boarding()
    story.building.unreadable = "no answer from 10.0.0.7"
    story.run(12.0)
    assert story.edges[2:] == [(3.0, "hold_door", None), (3.0, "agv_request", False)]
    assert story.states[-1] == (3.0, "OFFLINE, moving at ?, A to L1")
    offline = [state for at, state in story.told if at >= 3.0]
    assert len(offline) == 10
    assert {in_seconds(state.lift_time) for state in offline} == {WALL + 2.0}
    assert story.node.status()["faults"] == [
        {"code": "INPUTS_NOT_FRESH", "detail": "no answer from 10.0.0.7"}
    ]


def test_a_reading_stops_counting_exactly_at_its_greatest_age() -> None:
    burning = replace(AT_L1, door=DoorReading.BOTH, hazards=frozenset({Hazard.EMERGENCY}))
    alone = Alone(stale_after_s=2.0)(0.0, burning)(2.0, IoFailed("timeout"))
    assert alone.faults == (Fault("INPUTS_NOT_FRESH", "timeout"),)


def test_a_reading_at_the_end_of_the_last_reading_starts_afresh() -> None:
    alone = Alone(DEBOUNCE)(0.0, AT_L1)(0.5, AT_L1)(1.5, AT_L1)
    shown = alone.decision.report
    assert (shown.mode, shown.floor, alone.faults) == (LiftMode.MODE_OFFLINE, "", ())
    alone(1.6, AT_L1)
    assert alone.decision.report.floor == "L1"


def test_after_a_sleep_only_the_last_landing_is_remembered() -> None:
    alone = Alone()(0.0, AT_L1)(1.0, AT_L1)(2.0, Suspended("the machine slept"))
    assert alone.decision.refused == ""
    assert alone.faults == (Fault("INPUTS_NOT_FRESH", "the machine slept"),)
    position = alone.memory.senses.position
    assert (position.trusted, position.moved_at) == ("L1", 2.0)
    assert alone.memory.senses == type(alone.memory.senses)(position=position)


@pytest.mark.parametrize(
    "inputs", [{}, {"motion": Motion.UP}, {"motion": Motion.UP, "level": None}]
)
def test_a_repeated_reading_changes_the_memory_as_a_decision_would(
    inputs: dict[str, object],
) -> None:
    sample = replace(AT_L1, **inputs)
    alone = Alone()(0.0, AT_L1)(0.5, sample)(1.0, sample)
    noted = repeated(alone.memory, 1.4)
    assert noted == alone(1.4, sample).memory


def test_the_lift_recovers_with_its_readings() -> None:
    story = boarding()
    story.building.unreadable = "no answer"
    story.run(12.0)
    story.building.unreadable = ""
    story.run(14.0)
    assert story.state == "AGV, open at L1, A to L1"
    assert story.outputs == LiftOutputs(agv_request=True, hold_door=boarding().outputs.hold_door)
    assert story.faults == []


def test_after_a_loss_of_readings_nothing_is_believed_from_before() -> None:
    story = boarding()
    story.building.unreadable = "no answer"
    story.run(12.0)
    told = len(story.told)
    story.building.unreadable = ""
    story.building.set(level="L3", door=DoorReading.CLOSED)
    story.run(14.0)
    back = [state for at, state in story.states if at >= 12.0]
    assert back == ["AGV, closed at L3, A to L1"]
    assert all(state.door_state != 2 for _, state in story.told[told:])
    assert story.faults == []


def test_an_impossible_floor_code_stays_doubted_after_a_loss_of_readings() -> None:
    story = boarding()
    story.building.set(level="L3")
    story.run(3.0)
    story.building.unreadable = "no answer"
    story.run(6.0)
    assert story.faults == ["INPUTS_NOT_FRESH"]
    story.building.unreadable = ""
    story.run(8.0)
    assert story.faults == ["POSITION_LOST"]


def test_a_car_that_was_not_read_for_a_while_may_have_moved() -> None:
    story = boarding()
    story.run(9.0)
    story.building.set(level="L3")
    story.now = 19.0  # the loop was blocked until now
    story.run(20.0)
    assert (story.faults, story.state) == ([], "AGV, open at L3, A to L1")


def test_a_floor_that_was_reached_in_a_short_gap_is_believed() -> None:
    story = boarding()
    story.run(9.0)
    story.building.unreadable = "timeout"
    story.run(9.9)
    story.building.unreadable = ""
    story.building.set(level="L2")
    story.run(11.0)
    assert (story.faults, story.state) == ([], "AGV, open at L2, A to L1")


def test_a_glitch_with_a_gap_in_its_middle_changes_nothing() -> None:
    story = boarding(door=DoorReading.CLOSED)
    story.building.set(door=DoorReading.OPEN)
    story._scan()
    story.building.unreadable = "timeout"
    story.run(2.5)
    story.building.unreadable = ""
    story.run(2.51)
    story.building.set(door=DoorReading.CLOSED)
    story.run(4.0)
    assert [state for _, state in story.states if "open" in state] == []


# ---- LIFT-SENSING-1: unsteady inputs


def test_an_input_that_never_settles_is_not_believed() -> None:
    story = boarding()
    story.building.unreadable = "timeout"
    story.run(2.05)
    story.building.unreadable = ""
    for i in range(100):
        story.building.set(level=("L1", "L2")[i % 2])
        story.run(2.05 + 0.05 * (i + 1))
    assert story.states[-1] == (4.23, "OFFLINE, moving at ?, A to L1")
    assert story.outputs == LiftOutputs()
    assert story.node.status()["faults"] == [
        {"code": "INPUTS_NOT_FRESH", "detail": "not steady: floor"}
    ]
    story.building.set(level="L1")
    story.run(8.0)
    assert (story.faults, story.state) == ([], "AGV, open at L1, A to L1")


TOWER = [f"L{n}" for n in range(1, 13)]


def riding_past_a_floor_in_each_reading() -> Story:
    """Return a story of a car on its way to L12. It shows each floor for less than the debounce of the
    floor code. The last reading shows L9."""
    closed = replace(OPEN_AT_L1, door=DoorReading.CLOSED)
    story = Story(Building(closed), floors=TOWER, debounce={"floor": 1.0})
    story.run(2.0)
    story.asks("A", "L12")
    story.building.set(motion=Motion.UP)
    for level in TOWER[1:9]:
        story.building.set(level=level)
        story.run(story.now + 0.9)
    return story


def test_a_fast_car_that_is_read_slowly_is_at_an_unknown_floor_but_not_offline() -> None:
    story = riding_past_a_floor_in_each_reading()
    assert (story.state, story.faults) == ("AGV, closed at ?, A to L12", [])
    assert story.outputs == LiftOutputs(agv_request=True, call="L12")
    story.building.set(level="L12")
    story.run(story.now + 0.5)
    story.building.set(motion=Motion.STOPPED)
    story.run(story.now + 3.0)
    assert not any("OFFLINE" in state for at, state in story.states if at > 1.5)
    assert (story.state, story.faults) == ("AGV, closed at L12, A to L12", [])
    assert len([edge for edge in story.edges if edge[1] == "call"]) == 2


def test_a_floor_code_that_keeps_changing_in_a_standing_car_is_not_believed() -> None:
    story = riding_past_a_floor_in_each_reading()
    story.building.set(motion=Motion.STOPPED)
    for level in ("L9", "L8") * 3:
        story.building.set(level=level)
        story.run(story.now + 0.9)
    assert story.state == "OFFLINE, moving at ?, A to L12"
    assert story.outputs == LiftOutputs()


def test_after_the_car_has_stopped_its_floor_code_has_its_debounce_and_2_s_to_settle() -> None:
    """LIFT-SENSING-1."""
    story = riding_past_a_floor_in_each_reading()
    story.building.set(motion=Motion.STOPPED)
    stopped_at = story.now
    seen = []
    for n in range(7):
        story.building.set(level=("L8", "L9")[n % 2])
        story.run(stopped_at + 0.5 * (n + 1))
        seen.append(story.state.partition(",")[0])
    assert seen == [*["AGV"] * 6, "OFFLINE"]


def test_a_door_contact_that_chatters_on_the_way_takes_every_input() -> None:
    """LIFT-SENSING-1: only a floor code may keep changing in a car that moves."""
    closed = replace(OPEN_AT_L1, door=DoorReading.CLOSED)
    story = Story(Building(closed))
    story.run(1.0)
    story.asks("A", "L3")
    story.building.set(motion=Motion.UP, level=None)
    for n in range(150):
        story.building.set(door=(DoorReading.BETWEEN, DoorReading.CLOSED)[n % 2])
        story.run(1.0 + 0.02 * (n + 1))
        story._scan()
    assert (story.state, story.outputs) == ("OFFLINE, moving at ?, A to L3", LiftOutputs())


def test_a_fire_loop_that_chatters_takes_the_lift_away() -> None:
    story = boarding()
    for i in range(100):
        story.building.hazard(*((Hazard.FIRE,) if i % 2 else ()))
        story.run(2.0 + 0.05 * (i + 1))
    assert story.outputs == LiftOutputs()
    assert story.state == "OFFLINE, moving at ?, A to L1"


def test_a_door_that_never_settles_at_the_start_is_never_believed_and_soon_a_fault() -> None:
    story = Story(Building(OPEN_AT_L1))
    for i in range(150):
        story.building.set(door=(DoorReading.OPEN, DoorReading.CLOSED)[i % 2])
        story.run(0.02 * (i + 1))
        story._scan()
        assert story.faults == ([] if story.now < 2.03 else ["INPUTS_NOT_FRESH"])
    assert [state for _, state in story.states] == ["OFFLINE, moving at ?"]
    assert story.node.status()["faults"][0]["detail"] == "not steady: door"
    story.asks("A", "L1")
    assert story.node.refused == {"INPUTS_NOT_FRESH": 1}


def test_a_gap_before_the_inputs_have_settled_restarts_their_debounce() -> None:
    story = Story(Building(OPEN_AT_L1))
    story.building.unreadable = "timeout"
    story.run(0.02)
    story._scan()
    assert story.faults == ["INPUTS_NOT_FRESH"]
    story.building.unreadable = ""
    story.run(1.0)
    assert (story.faults, story.states[1:]) == ([], [(0.11, "AGV, open at L1")])


def test_a_lift_that_never_settles_behind_a_flaky_bus_has_a_lasting_fault() -> None:
    story, told = Story(Building(OPEN_AT_L1)), set()
    for scan in range(100):
        story.building.unreadable = "timeout" if scan % 2 else ""
        story._scan()
        story.now += SCAN_S
        if story.now > 2.5:
            decision = story.node.subject.decision
            assert decision is not None
            told.add(decision.report.faults)
    [(fault,)] = told
    assert str(fault).startswith("INPUTS_NOT_FRESH: not steady: floor, door, ")


def test_without_any_debounce_the_first_reading_counts() -> None:
    story = Story(Building(OPEN_AT_L1), debounce={})
    assert story.states == [(0.0, "AGV, open at L1")]
    story.asks("A", "L1")
    assert story.edges == [(0.0, "agv_request", True), (0.0, "hold_door", "front")]


# ---- LIFT-SENSING-5: doors with one contact


def test_a_contact_for_open_does_not_prove_closed() -> None:
    story = Story(Building(replace(OPEN_AT_L1, door=DoorReading.NOT_OPEN)), door_travel_s=4.0)
    story.run(3.0)
    assert story.state == "AGV, moving at L1"
    story.run(5.0)
    assert story.state == "AGV, closed at L1"
    assert story.node.status()["door"] == "closed (estimated)"
    story.building.set(door=DoorReading.OPEN)
    story.run(6.0)
    assert story.node.status()["door"] == "open"
    story.building.set(door=DoorReading.NOT_OPEN)
    story.run(12.0)
    assert [state for _, state in story.states[-3:]] == [
        "AGV, open at L1",
        "AGV, moving at L1",
        "AGV, closed at L1",
    ]
    assert [round(at, 1) for at, _ in story.states[-3:]] == [5.1, 6.1, 10.1]


def test_with_only_a_closed_contact_an_open_door_is_estimated_and_marked() -> None:
    story = Story(Building(replace(OPEN_AT_L1, door=DoorReading.CLOSED)), door_travel_s=4.0)
    story.run(1.0)
    story.asks("A", "L1")
    story.building.set(door=DoorReading.NOT_CLOSED)
    story.run(7.0)
    assert story.states[-1][1] == "AGV, open at L1, A to L1"
    assert story.states[-1][0] == 5.0
    assert story.node.status()["door"] == "open (estimated)"


def test_a_glitch_of_a_single_contact_restarts_no_estimate() -> None:
    story = Story(
        Building(replace(OPEN_AT_L1, door=DoorReading.NOT_CLOSED)), debounce={"door": 0.1}
    )
    story.run(8.0)
    story.asks("A", "L1")
    story.run(9.0)
    edges = list(story.edges)
    for _ in range(5):
        story.building.set(door=DoorReading.CLOSED)
        story.run(story.now + 0.05)
        story.building.set(door=DoorReading.NOT_CLOSED)
        story.run(story.now + 0.2)
        assert story.state == "AGV, open at L1, A to L1"
        story.run(story.now + 4.0)
    assert (story.edges, story.faults) == (edges, [])


@pytest.mark.parametrize(
    ("front", "rear", "shown"),
    [
        (DoorReading.CLOSED, DoorReading.CLOSED, "closed"),
        (DoorReading.CLOSED, DoorReading.NOT_OPEN, "closed (estimated)"),
        (DoorReading.BETWEEN, DoorReading.NOT_OPEN, "moving"),
        (DoorReading.OPEN, DoorReading.NOT_OPEN, "open"),
        (DoorReading.OPEN, DoorReading.NOT_CLOSED, "open"),
        (DoorReading.CLOSED, DoorReading.NOT_CLOSED, "open (estimated)"),
    ],
)
def test_of_two_doors_only_the_estimated_one_is_marked(
    front: DoorReading, rear: DoorReading, shown: str
) -> None:
    story = Story(Building(replace(OPEN_AT_L1, door=front, rear_door=rear)))
    story.run(9.0)
    assert story.node.status()["door"] == shown


def test_an_estimated_door_is_shown_as_moving_if_it_is_not_offered() -> None:
    story = Story(Building(replace(OPEN_AT_L1, door=DoorReading.NOT_CLOSED, agv=False)))
    story.run(9.0)
    story.asks("A", "L1")
    assert story.node.status()["door"] == "moving"


def test_only_a_door_that_is_shown_open_is_marked_as_estimated() -> None:
    sample = replace(AT_L1, door=DoorReading.NOT_CLOSED, motion=Motion.UP)
    alone = Alone(door_travel_s=1.0, stale_after_s=60.0)(0.0, sample)(2.0, sample)
    shown = alone.decision.report
    assert (shown.door.name, shown.estimated) == ("DOOR_MOVING", False)


def test_an_estimated_door_that_starts_to_move_is_no_longer_shown_open() -> None:
    story = Story(Building(replace(OPEN_AT_L1, door=DoorReading.NOT_CLOSED)), door_travel_s=4.0)
    story.run(6.0)
    assert story.state == "AGV, open at L1"
    story.building.set(door=DoorReading.CLOSED)
    story._scan()
    assert story.node.status()["door"] == "moving"


# ---- LIFT-SENSING-1, LIFT-SENSING-5: when the core asks to be woken


def test_the_core_wakes_when_an_input_seen_for_the_first_time_has_settled() -> None:
    rules = Story(Building(OPEN_AT_L1)).limits
    before = decide(LiftMemory(), LiftRequested("A", True, "L1"), 0.0, rules)
    assert [fault.detail for fault in before.report.faults] == ["not read yet"]
    first = decide(before.memory, Sampled(OPEN_AT_L1), 10.0, rules)
    assert first.wake_at == 10.0 + rules.debounce_s("door")


def test_each_input_has_its_own_debounce_and_the_core_wakes_when_it_is_over() -> None:
    settled = replace(AT_L1, rear_door=DoorReading.CLOSED)
    for change, due_s in (
        ({"level": "L2"}, 0.08),
        ({"door": DoorReading.CLOSED}, 0.03),
        ({"rear_door": DoorReading.OPEN}, 0.04),
        ({"agv": False}, 0.05),
        ({"hazards": frozenset({Hazard.FIRE})}, 0.06),
    ):
        alone = Alone(DEBOUNCE)(0.0, settled)(1.0 - 0.5, settled)(1.0, replace(settled, **change))
        assert alone.decision.wake_at == 1.0 + due_s


def test_the_core_wakes_when_its_first_reading_has_settled() -> None:
    assert Alone(DEBOUNCE)(1.0, AT_L1).decision.wake_at == 1.03


def test_the_core_wakes_at_the_estimated_arrival_of_each_door() -> None:
    rules = Story(Building(OPEN_AT_L1), debounce={}, door_travel_s=0.7).limits
    for front, rear in (
        (DoorReading.NOT_OPEN, DoorReading.OPEN),
        (DoorReading.OPEN, DoorReading.NOT_CLOSED),
    ):
        sample = LiftSample("L1", front, rear_door=rear)
        assert decide(LiftMemory(), Sampled(sample), 10.0, rules).wake_at == 10.7


@pytest.mark.parametrize("where", ["door", "rear_door"])
def test_the_core_wakes_when_a_door_with_one_contact_reaches_its_other_end(
    where: str,
) -> None:
    sample = replace(AT_L1, door=DoorReading.CLOSED, rear_door=DoorReading.CLOSED)
    alone = Alone(door_travel_s=3.0, stale_after_s=60.0)(0.0, sample)
    alone(1.0, replace(sample, **{where: DoorReading.NOT_CLOSED}))
    assert alone.decision.wake_at == 4.0


def test_a_new_fault_is_news_but_a_new_text_of_it_is_not() -> None:
    rules = Story(Building(OPEN_AT_L1), debounce={}).limits
    first = decide(LiftMemory(), Sampled(OPEN_AT_L1), 0.0, rules).report
    lost = [replace(first, faults=(Fault("INPUTS_NOT_FRESH", f"timeout {i}"),)) for i in (1, 2)]
    assert lost[0].news() == lost[1].news() != first.news()
    assert replace(first, read_at=9.0).news() == first.news()
