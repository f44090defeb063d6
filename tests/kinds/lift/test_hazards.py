"""A hazard or a second node takes the lift away from RMF. When it is over, RMF gets the lift back."""

from typing import Any

import pytest
from msgspec.structs import replace

from bridges.kinds.lift import keep
from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.lift.signals import (
    DoorReading,
    Hazard,
    LiftOutputs,
    LiftRequested,
    LiftSample,
    Motion,
    Side,
)
from bridges.kinds.shared.alarming import alarm_topics
from bridges.kinds.shared.decision import (
    IoFailed,
    RivalSeen,
)
from bridges.messages.definitions import Bool, EmergencySignal
from bridges.messages.topics import EMERGENCY_SIGNAL, FIRE_ALARM_TRIGGER, RETAINED
from tests.kinds.lift.alone import AT_L1, CLOSED, DEBOUNCE, Alone
from tests.kinds.lift.story import Building, Controller, Story
from tests.runtime.virtual_graph import Disk

CLOSED_AT_L1 = LiftSample("L1", DoorReading.CLOSED, motion=Motion.STOPPED, agv=True)
OPEN_AT_L1 = replace(CLOSED_AT_L1, door=DoorReading.OPEN)
HELD = LiftOutputs(agv_request=True, hold_door=Side.FRONT)

MODES = [
    (Hazard.FIRE, "FIRE"),
    (Hazard.CODE_BLUE, "EMERGENCY"),
    (Hazard.EARTHQUAKE, "EMERGENCY"),
    (Hazard.EMERGENCY, "EMERGENCY"),
    (Hazard.OUT_OF_SERVICE, "OFFLINE"),
    (Hazard.MANUAL, "OFFLINE"),
]


def waiting(**options: object) -> Story:
    """Return a story in which robot A waits outside at L1. The car stands at L1. The core holds the
    door open, but the door is still closed."""
    story = Story(Building(CLOSED_AT_L1), door_timeout_s=600, **options)  # type: ignore[arg-type]
    story.run(1.0)
    story.asks("A", "L1")
    story.run(2.0)
    assert story.outputs == HELD
    return story


def inside(**options: object) -> Story:
    """Return a story in which robot A may be in the car at L1, because the lift has shown its open door
    to RMF."""
    story = Story(Building(OPEN_AT_L1), **options)  # type: ignore[arg-type]
    story.run(1.0)
    story.asks("A", "L1")
    story.run(2.0)
    return story


# ---- LIFT-5: when the lift shows its open door


@pytest.mark.parametrize(("hazard", "mode"), MODES)
def test_a_hazard_before_boarding_switches_off_within_a_scan_and_offers_no_open_door(
    hazard: Hazard, mode: str
) -> None:
    story = waiting()
    story.building.hazard(hazard)
    story.building.set(door=DoorReading.OPEN, agv=False)
    story.run(5.0)
    assert story.edges[2:] == [(2.1, "hold_door", None), (2.1, "agv_request", False)]
    assert story.state == f"{mode}, moving at L1, A to L1"
    assert story.faults == [hazard.name]
    story.asks("A", "L2")
    assert story.outputs == LiftOutputs()
    story.ends("A")
    story.run(6.0)
    assert story.state == f"{mode}, open at L1"


@pytest.mark.parametrize(("hazard", "mode"), MODES)
def test_after_boarding_the_real_door_is_shown_to_let_the_robot_out(
    hazard: Hazard, mode: str
) -> None:
    story = inside()
    building = story.building
    story.asks("A", "L3")
    story.run(3.0)
    building.hazard(hazard)
    building.set(agv=False, door=DoorReading.CLOSED)
    story.run(4.0)
    building.set(level=None, motion=Motion.DOWN)
    story.run(5.0)
    building.set(level="L2", motion=Motion.STOPPED)
    story.run(6.0)
    assert story.state == f"{mode}, closed at L2, A to L3"
    story.asks("A", "L2")
    building.set(door=DoorReading.BETWEEN)
    story.run(7.0)
    building.set(door=DoorReading.OPEN)
    story.run(8.0)
    assert story.outputs == LiftOutputs()
    assert story.states[-2:] == [
        (6.1, f"{mode}, moving at L2, A to L2"),
        (7.08, f"{mode}, open at L2, A to L2"),
    ]


