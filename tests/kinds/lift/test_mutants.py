"""What a mutation run found that no story had told: texts, wake times, names, the edge of an age."""

from collections.abc import Sequence
from typing import Any

import pytest
from msgspec.structs import replace

from bridges.kinds.lift.core import decide
from bridges.kinds.lift.memory import LiftLimits, Memory
from bridges.kinds.lift.sensing import MOTION_MEMORY_S
from bridges.kinds.lift.settings import Durations, Floor, LiftSettings
from bridges.kinds.lift.signals import (
    Door,
    Ended,
    Hazard,
    LiftOutputs,
    LiftSample,
    Motion,
    Requested,
    Side,
)
from bridges.kinds.shared.decision import (
    Fault,
    IoFailed,
    OperatorReset,
    RivalSeen,
    Sampled,
    Suspended,
    WriteFailed,
)
from bridges.messages.definitions import LiftMode

DEBOUNCE = {"floor": 0.08, "door": 0.03, "rear_door": 0.04, "agv_mode": 0.05, Hazard.FIRE: 0.06}
AT_L1 = LiftSample("L1", Door.OPEN, motion=Motion.STOPPED, agv=True)
ASKED = Requested("A", True, "L1")


class Alone:
    """A core alone, told one event after the other; `decision`: the last."""

    def __init__(
        self, debounce: dict[str, float] | None = None, by_call: bool = False, **limits: Any
    ) -> None:
        floors = {"L1": Floor(), "L2": Floor(side=Side.REAR), "L3": Floor()}
        settings = LiftSettings(
            floors=floors,
            limits=Durations(**limits),
            fire_reset="manual",
            agv_mode="by_call" if by_call else "requested",
        )
        self.limits = LiftLimits.of(settings, debounce or {})
        self.memory = Memory()

    def __call__(self, now: float, *events: Any) -> "Alone":
        for event in events:
            event = Sampled(event) if isinstance(event, LiftSample) else event
            self.decision = decide(self.memory, event, now, self.limits)
            self.memory = self.decision.memory
        return self

    @property
    def faults(self) -> tuple[Fault, ...]:
        return self.decision.report.faults


