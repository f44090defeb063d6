"""The laws of dispensers and ingestors for correct nodes in trouble. The network loses results, the
node restarts or does not know an outcome, or a guid names a second request. The judge convicts none of
these nodes."""

import logging
from collections.abc import Iterable
from typing import Any

import pytest

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard, Sender
from tests.kinds.dispenser.test_stories import finished, over
from tests.kinds.dispenser.world import EPOCH, NAME, World
from tests.workbench.judge.workcell_stories import (
    ACKNOWLEDGED,
    FAILED,
    SUCCESS,
    Line,
    WorkcellLines,
)
from workbench.judge.judge import Judge
from workbench.judge.law import JudgedLaw, Verdict

OF = WorkcellLines("dispenser")
OFFLINE = 2
SERVED = [OF.state(0.0), OF.ask(0.1), OF.state(0.2, "a", mode=1), OF.result(0.3, ACKNOWLEDGED)]
LISTED = [*SERVED, *OF.states(4.0, "a", begin=1.0)]
REPEATED = [OF.ask(n + 0.1) for n in range(1, 12)]


def judged(lines: Iterable[Line], law: str) -> JudgedLaw:
    judge = Judge("dispenser", "store", only=[law])
    told = sorted(lines, key=lambda line: line[0])
    for at, topic, message in told:
        judge.hear(Heard(at, at, topic.name, message))
    [found] = judge.end(told[-1][0], told[-1][0])
    return found


def verdict(lines: Iterable[Line], law: str = "W2.done") -> str:
    return judged(lines, law).verdict.value


def blind(at: float) -> Line:
    """Return a state of a node that knows nothing of its requests. RMF ignores it."""
    return at, topics.DISPENSER_STATES, d.DispenserState(d.Time(), "store", OFFLINE)


def dropped(at: float, guid: str, *, asks: bool = True) -> list[Line]:
    """Return messages in which a request leaves the queue without a result."""
    begins = [OF.ask(at, guid), OF.state(at + 0.1, guid), OF.result(at + 0.2, ACKNOWLEDGED, guid)]
    begins += [OF.state(at + n, guid) for n in range(1, 6)]
    repeats = [OF.ask(at + n, guid) for n in range(1, 6)] if asks else []
    return [*begins, *repeats, *OF.states(at + 8.0, begin=at + 5.5)]


def test_a_result_may_have_been_sent_in_a_pause() -> None:
    assert verdict([*LISTED, *REPEATED[:4], *OF.states(20.0, begin=8.0)]) == "not seen"
    acknowledged = [OF.state(0.0), OF.result(0.3, ACKNOWLEDGED), *OF.states(20.0, begin=9.0)]
    assert verdict(acknowledged, "W2.lists") == "not seen"


@pytest.mark.parametrize(("later_s", "found"), [(60.0, "broken"), (700.0, "not seen")])
def test_only_two_results_that_are_missing_within_ten_minutes_are_a_breach(
    later_s: float, found: str
) -> None:
    between = OF.states(later_s - 1.0, begin=10.0)
    lines = [OF.state(0.0), *dropped(1.0, "a"), *between, *dropped(later_s, "b")]
    assert verdict(lines) == found


def test_requests_that_rmf_no_longer_repeats_may_leave_the_queue() -> None:
    given_up = [OF.state(0.0), *dropped(1.0, "a", asks=False), *dropped(10.0, "b", asks=False)]
    assert verdict(given_up) == "not seen"


@pytest.mark.parametrize("at", [10.0, 60.0])
def test_a_success_does_not_hide_a_request_that_left_without_a_result(at: float) -> None:
    proper = [*SERVED, OF.result(1.1, SUCCESS), *OF.states(at - 1.0, begin=1.2)]
    assert verdict(proper) == "kept"
    assert (
        verdict([*proper, *dropped(at, "b"), *OF.states(at + 20.0, begin=at + 9.0)]) == "not seen"
    )
    later = OF.states(at + 700.0, begin=at + 9.0)
    assert verdict([*proper, *dropped(at, "b"), *later]) == "not seen"