def test_after_a_fire_the_robot_inside_is_shown_no_open_door_before_agv_mode_is_back() -> None:
    """After the fire a person opens the door at the robot's destination. Only AGV mode can hold that
    door. Without AGV mode, the robot gets out by the door as it is."""
    story = inside(agv_timeout_s=10.0)
    story.asks("A", "L1")
    story.building.hazard(Hazard.FIRE)
    story.building.set(agv=False)
    story.run(4.0)
    assert story.state == "FIRE, open at L1, A to L1"
    story.building.hazard()
    story.run(8.0)
    assert (story.state, story.outputs) == (
        "HUMAN, moving at L1, A to L1",
        LiftOutputs(agv_request=True),
    )
    story.asks("A", "L1")
    story.run(18.0)
    assert (story.state, story.faults) == ("HUMAN, open at L1, A to L1", ["AGV_MODE_NOT_GRANTED"])
    story.building.set(agv=True)
    story.run(30.0)
    assert (story.state, story.outputs) == ("AGV, open at L1, A to L1", HELD)


# ---- LIFT-4: a hazard that has ended


@pytest.mark.parametrize(("hazard", "mode"), MODES)
def test_a_hazard_leaves_no_latch_after_it_has_cleared(hazard: Hazard, mode: str) -> None:
    story = waiting()
    story.building.hazard(hazard)
    story.run(5.0)
    story.building.hazard()
    story.building.set(agv=False)
    story.run(6.0)
    assert story.outputs == LiftOutputs()
    story.run(7.0)
    assert story.edges[4:] == [(6.05, "agv_request", True)]
    story.building.set(agv=True)
    story.run(8.0)
    assert story.outputs == HELD
    assert (story.state, story.faults) == ("AGV, closed at L1, A to L1", [])


def test_a_hazard_during_a_ride_cancels_the_call_and_the_ride_resumes_afterwards() -> None:
    story = Story(Controller())
    story.run(1.0)
    story.asks("A", "L3")
    story.run(3.0)
    story.building.hazard(Hazard.CODE_BLUE)
    story.run(5.0)
    story.building.hazard()
    story.run(20.0)
    assert story.edges == [
        (1.0, "agv_request", True),
        (1.55, "call", "L3"),
        (3.1, "call", None),
        (3.1, "agv_request", False),
        (6.05, "agv_request", True),
        (6.6, "hold_door", "front"),
    ]
    assert story.state == "AGV, open at L3, A to L3"


def test_a_pulsed_call_is_repeated_after_the_hazard_that_cut_it_short() -> None:
    alone = Alone(stale_after_s=900.0, call_pulse_s=2.0, hazard_clear_s=1.0)
    alone(0.0, CLOSED)(1.0, LiftRequested("A", True, "L3"), CLOSED)
    assert alone.decision.outputs.call == "L3"
    alone(2.0, replace(CLOSED, hazards=frozenset({Hazard.EMERGENCY})))
    assert alone.decision.outputs == LiftOutputs()
    alone(10.0, CLOSED)(11.0, CLOSED)
    assert alone.decision.outputs.call == "L3"


# ---- LIFT-SENSING-1: hazards that flicker


def test_short_flickers_neither_begin_nor_end_a_hazard() -> None:
    story = waiting()
    story.building.hazard(Hazard.FIRE)
    story._scan()
    story.run(2.04)
    story.building.hazard()
    story.run(4.0)
    assert story.outputs == HELD
    story.building.hazard(Hazard.FIRE)
    story.run(5.0)
    for _ in range(6):
        story.building.hazard()
        story.run(story.now + 0.9)
        story.building.hazard(Hazard.FIRE)
        story.run(story.now + 0.1)
    assert len(story.edges) == 4
    assert (story.state, story.faults) == ("FIRE, closed at L1, A to L1", ["FIRE"])


@pytest.mark.parametrize(("debounce_s", "clear_s"), [(0.05, 10.0), (10.0, 1.0)])
def test_a_hazard_clears_after_the_longer_of_its_two_delays(
    debounce_s: float, clear_s: float
) -> None:
    building = Building(CLOSED_AT_L1)
    building.hazard(Hazard.FIRE)
    debounce: dict[str, float] = {Hazard.FIRE: debounce_s}
    story = Story(building, debounce=debounce, hazard_clear_s=clear_s)
    story.run(20.0)
    building.hazard()
    story.run(29.9)
    assert story.faults == ["FIRE"]
    story.run(30.1)
    assert story.faults == []


