"""The subjects' states as the ring already holds them, and the entries that record the next states."""

from typing import Any

from bridges.blackbox.entries import Decided, Known
from bridges.blackbox.value_codec import Tree, tree
from bridges.kinds.shared.decision import Decision

AnyDecision = Decision[Any, Any, Any]


class KnownSubject:
    """The state of a subject as the ring holds it. `times`: the times of readings that were equal to
    the last reading, and are not yet in the ring."""

    def __init__(self, memory: object) -> None:
        self.memory = memory
        self.reading: object = None
        self.outputs: object = None
        self.report: Any = None
        self.news: object = None
        self.times: list[float] = []

    def is_as_before(self, event: object, decision: AnyDecision, news: object) -> bool:
        """Return whether the event repeats the last reading and nothing has changed."""
        return (
            event == self.reading
            and decision.outputs == self.outputs
            and news == self.news
            and decision.report.faults == self.report.faults
            and not decision.refused
            and not decision.publish
        )


def known(name: str, subject: KnownSubject, now: float, *, anew: bool = False) -> Known:
    """Return an entry from which a replay of the subject can start. `anew`: the memory does not come
    from the last recorded decision."""
    return Known(
        now,
        name,
        tree(subject.memory),
        tree(subject.reading),
        tree(subject.outputs),
        tree(subject.report),
        anew,
    )


def step(
    name: str,
    subject: KnownSubject,
    event: object,
    now: float,
    decision: AnyDecision,
    news: object,
) -> Decided:
    """Return the entry of a decision, without the values that have not changed."""
    faults, before = decision.report.faults, subject.report
    return Decided(
        now,
        name,
        tree(event),
        tree(decision.wake_at),
        decision.refused,
        [] if decision.outputs == subject.outputs else [tree(decision.outputs)],
        [] if news == subject.news else [tree(news)],
        [] if before and faults == before.faults else [tree(faults)],
        _said(decision),
    )


def _said(decision: AnyDecision) -> list[Tree]:
    return [[topic.name, tree(message)] for topic, message in decision.publish]
