"""A run of the judge. In a play, the judge moves the device, as RMF would. The tests check when a play
may begin, how it ends, and the effect of meaningless messages."""

import pytest
from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from tests.site.timeline import EPOCH
from tests.workbench.judge.nodes.right_charger import RightCharger
from tests.workbench.judge.nodes.right_door import RightDoor
from tests.workbench.judge.nodes.right_lift import RightLift
from tests.workbench.judge.script import asks, lift
from tests.workbench.judge.world import World, told
from workbench.judge.charge_scenario import ChargeScenario
from workbench.judge.judge import Judge
from workbench.judge.judge_run import JudgeRun
from workbench.judge.law import Verdict
from workbench.judge.report import as_json, junit, report, text
from workbench.judge.scenarios import PassageScenario, RideScenario, Scenario

STATE = d.LiftState(stamp(EPOCH), "Lift1", ("L1", "L3"), "L1")


def ride(through: bool = False) -> RideScenario:
    return RideScenario("Lift1", ("L1", "L3"), 1, 60.0, through=through)


def said_by_the_judge(world: World) -> list[tuple[str, d.Message]]:
    said: list[tuple[str, d.Message]] = []

    def watch(speaker: str, topic: topics.AnyTopic, message: d.Message) -> None:
        if speaker == "judge":
            said.append((topic.name, message))

    world.air.watch = watch
    return said


class Held(RightLift):
    def __init__(self) -> None:
        super().__init__()
        self.session = self.target = "fleet/red"
        self.target = "L1"


class Burning(RightLift):
    def __init__(self) -> None:
        super().__init__()
        self.mode = 3


@pytest.mark.parametrize(
    ("node", "why"),
    [
        (
            Held(),
            "'Lift1' is not idle: car at L1, door open, mode AGV, destination L1, held by fleet/red",
        ),
        (Burning(), "'Lift1' is not idle: car at L1, door closed, mode FIRE"),
    ],
)
def test_a_lift_that_is_not_idle_is_left_alone(node: RightLift, why: str) -> None:
    world = World()
    said = said_by_the_judge(world)
    world.add(node)
    judging = world.judge("lift", "Lift1", ride())
    assert (judging.note, said) == (why, [])


def test_a_floor_that_is_not_served_is_not_ridden_to() -> None:
    world = World()
    world.add(RightLift())
    judging = world.judge("lift", "Lift1", RideScenario("Lift1", ("L1", "L9"), 1, 60.0))
    assert judging.note == "the lift does not serve 'L9': it serves 'L1', 'L2', 'L3'"


def test_a_device_that_is_not_there_is_waited_for_a_while_and_not_played_with() -> None:
    world = World()
    said = said_by_the_judge(world)
    judging = world.judge("lift", "Lift1", ride())
    assert (judging.done, said, world.timeline.now) == (True, [], 15.0)


def test_another_speaker_stops_the_play_before_it_begins() -> None:
    judging = JudgeRun(
        Judge("lift", "Lift1"), ride(), 60.0, lambda: "others publish on lift_requests"
    )
    judging.begin(0.0, EPOCH)
    judging.hear(Heard(1.0, EPOCH + 1.0, "lift_states", STATE))
    assert judging.turn(4.0, EPOCH + 4.0) == []
    assert (judging.done, judging.note) == (True, "others publish on lift_requests")


PLAYS: list[tuple[RightLift | RightDoor | RightCharger, Scenario]] = [
    (RightLift(), ride()),
    (RightDoor(), PassageScenario("ward", 3, 60.0)),
    (RightCharger(), ChargeScenario("bay1", "fleet/red", "r1", 20.0)),
]


@pytest.mark.parametrize(("node", "scenario"), PLAYS)
def test_an_interrupted_play_lets_the_device_go(
    node: RightLift | RightDoor | RightCharger, scenario: Scenario
) -> None:
    world = World()
    world.add(node)
    kinds = {"Lift1": "lift", "ward": "door", "bay1": "charger"}
    said: list[str] = []

    def interrupt(judging: JudgeRun) -> None:
        def stop() -> None:
            said.extend(topic.name for topic, _ in judging.stop())

        world.timeline.at(9.0, stop)

    judging = world.judge(kinds[node.name], node.name, scenario, also=interrupt)  # type: ignore[arg-type]
    assert judging.note == "interrupted"
    assert said
    assert judging.done


def test_a_ride_that_another_robot_takes_ends_with_our_own_end_only() -> None:
    """During the judge's ride, the lift gives the session to another robot. Check that the judge then
    ends only its own session."""
    world = World()
    said = said_by_the_judge(world)
    node = RightLift()
    world.add(node)

    def steal() -> None:
        node.session = "fleet/red"

    world.timeline.at(9.0, steal)
    judging = world.judge("lift", "Lift1", ride())
    assert judging.note == "'fleet/red' has the lift now"
    after = [m for _, m in said if isinstance(m, d.LiftRequest)][-2:]
    assert {(m.session_id, m.request_type) for m in after} == {("rmf_bridge_judge/robot1", 0)}
    assert node.session == "fleet/red"


