"""The laws for a node that publishes alarms. For each law, one story gives the verdict "not seen", one
"kept", and one "broken".

Several nodes may publish one alarm. Each node that could be at fault has a story in which only that
node is blamed.
"""

from collections.abc import Iterable

import pytest

from bridges.kinds.shared import alarming
from bridges.kinds.shared.fleet_alarm_memory import (
    FleetAlarmReport,
)
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard, Sender
from bridges.messages.stamps import stamp
from bridges.runtime.diagnostics import diagnosis
from workbench.judge.judge import LAWS, Judge

NODES = {name: Sender(f"/{name}") for name in ("panel", "lift", "desk")}


def says(at: float, on: bool, node: str = "panel", *fleets: str) -> Heard:
    """Return an alarm message of this node. With the name "", the message does not show which node sent
    it."""
    if fleets:
        message = d.EmergencySignal(fleets, on)
        return Heard(at, at, topics.EMERGENCY_SIGNAL.name, message, NODES.get(node))
    return Heard(at, at, topics.FIRE_ALARM_TRIGGER.name, d.Bool(on), NODES.get(node))


def states(at: float, state: str, node: str = "panel", *fleets: str) -> Heard:
    report = FleetAlarmReport(state)
    status = {"alarm": alarming.statement(report, frozenset(fleets))}
    told = diagnosis(node, "alarm", status, {}, stamp(at))
    return Heard(at, at, topics.DIAGNOSTICS.name, told, NODES[node])


def stating(state: str, begin: int, end: int, node: str = "panel") -> list[Heard]:
    """Return one diagnostics message for each second. In this message, the node states whether it has
    an alarm."""
    return [states(float(at), state, node) for at in range(begin, end)]


def judged(lines: Iterable[Heard], node: str = "panel") -> dict[str, str]:
    """Return the verdict on each law."""
    judge = Judge("alarm", node)
    told = sorted(lines, key=lambda line: line.at)
    for line in told:
        judge.hear(line)
    last = told[-1].at
    return {one.law.id: one.verdict.value for one in judge.end(last, last)}


def retained(*retaining: str) -> dict[str, str]:
    judge = Judge("alarm", "/panel")
    judge.hear(states(0.0, "quiet"))
    for _ in range(2):
        judge.alarm_ends(["/panel", "/lift"], retaining, 1.0, 1.0)
    return {one.law.id: one.verdict.value for one in judge.end(2.0, 2.0)}


ALARM = [*stating("quiet", 0, 2), says(1.5, True), *stating("alarm", 2, 8)]
OVER = [*ALARM, says(8.5, False), *stating("quiet", 9, 14)]
LIFTS = [states(0.0, "quiet", "lift"), says(1.0, True, "lift"), *stating("alarm", 1, 12, "lift")]
STORIES: dict[str, tuple[list[Heard], list[Heard], list[Heard]]] = {
    "A1.false": (
        [says(1.0, False), says(2.0, True)],
        [says(1.0, True), says(2.0, False)],
        [says(1.0, False), says(2.0, False), says(3.0, False)],
    ),
    "A1.others": (
        [says(1.0, True), says(2.0, False)],
        [says(0.5, True, "lift"), says(1.0, False, "lift"), says(1.0, True), says(9.0, False)],
        [*LIFTS, says(5.0, True), says(6.0, False), states(13.0, "quiet")],
    ),
    "A1.fleets": (
        [says(1.0, True, "panel", "x"), says(2.0, False, "lift", "y")],
        [says(1.0, True, "panel", "x", "y"), says(2.0, False, "panel", "y", "x", "z")],
        [
            *(says(1.0, True, "panel", "x", "y"), says(2.0, False, "panel", "y")),
            *stating("quiet", 3, 8),
        ],
    ),
    "A2.told": (
        stating("alarm", 0, 9),
        ALARM,
        [*OVER, *stating("alarm", 14, 20)],
    ),
    "A2.again": (
        ALARM,
        [*ALARM, says(3.2, False, "desk"), says(3.3, True)],
        [*ALARM, says(3.2, False, "desk")],
    ),
    "A2.ends": (ALARM, OVER, [*ALARM, *stating("quiet", 8, 14)]),
}


@pytest.mark.parametrize("law", STORIES)
def test_a_law_needs_its_occasion(law: str) -> None:
    assert [judged(story)[law] for story in STORIES[law]] == ["not seen", "kept", "broken"]


def test_a_publisher_that_retains_nothing_is_found_by_its_name() -> None:
    found = [one["A3.retained"] for one in (judged(ALARM), retained("/panel"), retained("/lift"))]
    assert found == ["not seen", "kept", "broken"]