def test_a_hazard_that_clears_wakes_the_core() -> None:
    burning = replace(AT_L1, hazards=frozenset({Hazard.EMERGENCY}))
    alone = Alone(hazard_clear_s=0.7)(0.0, burning)(0.5, AT_L1)
    assert alone.decision.wake_at == 0.5 + 0.7


# ---- LIFT-4: which hazard is shown


def test_a_reset_while_nothing_can_be_read_does_not_report_a_fire() -> None:
    story = waiting(fire_reset="manual", alarm="fire_alarm_trigger")
    story.building.unreadable = "no answer"
    story.run(5.0)
    story.resets()
    assert story.faults == ["INPUTS_NOT_FRESH"]
    story.building.unreadable = ""
    story.run(7.0)
    assert (story.faults, story.alarms) == ([], [])


def test_fire_comes_before_every_other_mode() -> None:
    story = waiting()
    story.building.hazard(*Hazard)
    story.run(3.0)
    assert story.state.startswith("FIRE")
    assert story.faults == [h.name for h in Hazard]


# ---- LIFT-4, LIFT-DRIVE-3, LIFT-DRIVE-5: an overload only delays the ride


def test_an_overload_keeps_the_door_held_and_only_delays_the_ride() -> None:
    story = inside()
    story.building.hazard(Hazard.OVERLOAD)
    story.run(3.0)
    story.asks("A", "L3")
    story.run(20.0)
    assert story.outputs == LiftOutputs(agv_request=True)
    story.asks("A", "L1")
    story.run(200.0)
    assert story.outputs == HELD
    assert (story.state, story.faults) == (
        "AGV, open at L1, A to L1",
        ["OVERLOAD", "RMF_SILENT"],
    )
    story.asks("A", "L3")
    story.building.hazard()
    story.run(203.0)
    assert story.outputs == LiftOutputs(agv_request=True, call="L3")


def test_the_time_of_an_overload_does_not_count_as_waiting() -> None:
    story = Story(Building(CLOSED_AT_L1), floor_timeout_s=20, request_timeout_s=600)
    story.run(1.0)
    story.asks("A", "L3")
    story.run(15.0)
    story.building.hazard(Hazard.OVERLOAD)
    story.run(300.0)
    story.building.hazard()
    story.run(318.0)
    assert story.faults == []
    story.run(322.0)
    assert story.faults == ["RUNTIME_LIMIT_EXCEEDED"]


def test_after_a_hazard_a_car_between_floors_is_called_again() -> None:
    story = inside()
    building = story.building
    building.hazard(Hazard.CODE_BLUE)
    building.set(level=None, motion=Motion.DOWN, door=DoorReading.CLOSED)
    story.run(4.0)
    building.hazard()
    building.set(motion=Motion.STOPPED)
    story.run(7.0)
    assert story.outputs == LiftOutputs(agv_request=True, call="L1")


def test_an_overloaded_lift_is_not_offered_for_boarding() -> None:
    story = waiting()
    story.building.hazard(Hazard.OVERLOAD)
    story.building.set(door=DoorReading.OPEN)
    story.run(4.0)
    assert story.state == "AGV, moving at L1, A to L1"
    story.building.hazard()
    story.run(6.0)
    assert story.state == "AGV, open at L1, A to L1"


def test_a_pulsed_call_is_repeated_after_the_overload_that_cut_it_short() -> None:
    story = Story(Building(CLOSED_AT_L1), call_pulse_s=1.0)
    story.run(1.0)
    story.asks("A", "L3")
    story.run(1.5)
    story.building.hazard(Hazard.OVERLOAD)
    story.run(5.0)
    story.building.hazard()
    story.run(9.0)
    assert story.edges == [
        (1.0, "agv_request", True),
        (1.0, "call", "L3"),
        (1.6, "call", None),
        (6.05, "call", "L3"),
        (7.05, "call", None),
    ]


def test_an_overload_does_not_end_the_wait_for_agv_mode() -> None:
    story = Story(Building(replace(CLOSED_AT_L1, agv=False)), agv_timeout_s=5.0)
    story.building.hazard(Hazard.OVERLOAD)
    story.run(1.0)
    story.asks("A", "L3")
    story.run(10.0)
    assert story.faults == ["OVERLOAD"]
    assert story.outputs == LiftOutputs(agv_request=True)


