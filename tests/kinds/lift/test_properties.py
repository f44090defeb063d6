"""The rules of a lift with debounce, for any events in any order. After many failures RMF must
recover."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from bridges.kinds.lift import KIND, core
from bridges.kinds.lift.signals import DoorReading, Hazard, LiftSample, Motion
from bridges.kinds.shared.decision import Sampled
from bridges.messages.definitions import LiftDoor, LiftRequest, LiftState
from tests.depth import examples
from tests.kinds.lift.invariants import check
from tests.kinds.lift.rmf_world import World as Rmf
from tests.kinds.lift.story import AGV, END, HUMAN, Building, Controller, Story
from tests.kinds.lift.walk import Step, World
from workbench.rmf_model.robot import RobotContext

FEW = settings(max_examples=examples(60))
STORMS = settings(max_examples=examples(40))


@dataclass
class Judge:
    """A check of every decision of a story by the rules. `open_seen_at` is the time (s) of the last
    reading of an open door."""

    building: Building
    open_seen_at: float = -1.0
    decisions: int = 0

    def decide(self, memory: Any, event: Any, now: float, limits: Any) -> Any:
        decision = core.decide(memory, event, now, limits)
        building = self.building
        around = World(memory, building.sample, not building.unreadable, not building.unwritable)
        check(Step(memory, event, decision, around, now, limits, exact=False))
        if isinstance(event, Sampled) and event.sample.door is DoorReading.OPEN:
            self.open_seen_at = now
        if decision.report.door is LiftDoor.DOOR_OPEN:
            assert now <= self.open_seen_at + limits.debounce_s("door") + limits.t.stale_after_s
        self.decisions += 1
        return decision


def judged(building: Building, **options: Any) -> tuple[Story, Judge]:
    """Return a story, and the `Judge` that checks its decisions."""
    judge = Judge(building)
    return Story(building, kind=replace(KIND, decide=judge.decide), **options), judge


SAMPLES = st.builds(
    LiftSample,
    level=st.sampled_from(["L1", "L2", "L3", None]),
    door=st.sampled_from([DoorReading.OPEN, DoorReading.CLOSED, DoorReading.BETWEEN, DoorReading.BOTH]),
    motion=st.sampled_from([Motion.STOPPED, Motion.UP, Motion.CONTRADICTORY]),
    agv=st.booleans(),
    hazards=st.sampled_from([frozenset(), frozenset(), frozenset(), frozenset({Hazard.FIRE}),
                             frozenset({Hazard.OVERLOAD})]),
)  # fmt: skip
WAITS = st.sampled_from([0.0, 0.02, 0.05, 0.1, 0.3, 1.0, 3.0, 12.0])
REQUESTS = st.tuples(st.sampled_from("AB"), st.sampled_from(["L1", "L3"]),
                     st.sampled_from([AGV, AGV, AGV, HUMAN, END]))  # fmt: skip
HAPPENINGS = st.one_of(
    SAMPLES, SAMPLES, REQUESTS, REQUESTS, st.sampled_from(["bus", "relays", "rival", "reset"])
)


def happens(story: Story, what: Any) -> None:
    building = story.building
    if isinstance(what, LiftSample):
        building.sample = what
    elif isinstance(what, tuple):
        story.request(LiftRequest("Lift1", session_id=what[0], destination_floor=what[1],
                                  request_type=int(what[2]), door_state=2))  # fmt: skip
    elif what == "bus":
        building.unreadable = "" if building.unreadable else "timeout"
    elif what == "relays":
        building.unwritable = "" if building.unwritable else "timeout"
    else:
        {"rival": story.rival, "reset": story.resets}[what]()


@FEW
@given(st.lists(st.tuples(WAITS, HAPPENINGS), max_size=40), st.sampled_from([None, 0.4]))
def test_the_invariants_hold_for_any_actions_of_building_and_rmf(
    happenings: Sequence[tuple[float, Any]], pulse_s: float | None
) -> None:
    story, judge = judged(Building(), call_pulse_s=pulse_s, fire_reset="manual")
    for wait_s, what in happenings:
        happens(story, what)
        story.run(story.now + wait_s)
    assert judge.decisions > 0


@FEW
@given(st.lists(st.tuples(WAITS, HAPPENINGS), max_size=25))
def test_after_any_events_the_lift_recovers_and_serves(
    happenings: Sequence[tuple[float, Any]],
) -> None:
    story, _ = judged(Building())
    for wait_s, what in happenings:
        happens(story, what)
        story.run(story.now + wait_s)
    building = story.building
    building.unreadable = building.unwritable = ""
    building.sample = LiftSample("L1", DoorReading.OPEN, motion=Motion.STOPPED, agv=True)
    story.run(story.now + 6.0)
    story.resets()
    for session in "AB":
        story.ends(session)
    story.run(story.now + 60.0)
    assert (story.state, story.faults) == ("AGV, open at L1", [])
    story.asks("C", "L1")
    story.run(story.now + 2.0)
    assert story.state == "AGV, open at L1, C to L1"
    assert story.outputs.hold_door is not None


TROUBLES = st.lists(
    st.tuples(
        st.floats(0.3, 6.0),
        st.sampled_from(["supervisor", "adapter", "node", "fire", "bus", "nothing"]),
    ),
    max_size=6,
)
FATES = st.lists(
    st.sampled_from([(0.0,), (0.0,), (0.0,), (), (0.6,), (2.0,), (0.0, 1.5)]),
    min_size=1,
    max_size=20,
)


def trouble(rmf: Rmf, robot: RobotContext, what: str) -> RobotContext:
    """Restart the supervisor, the adapter or the node, start a short fire, or make the inputs
    unreadable for 1.7 s."""
    story = rmf.story
    if what == "supervisor":
        rmf.restart_supervisor()
    elif what == "adapter":
        return rmf.restart_adapter(robot)
    elif what == "node":
        story.node.close()
        story.restart()
    elif what == "fire":
        story.building.hazard(Hazard.FIRE)
        rmf.run(story.now + 0.5)
        story.building.hazard()
    elif what == "bus":
        story.building.unreadable = "timeout"
        rmf.run(story.now + 1.7)
        story.building.unreadable = ""
    return robot


@STORMS
@given(TROUBLES, FATES, st.lists(st.booleans(), min_size=1, max_size=9), st.booleans())
def test_a_robot_rides_through_loss_delay_doubling_and_restarts(
    troubles: Sequence[tuple[float, str]],
    fates: Sequence[tuple[float, ...]],
    heard: Sequence[bool],
    adapters_first: bool,
) -> None:
    story, _ = judged(Controller())
    robot = RobotContext("fleet/a")
    rmf = Rmf(story, robot, adapters_first=adapters_first)
    count = [0, 0]

    def fate(request: LiftRequest) -> Sequence[float]:
        count[0] += 1
        return fates[count[0] % len(fates)]

    def hears(state: LiftState) -> bool:
        count[1] += 1
        return heard[count[1] % len(heard)]

    rmf.run(1.0)
    rmf.fate, rmf.hears = fate, hears
    rmf.asks(robot, "L3")
    for wait_s, what in troubles:
        rmf.run(story.now + wait_s)
        robot = trouble(rmf, robot, what)
    del rmf.fate, rmf.hears
    rmf.fate, rmf.hears = lambda request: (0.0,), lambda state: True
    rmf.run(story.now + 15.0)
    robot.on_task = True
    rmf.rides(robot, "L2", "L4")
    rmf.run(story.now + 10.0)
    assert story.state == "HUMAN, closed at L4"
    assert story.faults == []