def test_every_law_has_its_stories() -> None:
    assert [*STORIES, "A3.retained"] == [law.id for law in LAWS["alarm"]]


def broken(lines: Iterable[Heard], node: str) -> set[str]:
    return {law for law, verdict in judged(lines, node).items() if verdict == "broken"}


def test_of_two_nodes_only_the_one_that_ends_the_others_alarm_is_blamed() -> None:
    """The lift must repeat its alarm after the other node has ended it, and the lift does so."""
    ended = [*LIFTS, says(5.0, False, "desk"), says(5.1, True, "lift")]
    assert broken(ended, "desk") == {"A1.others"}
    assert broken(ended, "lift") == set()


def test_a_node_that_does_not_repeat_its_alarm_is_blamed_beside_the_one_that_ended_it() -> None:
    ended = [*LIFTS, says(5.0, False, "desk")]
    assert (broken(ended, "desk"), broken(ended, "lift")) == ({"A1.others"}, {"A2.again"})


def test_after_a_third_nodes_false_nobody_else_is_blamed_for_the_end() -> None:
    """ "panel" and "lift" publish no diagnostics. The first `false` ends such an alarm, because RMF's
    robots then drive again."""
    alarm = [says(0.5, True, "lift"), says(1.0, True), says(5.0, False, "desk")]
    assert broken([*alarm, says(9.0, False)], "panel") == set()
    assert broken([*alarm, says(9.0, False)], "desk") == {"A1.others"}


@pytest.mark.parametrize(
    ("dies_at", "blamed"), [(26, set()), (28, {"A1.others"}), (62, {"A1.others"})]
)
def test_a_false_ends_the_alarm_of_a_node_that_has_died_before(
    dies_at: int, blamed: set[str]
) -> None:
    """ "lift" states an alarm and dies. A person resets at the desk, and later at the panel."""
    lifts = [says(1.0, True, "lift"), *stating("alarm", 1, dies_at, "lift")]
    panels = [says(1.5, True), *stating("alarm", 2, 60), says(30.2, True), says(60.0, False)]
    lines = [*lifts, *panels, says(29.5, False, "desk"), *stating("quiet", 61, 70)]
    assert broken(lines, "panel") == blamed
    assert broken(lines, "desk") == {"A1.others"}  # the panel's alarm goes on


def test_two_nodes_may_end_one_alarm_together() -> None:
    both = [*LIFTS[:6], says(1.5, True), says(5.0, False), says(5.2, False, "lift")]
    both += stating("quiet", 6, 14, "lift")
    assert (broken(both, "panel"), broken(both, "lift")) == (set(), set())


def test_what_the_wire_hides_is_nobodys_fault() -> None:
    """If a message does not show its sender, the judged node may have sent it."""
    hidden = [*stating("quiet", 0, 2), says(1.5, True, ""), *stating("alarm", 2, 8)]
    hidden += [says(8.5, False, ""), *stating("quiet", 9, 14)]
    found = judged(hidden)
    assert set(found.values()) == {"not seen"}
    assert broken([*OVER[:9], says(8.5, False, ""), *stating("quiet", 9, 14)], "panel") == set()


def test_a_statement_that_crosses_its_message_breaks_no_law() -> None:
    """Two messages of one node on different topics may arrive in the other order."""
    begins = [
        *stating("quiet", 0, 2),
        says(1.9, True),
        states(2.0, "quiet"),
        *stating("alarm", 3, 9),
    ]
    ends = [says(9.9, False), states(10.0, "alarm"), *stating("quiet", 11, 15)]
    assert broken([*begins, *ends], "panel") == set()
    others = [*stating("quiet", 0, 9, "lift"), says(9.95, False, "lift")]
    later = [states(20.4, "alarm"), says(20.5, True), *stating("alarm", 21, 30)]
    assert broken([*begins, *ends, *others, *later], "panel") == set()


def test_a_listener_that_came_late_knows_no_beginning_of_the_alarm() -> None:
    late = [line for line in OVER if line.at >= 3.0]
    assert set(judged(late).values()) <= {"not seen", "kept"}
    ended = [*late[:5], says(3.2, False, "desk")]
    assert broken(ended, "panel") == {"A2.again"}
    assert judged([*ended, says(3.3, True)])["A2.again"] == "kept"


def test_an_alarm_of_another_building_may_end() -> None:
    lift = [says(0.5, True, "lift", "y"), *(states(n, "alarm", "lift", "y") for n in range(1, 9))]
    ours = [says(1.0, True, "panel", "x"), says(5.0, False, "panel", "x")]
    assert broken([*lift, *ours], "panel") == set()