# ---- LIFT-4: latches, and the alarm for the fleets


def test_with_automatic_reset_rmf_gets_the_lift_back_when_the_fire_is_over() -> None:
    story = waiting(fire_reset="auto")
    story.building.hazard(Hazard.FIRE)
    story.run(5.0)
    story.building.hazard()
    story.run(7.0)
    assert story.outputs == HELD


def test_with_manual_reset_only_an_operator_gives_the_lift_back_and_only_after_the_fire() -> None:
    story = waiting(fire_reset="manual")
    story.building.hazard(Hazard.FIRE)
    story.run(5.0)
    story.resets()
    story.run(6.0)
    story.building.hazard()
    story.run(60.0)
    assert (story.state, story.faults) == (
        "FIRE, closed at L1, A to L1",
        ["FIRE_LATCHED", "RMF_SILENT"],
    )
    assert story.outputs == LiftOutputs()
    story.ends("A")
    story.asks("B", "L1")
    assert story.node.refused == {"FIRE_LATCHED": 1}
    story.resets()
    story.asks("B", "L1")
    story.run(61.0)
    assert (story.outputs, story.faults) == (HELD, [])


def latched(**settings: Any) -> Story:
    """Return the story of a free lift whose fire is over and is latched."""
    story = waiting(fire_reset="manual", **settings)
    story.building.hazard(Hazard.FIRE)
    story.run(5.0)
    story.ends("A")
    story.building.hazard()
    story.run(7.0)
    return story


def test_a_fire_stays_latched_when_the_daemon_restarts() -> None:
    """A power cut in a fire is no operator."""
    story = latched()
    for _ in range(2):
        story.restart()
        story.resets()  # before the inputs have settled they may hide the fire
        story.run(story.now + 20.0)
        story.asks("A", "L1")
        assert story.faults == ["FIRE_LATCHED"]
        assert (story.outputs, story.node.refused) == (LiftOutputs(), {"FIRE_LATCHED": 1})
    story.resets()
    story.restart()
    story.run(story.now + 1.0)
    story.asks("A", "L1")
    story.run(story.now + 1.0)
    assert (story.outputs, story.faults) == (HELD, [])


@pytest.mark.parametrize(
    ("fire_reset", "kept", "faults"),
    [
        ("manual", b"{", ["FIRE_LATCHED"]),
        ("manual", b'{"version":1,"devices":{"Lift1":{"version":2}}}', ["FIRE_LATCHED"]),
        ("manual", b'{"version":1,"devices":{"Lift2":{}}}', []),
        ("manual", None, []),
        ("auto", b"{", []),
    ],
)
def test_a_lift_whose_memory_is_damaged_waits_for_a_reset_and_a_new_lift_does_not(
    fire_reset: str, kept: bytes | None, faults: list[str]
) -> None:
    story = Story(fire_reset=fire_reset)
    story.disk.kept = kept
    story.restart()
    story.run(2.0)
    assert story.faults == faults


def test_bytes_that_are_no_memory_are_refused() -> None:
    with pytest.raises(ValueError, match=r"^not the memory of a lift: "):
        keep.restore(b"[]", 0.0)


def test_a_full_disk_delays_no_output_and_is_a_fault_only_where_a_latch_matters() -> None:
    for fire_reset, faults in (("manual", ["FIRE", "NOT_KEPT"]), ("auto", ["FIRE"])):
        story = waiting(fire_reset=fire_reset)
        story.disk.full = True
        story.building.hazard(Hazard.FIRE)
        story.run(5.0)
        assert story.outputs == LiftOutputs()
        assert [code for code in story.faults if code != "RMF_SILENT"] == faults
    story = latched()
    story.disk.full = True
    story.resets()
    assert (story.faults, story.node.refused) == (["NOT_KEPT"], {})
    story.disk.full = False
    story.run(story.now + 1.1)
    assert story.faults == []


def test_a_full_disk_lets_robots_board() -> None:
    story = Story(Controller(), fire_reset="manual")
    story.building.hazard(Hazard.FIRE)
    story.run(2.0)
    story.building.hazard()
    story.run(4.0)
    story.disk.full = True
    story.resets()
    story.asks("A", "L1")
    story.until(lambda: story.state == "AGV, open at L1, A to L1")
    assert story.faults == ["NOT_KEPT"]


