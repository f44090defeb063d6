"""What a ring already says of a subject, and the entries that say it."""

from typing import Any

from bridges.blackbox.entries import Decided, Known
from bridges.blackbox.value_codec import Tree, tree
from bridges.kinds.shared.decision import Decision

AnyDecision = Decision[Any, Any, Any]


class KnownSubject:
    """What is known of a subject. `times`: when the last reading came again, not yet in the ring."""

    def __init__(self, memory: object) -> None:
        self.memory = memory
        self.reading: object = None
        self.outputs: object = None
        self.report: Any = None
        self.news: object = None
        self.times: list[float] = []

    def is_as_before(self, event: object, decision: AnyDecision, news: object) -> bool:
        """Is this the last reading again, and did it change nothing?"""
        return (
            event == self.reading
            and decision.outputs == self.outputs
            and news == self.news
            and decision.report.faults == self.report.faults
            and not decision.refused
            and not decision.publish
        )


def known(name: str, subject: KnownSubject, now: float, *, anew: bool = False) -> Known:
    """The entry with all that a replay needs of a subject. `anew`: its memory is not what the last
    decision left."""
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
    """The entry of a decision: what has not changed is left out."""
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
