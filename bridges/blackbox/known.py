"""The state of each subject that a ring already has, and the entries that record a state."""

from typing import Any

from bridges.blackbox.entries import Decided, Known
from bridges.blackbox.value_codec import Tree, tree
from bridges.kinds.shared.decision import Decision

AnyDecision = Decision[Any, Any, Any]


class KnownSubject:
    """A subject's recorded state. `times`: when the last reading was repeated, as far as the ring does
    not have these times yet."""

    def __init__(self, memory: object) -> None:
        self.memory = memory
        self.reading: object = None
        self.outputs: object = None
        self.report: Any = None
        self.news: object = None
        self.times: list[float] = []

    def is_as_before(self, event: object, decision: AnyDecision, news: object) -> bool:
        """Return whether the event only repeats the last reading, without any change."""
        return (
            event == self.reading
            and decision.outputs == self.outputs
            and news == self.news
            and decision.report.faults == self.report.faults
            and not decision.refused
            and not decision.publish
        )


def known(name: str, subject: KnownSubject, now: float, *, anew: bool = False) -> Known:
    """Return the entry from which a replay of a subject can start. `anew`: the subject's memory does
    not come from the last decision."""
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
    """Return the entry of a decision. Values that have not changed are left out."""
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