def test_the_outputs_are_off_and_the_fleets_told_before_the_latch_is_written() -> None:
    """A write to a worn card may take seconds."""

    class Slow(Disk):
        def write(self, kept: bytes) -> None:
            seen.append((story.outputs, [message for _, message in story.alarms]))
            super().write(kept)

    seen: list[tuple[LiftOutputs, list[object]]] = []
    story = waiting(fire_reset="manual", alarm="fire_alarm_trigger")
    story.disk = Slow()
    story.restart()
    story.run(story.now + 1.0)
    story.asks("A", "L1")
    story.run(story.now + 2.0)
    assert story.outputs == HELD
    story.building.hazard(Hazard.FIRE)
    story.run(story.now + 1.0)
    assert seen == [(LiftOutputs(), [Bool(True)])]


def test_a_lift_whose_memory_has_not_changed_writes_its_outputs_once_a_scan() -> None:
    """On a slow bus each write takes time."""

    class Counted(Building):
        reads = 0

        def read(self) -> LiftSample:
            self.reads += 1
            return super().read()

    building = Counted(CLOSED_AT_L1)
    story = Story(building, fire_reset="manual")
    story.run(1.0)
    story.asks("A", "L1")
    story.run(5.0)
    assert building.writes == building.opened + building.reads


def test_an_end_or_a_new_request_does_not_clear_a_fire_latch() -> None:
    story = waiting(fire_reset="manual")
    story.building.hazard(Hazard.FIRE)
    story.run(5.0)
    story.building.hazard()
    story.run(7.0)
    story.asks("A", "L4")
    story.run(8.0)
    story.ends("A")
    story.run(20.0)
    assert story.faults == ["FIRE_LATCHED"]
    assert story.state.startswith("FIRE")


@pytest.mark.parametrize(
    ("alarm", "on", "off"),
    [
        ("fire_alarm_trigger", Bool(True), Bool(False)),
        ("emergency_signal", EmergencySignal((), True), EmergencySignal((), False)),
    ],
)
def test_the_alarm_topic_gets_true_once_and_false_only_after_a_reset(
    alarm: str, on: object, off: object
) -> None:
    story = waiting(alarm=alarm)
    building = story.building
    building.hazard(Hazard.FIRE)
    story.run(5.0)
    building.hazard()
    story.run(8.0)
    building.hazard(Hazard.FIRE)
    story.run(10.0)
    story.resets()  # refused, because the fire still burns
    building.hazard()
    story.run(100.0)
    assert story.alarms == [(2.1, on)]
    story.resets()
    story.resets()
    story.run(110.0)
    assert story.alarms == [(2.1, on), (100.0, off)]
    building.hazard(Hazard.FIRE)
    story.run(111.0)
    assert story.alarms[2:] == [(110.1, on)]


def test_with_the_setting_a_code_blue_alarms_the_fleets_until_a_reset() -> None:
    story = waiting(alarm="emergency_signal", alarm_on=["fire_alarm", "code_blue"])
    on, off = EmergencySignal((), True), EmergencySignal((), False)
    story.building.hazard(Hazard.CODE_BLUE)
    story.run(5.0)
    story.building.hazard(Hazard.CODE_BLUE, Hazard.FIRE)  # the second hazard raises no second alarm
    story.run(8.0)
    story.building.hazard()
    story.run(20.0)
    assert story.alarms == [(2.1, on)]
    assert story.state.startswith("AGV")  # RMF has the lift again, but the fleets wait for a person
    story.resets()
    story.run(21.0)
    assert story.alarms == [(2.1, on), (20.0, off)]


def test_a_hazard_outside_alarm_on_alarms_nobody() -> None:
    story = waiting(alarm="emergency_signal", alarm_on=["code_blue"])
    story.building.hazard(Hazard.FIRE, Hazard.EARTHQUAKE, Hazard.OVERLOAD)
    story.run(5.0)
    assert story.alarms == []


def test_a_fire_at_the_very_first_reading_alarms_the_fleets() -> None:
    building = Building(CLOSED_AT_L1)
    building.hazard(Hazard.FIRE)
    story = Story(building, alarm="fire_alarm_trigger")
    story.run(3.0)
    assert story.alarms == [(0.05, Bool(True))]