CLOSED = replace(AT_L1, door=Door.CLOSED)
FAULTS: dict[str, tuple[list[tuple[float, Any]], Fault]] = {
    "a fire that was": (
        [(0.0, replace(AT_L1, hazards=frozenset({Hazard.FIRE}))), (0.5, AT_L1), (1.6, AT_L1)],
        Fault("FIRE_LATCHED", "rmf-bridge reset when it is safe"),
    ),
    "another node": (
        [(0.0, AT_L1), (0.1, RivalSeen())],
        Fault("TWO_NODES_FOR_ONE_DEVICE", "another node publishes this lift's states"),
    ),
    "a floor too far": (
        [(0.0, AT_L1), (0.1, replace(AT_L1, level="L3"))],
        Fault("POSITION_LOST", "L3 cannot follow L1 like this"),
    ),
    "a floor code that cannot be": (
        [(0.0, replace(AT_L1, level=None, code_fault="two lines at once"))],
        Fault("FLOOR_CODE_ILLEGAL", "two lines at once"),
    ),
    "a door that is both": (
        [(0.0, replace(AT_L1, door=Door.BOTH))],
        Fault("DOOR_CONTACTS_CONTRADICT", "door reads open and closed"),
    ),
    "a rear door that is both": (
        [(0.0, replace(AT_L1, rear_door=Door.BOTH))],
        Fault("DOOR_CONTACTS_CONTRADICT", "rear door reads open and closed"),
    ),
    "a door whose number means nothing": (
        [(0.0, replace(AT_L1, door=Door.UNKNOWN))],
        Fault("DOOR_CODE_ILLEGAL", "the door's number means nothing"),
    ),
    "up and down at once": (
        [(0.0, replace(AT_L1, motion=Motion.CONTRADICTORY))],
        Fault("MOTION_CONTRADICTORY", "the motion lines cannot all be true"),
    ),
    "AGV mode that ends": (
        [(0.0, AT_L1), (0.1, ASKED), (0.2, AT_L1), (0.3, replace(AT_L1, agv=False))],
        Fault("AGV_MODE_LOST", "AGV mode ended during the ride"),
    ),
    "AGV mode that does not come": (
        [(0.0, replace(AT_L1, agv=False)), (0.1, ASKED), (0.7, replace(AT_L1, agv=False))],
        Fault("AGV_MODE_NOT_GRANTED", "no AGV mode status after 0.5 s"),
    ),
    "a car that does not come": (
        [(0.0, AT_L1), (0.1, Requested("A", True, "L3")), (0.8, AT_L1)],
        Fault("RUNTIME_LIMIT_EXCEEDED", "not at L3 after 0.6 s"),
    ),
    "a door that does not open": (
        [(0.0, CLOSED), (0.1, ASKED), (0.9, CLOSED)],
        Fault("DOOR_OPENING_FAULT", "not open at L1 after 0.7 s"),
    ),
    "too much in the car": (
        [(0.0, replace(AT_L1, hazards=frozenset({Hazard.OVERLOAD})))],
        Fault("OVERLOAD", "waits until the car is lighter"),
    ),
    "RMF that is silent": (
        [(0.0, AT_L1), (0.1, ASKED), (30.2, AT_L1)],
        Fault("RMF_SILENT", "no request from A"),
    ),
    "nothing read yet": ([(0.0, ASKED)], Fault("INPUTS_NOT_FRESH", "not read yet")),
    "inputs that never keep still": (
        [(0.1 * i, replace(AT_L1, agv=bool(i % 2), rear_door=(Door.OPEN, Door.CLOSED)[i % 2]))
         for i in range(2, 30)],
        Fault("INPUTS_NOT_FRESH", "not steady: rear_door, agv_mode"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", FAULTS)
def test_a_fault_says_what_is_wrong(what: str) -> None:
    happenings, fault = FAULTS[what]
    debounce = {"rear_door": 0.5, "agv_mode": 0.5} if "still" in what else {}
    alone = Alone(debounce, agv_timeout_s=0.5, floor_timeout_s=0.6, door_timeout_s=0.7)
    if debounce:
        settled = replace(AT_L1, rear_door=Door.CLOSED)
        alone(-0.5, settled)(0.0, settled)
    for now, event in happenings:
        alone(now, event)
    assert alone.faults == (fault,)


@pytest.mark.parametrize("event", [Ended("A"), IoFailed("timeout"), OperatorReset(), RivalSeen()])
def test_an_event_that_is_not_a_request_is_not_refused(event: Any) -> None:
    assert Alone()(0.0, AT_L1, event).decision.refused == ""


def test_a_reading_no_longer_counts_at_the_very_instant_at_which_it_is_too_old() -> None:
    burning = replace(AT_L1, door=Door.BOTH, hazards=frozenset({Hazard.EMERGENCY}))
    alone = Alone(stale_after_s=2.0)(0.0, burning)(2.0, IoFailed("timeout"))
    assert alone.faults == (Fault("INPUTS_NOT_FRESH", "timeout"),)


def test_each_input_has_its_own_debounce_and_the_core_wakes_when_it_is_over() -> None:
    settled = replace(AT_L1, rear_door=Door.CLOSED)
    for change, due_s in (
        ({"level": "L2"}, 0.08),
        ({"door": Door.CLOSED}, 0.03),
        ({"rear_door": Door.OPEN}, 0.04),
        ({"agv": False}, 0.05),
        ({"hazards": frozenset({Hazard.FIRE})}, 0.06),
    ):
        alone = Alone(DEBOUNCE)(0.0, settled)(1.0 - 0.5, settled)(1.0, replace(settled, **change))
        assert alone.decision.wake_at == 1.0 + due_s


def test_a_hazard_that_clears_wakes_the_core() -> None:
    burning = replace(AT_L1, hazards=frozenset({Hazard.EMERGENCY}))
    alone = Alone(hazard_clear_s=0.7)(0.0, burning)(0.5, AT_L1)
    assert alone.decision.wake_at == 0.5 + 0.7


@pytest.mark.parametrize("where", ["door", "rear_door"])
def test_a_door_with_one_contact_wakes_the_core_when_it_has_come_to_its_other_end(
    where: str,
) -> None:
    sample = replace(AT_L1, door=Door.CLOSED, rear_door=Door.CLOSED)
    alone = Alone(door_travel_s=3.0, stale_after_s=60.0)(0.0, sample)
    alone(1.0, replace(sample, **{where: Door.NOT_CLOSED}))
    assert alone.decision.wake_at == 4.0


def test_the_core_wakes_for_rmfs_silence_and_for_the_next_try() -> None:
    alone = Alone(stale_after_s=900.0, request_timeout_s=30.0)(0.0, AT_L1)(1.0, ASKED)
    assert alone.decision.wake_at == 31.0
    alone = Alone(stale_after_s=900.0, request_timeout_s=30.0, door_timeout_s=4.0)
    alone(0.0, CLOSED)(1.0, ASKED)(5.0, CLOSED)
    assert alone.decision.outputs == LiftOutputs()
    assert alone.decision.wake_at == 15.0


def test_the_end_of_a_wait_for_the_lift_wakes_the_core() -> None:
    alone = Alone(stale_after_s=900.0, request_timeout_s=30.0, door_timeout_s=4.0)
    alone(0.0, CLOSED)(1.0, ASKED)
    assert alone.decision.outputs == LiftOutputs(agv_request=True, hold_door=Side.FRONT)
    assert alone.decision.wake_at == 5.0


def test_a_pulsed_call_that_a_hazard_cut_short_is_given_again_when_it_is_over() -> None:
    alone = Alone(stale_after_s=900.0, call_pulse_s=2.0, hazard_clear_s=1.0)
    alone(0.0, CLOSED)(1.0, Requested("A", True, "L3"))
    assert alone.decision.outputs.call == "L3"
    alone(2.0, replace(CLOSED, hazards=frozenset({Hazard.EMERGENCY})))
    assert alone.decision.outputs == LiftOutputs()
    alone(10.0, CLOSED)(11.0, CLOSED)
    assert alone.decision.outputs.call == "L3"


def test_an_event_that_is_only_noted_is_not_refused() -> None:
    alone = Alone(release_grace_s=2.0)(0.0, AT_L1)(0.1, WriteFailed("timeout"))
    assert alone.decision.refused == ""
    alone(0.2, AT_L1, ASKED)(1.0, AT_L1, Ended("A"))(1.5, ASKED)
    assert (alone.decision.refused, alone.decision.report.session) == ("", "A")


def test_even_a_short_grace_lasts_its_time() -> None:
    alone = Alone(release_grace_s=0.5)(0.0, AT_L1)(0.1, ASKED)(1.0, AT_L1, Ended("A"))
    assert alone.decision.outputs == LiftOutputs(agv_request=True, hold_door=Side.FRONT)
    assert alone(1.5, AT_L1).decision.outputs == LiftOutputs()


def test_anybody_may_have_the_lift_in_the_instant_in_which_the_grace_ends() -> None:
    alone = Alone(release_grace_s=2.0)(0.0, AT_L1)(0.1, ASKED)(1.0, Ended("A"))
    alone(2.9, AT_L1)
    alone(3.0, Requested("B", True, "L1"))
    assert alone.decision.refused == ""
    assert alone.decision.report.session == "B"


def test_after_a_reset_the_shown_floor_is_believed_at_once() -> None:
    alone = Alone()(0.0, AT_L1)(0.1, replace(AT_L1, level="L3"))
    assert (alone.decision.report.floor, alone(0.1, OperatorReset()).decision.report.floor) == (
        "",
        "L3",
    )


def test_a_door_that_is_not_shown_open_is_not_marked_as_estimated() -> None:
    sample = replace(AT_L1, door=Door.NOT_CLOSED, motion=Motion.UP)
    alone = Alone(door_travel_s=1.0, stale_after_s=60.0)(0.0, sample)(2.0, sample)
    shown = alone.decision.report
    assert (shown.door.name, shown.estimated) == ("DOOR_MOVING", False)


def test_a_floor_may_change_up_to_its_debounce_after_the_cars_last_movement() -> None:
    moving = replace(AT_L1, motion=Motion.UP)
    alone = Alone({"floor": 0.5}, stale_after_s=60.0)(0.0, moving)(1.0, moving)
    alone(1.1, AT_L1)(2.9, replace(AT_L1, level="L2"))(3.45, replace(AT_L1, level="L2"))
    assert (alone.decision.report.floor, alone.faults) == ("L2", ())


def test_the_next_floor_is_believed_in_the_last_instant_in_which_a_movement_is_remembered() -> None:
    alone = Alone(stale_after_s=60.0)(0.0, AT_L1)(1.0, replace(AT_L1, motion=Motion.UP))
    alone(1.0 + MOTION_MEMORY_S, replace(AT_L1, level="L2"))
    assert (alone.decision.report.floor, alone.faults) == ("L2", ())


def test_a_car_may_pass_a_floor_unseen_in_exactly_its_least_travel_time() -> None:
    moving = replace(AT_L1, motion=Motion.UP)
    alone = Alone(stale_after_s=60.0, floor_travel_min_s=2.0)(0.0, moving)
    alone(2.0, replace(moving, level="L3"))
    assert (alone.decision.report.floor, alone.faults) == ("L3", ())


def test_unwritten_outputs_are_judged_by_their_age_when_a_request_comes() -> None:
    alone = Alone(stale_after_s=2.0)(0.0, AT_L1, WriteFailed("timeout"))
    assert alone(1.0, ASKED).decision.refused == ""
    alone = Alone(stale_after_s=2.0)(0.0, AT_L1, WriteFailed("timeout"))
    alone(1.9, AT_L1, WriteFailed("timeout"))
    assert alone(2.0, ASKED).decision.refused == "OUTPUTS_NOT_WRITTEN"


def test_the_core_wakes_when_another_node_has_gone() -> None:
    alone = Alone(stale_after_s=60.0)(0.0, AT_L1)(1.0, RivalSeen())
    assert alone.decision.wake_at == 6.0


def test_the_core_wakes_when_its_first_reading_has_settled() -> None:
    assert Alone(DEBOUNCE)(1.0, AT_L1).decision.wake_at == 1.03


def test_a_floor_that_was_not_believed_is_believed_when_the_car_really_goes_there() -> None:
    alone = Alone(stale_after_s=60.0)(0.0, AT_L1)(0.1, replace(AT_L1, level="L3"))(0.2, AT_L1)
    moving = replace(AT_L1, motion=Motion.UP)
    for now, level in ((1.0, None), (2.0, "L2"), (3.0, None), (4.0, "L3")):
        alone(now, replace(moving, level=level))
    assert (alone.decision.report.floor, alone.faults) == ("L3", ())


def test_a_reading_in_the_instant_in_which_the_last_one_expires_starts_afresh() -> None:
    alone = Alone(DEBOUNCE)(0.0, AT_L1)(0.5, AT_L1)(1.5, AT_L1)
    shown = alone.decision.report
    assert (shown.mode, shown.floor, alone.faults) == (LiftMode.MODE_OFFLINE, "", ())
    alone(1.6, AT_L1)
    assert alone.decision.report.floor == "L1"


def test_after_a_sleep_everything_is_forgotten_but_the_last_landing() -> None:
    alone = Alone()(0.0, AT_L1)(1.0, AT_L1)(2.0, Suspended("the machine slept"))
    assert alone.decision.refused == ""
    assert alone.faults == (Fault("INPUTS_NOT_FRESH", "the machine slept"),)
    position = alone.memory.senses.position
    assert (position.trusted, position.moved_at) == ("L1", 2.0)
    assert alone.memory.senses == type(alone.memory.senses)(position=position)


def test_an_illegal_door_number_names_the_rear_door() -> None:
    alone = Alone()(0.0, replace(AT_L1, rear_door=Door.UNKNOWN))
    assert alone.faults == (Fault("DOOR_CODE_ILLEGAL", "the rear door's number means nothing"),)


def test_a_reset_during_a_retry_lets_the_request_wait_for_agv_mode_again() -> None:
    def history(reset_at: float) -> list[tuple[float, bool, list[str]]]:
        """(s, AGV request, faults) at each change, scanned twice a second."""
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


def calls_and_holds(
    alone: Alone, readings: Sequence[tuple[float, LiftSample]]
) -> list[tuple[float, str | None, Side | None]]:
    """(s, landing that is called, door that is held) after each reading, while a robot asks."""
    shown = []
    for now, reading in readings:
        outputs = alone(now, reading, ASKED).decision.outputs
        shown.append((now, outputs.call, outputs.hold_door))
    return shown


def test_a_car_that_a_call_has_brought_is_not_called_again_because_its_floor_is_not_seen() -> None:
    """With `by_call`, while AGV mode is on: only a car that is seen elsewhere is called again."""
    alone = Alone(by_call=True)
    below = replace(CLOSED, level="L2", agv=False)
    readings = [
        (0.0, below),
        (0.5, replace(below, agv=True)),
        (1.0, CLOSED),
        (1.5, CLOSED),
        (2.0, replace(CLOSED, level=None)),
        (9.0, replace(CLOSED, level=None)),
    ]
    alone(0.0, ASKED)
    assert calls_and_holds(alone, readings) == [
        (0.0, "L1", None),
        (0.5, "L1", None),
        (1.0, None, None),
        (1.5, None, Side.FRONT),
        (2.0, None, None),
        (9.0, None, None),
    ]


def test_a_car_at_its_destination_is_called_again_when_agv_mode_has_ended_by_itself() -> None:
    """With `by_call`: an overload has ended the call, and the floor was not seen, so nothing was on."""
    alone = Alone(by_call=True)
    below, gone = replace(CLOSED, level="L2"), replace(CLOSED, level=None)
    readings = [
        (0.0, replace(below, agv=False)),
        (0.5, below),
        (1.0, CLOSED),
        (1.5, CLOSED),
        (2.0, replace(gone, hazards=frozenset({Hazard.OVERLOAD}))),
        (3.0, replace(gone, agv=False)),
        (3.5, replace(CLOSED, agv=False)),
        (4.0, CLOSED),
        (4.5, CLOSED),
    ]
    assert calls_and_holds(alone, readings) == [
        (0.0, "L1", None),
        (0.5, "L1", None),
        (1.0, None, None),
        (1.5, None, Side.FRONT),
        (2.0, None, None),
        (3.0, "L1", None),
        (3.5, "L1", None),
        (4.0, None, None),
        (4.5, None, Side.FRONT),
    ]