def test_a_state_that_rmf_ignores_drops_no_request() -> None:
    other = [OF.ask(0.15, "b"), OF.state(0.35, "a", "b"), OF.result(0.4, ACKNOWLEDGED, "b")]
    two = [*SERVED, *other, *OF.states(4.0, "a", "b", begin=1.0), *REPEATED]
    two += [OF.ask(n + 0.2, "b") for n in range(1, 12)]
    later = OF.states(12.0, "a", "b", begin=6.0)
    assert verdict([*two, blind(5.0), *later]) == "not seen"
    assert verdict([*two, OF.state(5.0, read_at=3.0), *later]) == "not seen"
    assert verdict([*two, OF.state(5.0), *later]) == "broken"


def test_a_node_that_is_down_or_offline_need_not_repeat_its_result() -> None:
    asked = [*SERVED, *REPEATED]
    down = [*OF.states(3.0, "a", begin=1.0), *OF.states(14.0, "a", begin=12.5)]
    assert verdict([*asked, *down], "W3.repeats") == "not seen"
    heard = [*SERVED, *REPEATED[:3], *OF.states(14.0, "a", begin=1.0)]  # RMF has heard a result
    assert verdict(heard, "W3.repeats") == "not seen"
    offline = [OF.state(float(n), "a", mode=OFFLINE) for n in range(1, 14)]
    assert verdict([*asked, *offline], "W3.repeats") == "not seen"
    assert verdict([*asked, *OF.states(14.0, "a", begin=1.0)], "W3.repeats") == "broken"


def test_only_a_request_between_two_results_shows_that_the_node_repeats() -> None:
    twice = [*SERVED, OF.result(0.4, ACKNOWLEDGED), *OF.states(4.0, "a", begin=1.0)]
    assert verdict(twice, "W3.repeats") == "not seen"
    found = judged([*SERVED, OF.ask(1.1), OF.result(1.2, ACKNOWLEDGED)], "W3.repeats")
    assert (found.verdict, found.times) == (Verdict.KEPT, 1)  # the end of the judgement adds none


@pytest.mark.parametrize(("silent_s", "found"), [(2.0, "broken"), (60.0, "not seen")])
def test_a_guid_that_comes_again_after_a_silence_names_a_new_request(
    silent_s: float, found: str
) -> None:
    first = [*SERVED, OF.result(1.5, SUCCESS), *OF.states(1.5 + silent_s, begin=2.0)]
    again = [OF.ask(1.5 + silent_s), OF.result(1.7 + silent_s, ACKNOWLEDGED)]
    assert verdict([*first, *again], "W3.result") == found
    failed = [*first, OF.ask(1.5 + silent_s), OF.result(1.7 + silent_s, FAILED)]
    assert verdict(failed, "W3.result") == found


class JudgedWorld(World):
    """The project's own daemon, with a judge that hears each message."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.judge = Judge("dispenser", NAME)

    def _arrives(self, topic: str, message: d.Message) -> None:
        self._told(topic, message, "/rmf")
        super()._arrives(topic, message)

    def _publish(self, topic: Any, message: d.Message) -> bool:
        self._told(topic.name, message, "/store")
        return super()._publish(topic, message)

    def _told(self, topic: str, message: d.Message, node: str) -> None:
        self.judge.hear(Heard(self.now, EPOCH + self.now, topic, message, Sender(node)))

    def broken(self) -> set[str]:
        found = self.judge.end(self.now, EPOCH + self.now)
        return {one.law.id for one in found if one.verdict is Verdict.BROKEN}


@pytest.mark.parametrize("story", ["dies", "out of reach", "memory lost", "same guid", "again"])
def test_our_dispenser_is_not_convicted_while_an_outcome_is_in_doubt(
    story: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.CRITICAL)
    world = JudgedWorld(new=story != "memory lost")
    world.decide("again")
    if story in ("same guid", "again"):
        finished(world)
        world.run(301.0)
    world.run(1.0)
    if story in ("out of reach", "memory lost"):
        world.plant.fail("conveyor", "stuck")
    phase = world.ask()
    world.run(2.0)
    if story == "again":
        world.decide("again")
        world.run(10.0, until=over(phase)).run(2.0)
        assert (phase.outcome, world.broken()) == ("completed", set())
        return
    if story != "same guid":
        world.ask("another")
        world.kill()
    if story == "memory lost":
        world.disk.content = None
    world.far.down = "no answer" if story == "out of reach" else ""
    world.run(9.0)
    assert "OUTCOME_UNKNOWN" in world.faults
    assert world.broken() == set()