def test_a_node_without_a_fire_never_ends_an_alarm() -> None:
    story = waiting(alarm="fire_alarm_trigger")
    story.resets()
    story.building.hazard(Hazard.CODE_BLUE, Hazard.EMERGENCY)
    story.run(5.0)
    story.resets()
    story.run(20.0)
    assert story.alarms == []


def test_without_the_setting_a_fire_does_not_alarm_the_fleets() -> None:
    story = waiting()
    story.building.hazard(Hazard.FIRE)
    story.run(5.0)
    assert story.alarms == []
    assert alarm_topics(story.settings) == ()


def test_the_alarm_is_published_on_the_chosen_topic_and_retained_for_late_joiners() -> None:
    chosen = LiftSettings(floors=["L1"], alarm="emergency_signal")
    assert alarm_topics(chosen) == (EMERGENCY_SIGNAL,)
    chosen = LiftSettings(floors=["L1"], alarm="fire_alarm_trigger")
    assert alarm_topics(chosen) == (FIRE_ALARM_TRIGGER,)
    assert {topic.publish for topic in (EMERGENCY_SIGNAL, FIRE_ALARM_TRIGGER)} == {RETAINED}


def test_a_fire_is_not_shown_as_a_fact_without_readings() -> None:
    story = waiting()
    story.building.hazard(Hazard.FIRE)
    story.run(5.0)
    story.building.unreadable = "no answer"
    story.run(10.0)
    assert (story.state, story.faults) == (
        "OFFLINE, moving at ?, A to L1",
        ["INPUTS_NOT_FRESH"],
    )


@pytest.mark.parametrize("over", [False, True])
def test_a_latched_fire_stays_latched_without_readings(over: bool) -> None:
    story = waiting(fire_reset="manual", alarm="fire_alarm_trigger")
    story.building.hazard(Hazard.FIRE)
    story.run(5.0)
    if over:
        story.building.hazard()
    story.run(8.0)
    story.building.unreadable = "no answer"
    story.run(10.0)
    story.resets()
    story.run(11.0)
    assert story.state == "FIRE, moving at ?, A to L1"
    assert story.faults == ["FIRE_LATCHED", "INPUTS_NOT_FRESH"]
    story.building.unreadable = ""
    story.run(11.05)
    story.resets()  # the inputs are read but not debounced yet
    story.run(20.0)
    assert story.faults == ["FIRE_LATCHED" if over else "FIRE"]
    assert story.alarms == [(2.1, Bool(True))]


# ---- LIFT-4: a second node of the same name


def test_a_second_node_for_this_lift_switches_the_outputs_off_until_that_node_is_gone() -> None:
    story = waiting()
    for second in range(3, 8):
        story.rival()
        story.run(float(second))
    assert story.edges[2:] == [(2.0, "hold_door", None), (2.0, "agv_request", False)]
    assert story.state == "OFFLINE, closed at L1, A to L1"
    assert story.faults == ["TWO_NODES_FOR_ONE_DEVICE"]
    story.asks("A", "L1")
    story.run(10.9)
    assert story.outputs == LiftOutputs()
    story.run(11.0)
    assert (story.outputs.agv_request, story.faults) == (True, [])


def test_the_core_wakes_when_another_node_has_gone() -> None:
    alone = Alone(stale_after_s=60.0)(0.0, AT_L1)(1.0, RivalSeen())
    assert alone.decision.wake_at == 6.0


def test_a_bus_that_fails_at_every_second_reading_hides_no_hazard() -> None:
    """LIFT-SENSING-2."""
    lift = Alone(DEBOUNCE, stale_after_s=1.0)(0.5, AT_L1)(1.0, AT_L1)
    fire = replace(AT_L1, hazards=frozenset({Hazard.FIRE}))
    for now in (1.1, 1.2, 1.3, 1.4):
        lift(now, IoFailed("no reply"))(now + 0.05, fire)
    assert "FIRE" in {fault.code for fault in lift.faults}


def test_a_bus_that_fails_at_every_second_reading_shows_no_old_contacts_for_long() -> None:
    """LIFT-SENSING-1: the inputs are not steady."""
    lift = Alone(DEBOUNCE, stale_after_s=1.0)(0.5, AT_L1)(1.0, AT_L1)
    for step in range(30):
        now = 1.1 + step / 10
        lift(now, IoFailed("no reply"))(now + 0.05, replace(CLOSED, level="L2"))
    assert lift.faults[0].code == "INPUTS_NOT_FRESH"