FLEETS = ("w", "x", "y", "z")


def test_an_alarm_may_end_fleet_by_fleet() -> None:
    begins = [says(1.0 + n / 100, True, "panel", fleet) for n, fleet in enumerate(FLEETS)]
    ends = [says(9.0 + n, False, "panel", fleet) for n, fleet in enumerate(FLEETS)]
    one_by_one = judged([*begins, *ends, *stating("quiet", 14, 20)])
    assert (one_by_one["A1.false"], one_by_one["A1.fleets"]) == ("kept", "kept")
    assert broken(ends, "panel") == set()  # the listener has missed each `true`
    together = [says(1.0, True, "panel", *FLEETS), *ends, *stating("quiet", 14, 20)]
    assert judged(together)["A1.fleets"] == "kept"
    everywhere = [*stating("alarm", 0, 9), says(1.0, True), *ends, *stating("quiet", 14, 20)]
    found = judged(everywhere)
    assert {found[law] for law in ("A1.fleets", "A2.ends")} == {"not seen"}


def test_a_false_for_other_fleets_leaves_the_alarm_standing() -> None:
    named = [*stating("quiet", 0, 2), says(1.5, True, "panel", "x", "y"), *stating("alarm", 2, 8)]
    quiet = stating("quiet", 9, 14)
    assert broken([*named, says(8.5, False, "desk", "x"), *quiet], "panel") >= {"A2.ends"}
    assert broken([*named, says(8.5, False, "panel", "x"), *quiet], "panel") >= {"A2.ends"}
    both = [*named, says(8.5, False, "panel", "x"), says(8.6, False, "desk", "y")]
    assert judged([*both, *quiet])["A2.ends"] == "kept"
    everywhere = [*ALARM, says(7.5, False, "desk", "y"), says(7.6, True), *quiet]
    assert judged(everywhere)["A2.ends"] == "broken"


def test_a_true_for_other_fleets_does_not_repeat_the_alarm() -> None:
    named = [*stating("quiet", 0, 2), says(1.5, True, "panel", "x", "y"), *stating("alarm", 2, 9)]
    freed = [*named, says(3.2, False, "desk", "x")]
    assert judged([*freed, says(3.3, True, "panel", "y")])["A2.again"] == "broken"
    assert judged([*freed, says(3.3, True, "panel", "x")])["A2.again"] == "kept"
    one_by_one = [says(3.3, True, "panel", "x"), says(3.4, True, "panel", "y")]
    assert judged([*named, says(3.2, False, "desk"), *one_by_one])["A2.again"] == "kept"
    everywhere = [*ALARM, says(3.2, False, "desk"), *one_by_one]
    assert judged(everywhere)["A2.again"] == "not seen"


def test_a_node_need_not_answer_a_false_whose_sender_or_order_nobody_knows() -> None:
    hidden = [*stating("quiet", 0, 2), says(1.5, True, ""), *stating("alarm", 2, 12)]
    hidden += [says(5.2, False, ""), says(5.3, True, "")]
    assert set(judged(hidden).values()) == {"not seen"}
    answered = [*ALARM, says(3.2, False, "desk"), says(3.3, True, "")]
    assert judged(answered)["A2.again"] == "not seen"
    retained = [*stating("alarm", 0, 8), says(0.1, True), says(0.15, False, "desk")]
    assert set(judged([*retained, *stating("quiet", 8, 14)]).values()) == {"not seen"}


def test_a_true_that_has_been_ended_tells_of_no_second_alarm() -> None:
    first = [*ALARM, says(8.4, False, "desk"), *stating("quiet", 9, 12)]
    assert judged([*first, *stating("alarm", 12, 18)])["A2.told"] == "broken"
    assert judged([*first, says(11.9, True), *stating("alarm", 12, 18)])["A2.told"] == "kept"


def test_a_recording_may_lack_the_alarms_topic() -> None:
    lines = [*stating("quiet", 0, 2), *stating("alarm", 2, 8)]
    assert judged(lines)["A2.told"] == "not seen"
    live = Judge("alarm", "panel", only=["A2.told"])
    live.alarm_ends([], [], 0.0, 0.0)
    for line in lines:
        live.hear(line)
    assert live.broken


def test_the_end_of_the_judgement_checks_no_message_again() -> None:
    judge = Judge("alarm", "panel", only=["A1.false"])
    for at in (1.0, 2.0, 3.0):
        judge.hear(says(at, False))
    [found] = judge.end(3.0, 3.0)
    assert (found.times, len(found.evidence)) == (1, 1)
