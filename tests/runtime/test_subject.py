"""A subject's log lines, its status and its counts."""

import logging

import msgspec
import pytest

from bridges.kinds.shared.decision import Decision, Fault
from bridges.messages.definitions import Message
from bridges.messages.topics import Topic
from bridges.runtime.clock import Clock
from bridges.runtime.refusals import Refusals
from bridges.runtime.subject import Subject, SubjectCore


class Seen(msgspec.Struct, frozen=True):
    """A report of a number. It counts as news only if the number has become even or odd."""

    number: int
    faults: tuple[Fault, ...] = ()
    read_at: float | None = 1.0

    def news(self) -> object:
        return self.number % 2


def decide(memory: int, event: Seen, now: float) -> Decision[int, None, Seen]:
    return Decision(memory + 1, None, event, now + 1.0, "odd" if event.number % 2 else "")


def subject(by_code: bool) -> tuple[Subject[int, Seen, None, Seen], Refusals]:
    def identity(fault: Fault) -> object:
        return fault.code if by_code else fault

    def publish(topic: Topic[Message], message: Message) -> None:
        raise AssertionError("nothing may be published")

    core = SubjectCore(
        "device", decide, lambda report, now: {"number": str(report.number)}, identity
    )
    refusals = Refusals()
    clock = Clock(lambda: 3.0, lambda: 1e6)
    return Subject("A", 0, core, publish, refusals, clock), refusals


def test_a_state_is_logged_when_its_news_changes_and_a_refusal_the_first_time(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO)
    one, refusals = subject(by_code=True)
    for number in (0, 2, 3, 5, 4):
        one.log(one.decide(Seen(number)).report)
    assert [r.getMessage() for r in caplog.records if "state" in r.getMessage()] == [
        "state device=A number=0",
        "state device=A number=3",
        "state device=A number=4",
    ]
    assert sum("refused device=A kind=odd" in r.getMessage() for r in caplog.records) == 1
    assert (refusals.counts(), one.memory, one.wake_at) == ({"odd": 2}, 5, 4.0)


@pytest.mark.parametrize(
    ("by_code", "lines"),
    [
        (True, ["fault device=A code=LOST detail=1", "fault_over device=A code=LOST detail=2"]),
        (
            False,
            [
                "fault device=A code=LOST detail=1",
                "fault device=A code=LOST detail=2",
                "fault_over device=A code=LOST detail=1",
                "fault_over device=A code=LOST detail=2",
            ],
        ),
    ],
)
def test_a_fault_is_logged_when_it_comes_and_when_it_goes(
    by_code: bool, lines: list[str], caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    one, _ = subject(by_code)
    for detail in ("1", "1", "2", ""):
        faults = (Fault("LOST", detail),) if detail else ()
        one.log(one.decide(Seen(0, faults)).report)
    told = [r.getMessage() for r in caplog.records]
    assert [line for line in told if line.startswith("fault")] == lines


def test_the_status_is_what_was_decided_last_with_its_age() -> None:
    one, _ = subject(by_code=True)
    assert one.status() == {}
    one.decide(Seen(8, (Fault("LOST", "a wire"),)))
    assert one.status() == {
        "number": "8",
        "faults": [{"code": "LOST", "detail": "a wire"}],
        "input_age_s": 2.0,
    }