def test_through_a_supervisor_only_the_adapters_are_played() -> None:
    world = World()
    said = said_by_the_judge(world)
    from workbench.rmf_model.supervisors import LiftSupervisor

    world.add(RightLift(), LiftSupervisor())
    judging = world.judge("lift", "Lift1", ride(through=True))
    assert (told(judging, world.timeline.now)["broken"], judging.note) == (set(), "")
    assert {topic for topic, _ in said} == {"adapter_lift_requests"}


# ---- nonsense


def judged(*messages: d.Message, kind: str = "lift", step_s: float = 0.5) -> Judge:
    judge = Judge(kind, "Lift1")  # type: ignore[arg-type]
    for n, message in enumerate(messages):
        topic = topics.LIFT_STATES if isinstance(message, d.LiftState) else topics.LIFT_REQUESTS
        judge.hear(Heard(n * step_s, EPOCH + n * step_s, topic.name, message))
    return judge


def test_ten_thousand_made_up_lifts_and_requesters_are_bounded() -> None:
    judge = judged(
        *(replace(STATE, lift_name=f"Lift{n}") for n in range(10_000)),
        *(lift(f"fleet/{n}", "L1") for n in range(10_000)),
        *(lift(f"fleet/{n}", "L1", "Lift2") for n in range(10_000)),
        *(lift(f"fleet/{n}", "", kind=0) for n in range(10_000)),
        *(lift("fleet/red", f"L{n}") for n in range(10_000)),
    )
    history = judge.history
    sizes = [len(getattr(history, name)) for name in ("others", "asks", "elsewhere", "ended")]
    assert max(sizes) <= 200
    assert len(history.asks["fleet/red"].floors) == 8  # type: ignore[attr-defined]


def test_names_of_the_network_are_shown_on_one_line_and_never_as_they_are() -> None:
    evil = "\x1b[2J\n<&\x00]]>" + "x" * 100_000
    judge = judged(STATE, replace(STATE, lift_name=evil), replace(STATE, current_floor=evil))
    found = report(judge, judge.end(2.0, EPOCH + 2.0), 2.0)
    shown = text(found, 120)
    assert "\x1b" not in shown
    assert max(map(len, shown.splitlines())) < 300
    assert "\x00" not in junit(found)
    assert "&lt;&amp;" in junit(found)
    assert len(as_json(found)) < 20_000


@pytest.mark.parametrize("name", ["Lift1", "\x1b[31m<Lift>"])
def test_a_device_that_was_not_heard_is_reported_with_what_was_heard_instead(name: str) -> None:
    judge = Judge("lift", name)
    judge.hear(Heard(0.0, EPOCH, "lift_states", replace(STATE, lift_name="Lift\n2")))
    found = report(judge, judge.end(3.0, EPOCH + 3.0), 3.0)
    assert text(found, 80).endswith(": no state heard in 3 s; heard: 'Lift\\n2'")
    assert {law.verdict for law in found.judged} == {Verdict.NOT_SEEN}


def test_a_clock_that_steps_an_hour_back_and_forth_accuses_nobody() -> None:
    steps = [0.0, 0.0, 3600.0, 3600.0, -3600.0, -3600.0, 0.0, 0.0]
    states = [replace(STATE, lift_time=stamp(EPOCH + n + s)) for n, s in enumerate(steps * 2)]
    assert not judged(*states, step_s=1.0).broken


def test_two_nodes_with_different_clocks_are_found_by_their_stamps() -> None:
    states = [replace(STATE, lift_time=stamp(EPOCH + n / 2 + 60.0 * (n % 2))) for n in range(20)]
    judge = judged(*states)
    found = {j.law.id for j in judge.verdicts() if j.verdict is Verdict.BROKEN}
    assert found == {"B0.one"}


def test_a_node_that_dies_in_the_middle_is_accused_of_silence_and_nothing_else() -> None:
    judge = judged(STATE, lift("fleet/red", "L1"), replace(STATE, session_id="fleet/red"))
    found = {j.law.id: j for j in judge.end(30.0, EPOCH + 30.0) if j.verdict is Verdict.BROKEN}
    assert list(found) == ["L2.rate"]
    assert found["L2.rate"].evidence[0].text == "no state for the last 29.0 s"


def test_a_node_that_comes_back_after_a_silence_may_have_forgotten_its_session() -> None:
    held = replace(STATE, session_id="fleet/red", lift_time=stamp(EPOCH + 1))
    judge = judged(STATE, lift("fleet/red", "L1"), held)
    back = replace(STATE, lift_time=stamp(EPOCH + 40))
    judge.hear(Heard(40.0, EPOCH + 40.0, "lift_states", back))
    broken = {j.law.id for j in judge.end(41.0, EPOCH + 41.0) if j.verdict is Verdict.BROKEN}
    assert broken == {"L2.rate"}


def test_a_request_before_the_first_state_does_no_harm() -> None:
    world = World()
    world.add(asks(0.5, "fleet/red", "L3"), RightLift())
    assert told(world.judge("lift", "Lift1", for_s=20.0), 20.0)["broken"] == set()
