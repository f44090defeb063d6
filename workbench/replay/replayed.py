"""Replay a recording. The core of this version decides again on the recorded events. Each new decision
is compared with the recorded decision.

A core is the part of a daemon that decides. It is a pure function of its memory, an event, the time and
its limits. A recording has the initial memory and every event. Therefore a decision differs, even by a
bit, only if the core or its limits have changed.
"""

import struct
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from bridges.blackbox.entries import (
    LATEST_S,
    AnyEntry,
    Clocks,
    Decided,
    Head,
    Known,
    Published,
    Same,
    SubjectForgotten,
)
from bridges.blackbox.value_codec import Tree, UnknownValue, first_difference, tree
from bridges.kinds import kind_called
from bridges.kinds.shared.decision import Decision, IoFailed, Sampled
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.settings.config import Config
from bridges.settings.fleet_site import limits_of
from bridges.settings.load import understood
from bridges.system.log import plain
from drivers.profiles import texts
from workbench.replay.typed import typed, types_of

AnyDecision = Decision[Any, Any, Any]
Parts = tuple[str, Tree, Tree]
"""A part of a decision that differs: the part's name, its recorded value, and today's value."""
CONTEXT: Final = 6
"""Number of events that the report shows before a difference."""
PARTS: Final = ("outputs", "news", "refused")
"""Parts of a decision that are visible outside the core. If a replay tries out other limits, only these
parts are compared."""
LASTING: Final = ("outputs", "news", "faults")
"""Parts of a decision that stay in force until a later decision changes them."""


@dataclass(frozen=True, slots=True)
class ReplayedCore:
    """The core of one subject (a device, or a node without devices), with the subject's limits. `types`
    is the result of `typed.types_of`."""

    decide: Callable[[Any, Any, float], Any]
    published: Callable[[Any, Any], Any]
    types: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Difference:
    """A decision that differs.

    - `wall`: the time of the decision (s since the epoch).
    - `what`: the part that differs.
    - `before`: the last events up to this decision, each with its time, in words.
    """

    subject: str
    wall: float
    what: str
    recorded: Tree
    today: Tree
    before: tuple[tuple[float, str], ...]


@dataclass(slots=True)
class Course:
    """Progress of a replay.

    - `decisions`: number of decisions compared.
    - `unusable`: number of entries of subjects whose initial memory was not recorded.
    - `subjects`: the subjects that can be replayed.
    - `others`: the subjects that the settings do not contain.
    - `began`, `ended`: times (s since the epoch).
    """

    decisions: int = 0
    unusable: int = 0
    subjects: set[str] = field(default_factory=set)
    others: set[str] = field(default_factory=set)
    began: float = 0.0
    ended: float = 0.0
    offset_s: float = 0.0

    def reach(self, entry: AnyEntry) -> None:
        """Note the time of an entry."""
        if isinstance(entry, Clocks):
            self.offset_s = entry.wall - entry.at
        self.ended = entry.at + self.offset_s
        self.began = self.began or self.ended


def of_head(head: Head) -> Config:
    """Return a daemon's settings. Raises SettingsError if today's rules refuse these settings."""
    texts.give(head.texts)
    return understood(head.file, head.yaml)


class ReplayedCores:
    """The cores of a daemon, made from the daemon's settings."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._kind = kind_called(config.kind)
        self._made: dict[str, ReplayedCore | None] = {}

    def of(self, subject: str) -> ReplayedCore | None:
        """Return a subject's core. Return None if the settings have no such device."""
        if subject not in self._made:
            self._made[subject] = self._make(subject)
        return self._made[subject]

    def _make(self, subject: str) -> ReplayedCore | None:
        config, kind = self._config, self._kind
        if isinstance(kind, GraphKind):
            limits = kind.limits(config.section)
            return ReplayedCore(
                _with(kind.decide, limits), lambda memory, report: memory, types_of(kind.decide)
            )
        if subject not in config.devices:
            return None
        debounce = config.debounce(subject)
        limits = kind.limits(config.devices[subject], debounce)
        if kind.section:  # a fleet's limits come from RMF's files, which the recording contains
            limits = limits_of(config, subject, debounce)
        return ReplayedCore(_with(kind.decide, limits), kind.published, types_of(kind.decide))


def _with(decide: Callable[..., Any], limits: Any) -> Callable[[Any, Any, float], Any]:
    return lambda memory, event, now: decide(memory, event, now, limits)


class _Subject:
    """The replay of one subject. It repeats the subject's decisions, beginning with the recorded
    memory."""

    def __init__(self, core: ReplayedCore, known: Known) -> None:
        self._core = core
        self._memory = typed(known.memory, core.types["memory"])
        self._reading = typed(known.reading, core.types["event"] | None)
        self._report = typed(known.report, core.types["report"])
        self._outputs: object = typed(known.outputs, core.types["outputs"])
        self._news = self._report.news() if self._report else None
        self._recorded = _trees(self._outputs, self._report)
        self._standing: list[Parts] = []
        self.last: deque[tuple[float, object]] = deque(maxlen=CONTEXT)

    @property
    def has_decided(self) -> bool:
        """Return whether the subject has made a decision. Before its first decision, there is no
        reading to repeat and no report to publish."""
        return self._report is not None

    def memory(self) -> Tree:
        """Return the present memory, in the form that recordings use."""
        return tree(self._memory)

    def published(self) -> None:
        """Record that the report has been published."""
        self._memory = self._core.published(self._memory, self._report)

    def step(self, step: Decided) -> list[Parts]:
        """Decide on a recorded event. Return the parts that differ."""
        event = typed(step.event, self._core.types["event"])
        if type(event) in (Sampled, IoFailed):
            self._reading = event
        for part, new in (("outputs", step.outputs), ("news", step.news), ("faults", step.faults)):
            if new:
                self._recorded[part] = new[0]
        told = {"refused": step.refused, "publish": step.publish, "wake_at": step.wake_at}
        decision = self._decide(event, step.at)
        self._outputs, self._news = decision.outputs, decision.report.news()
        return self._compared(told, decision)

    def again(self, at: float) -> list[Parts]:
        """Let today's core decide on the last reading a second time. In the recording, an equal reading
        came at this time and changed nothing. Return the parts that differ from the recording."""
        outputs, news, report = self._outputs, self._news, self._report
        decision = self._decide(self._reading, at)
        if (
            decision.outputs == outputs
            and decision.report.faults == report.faults
            and decision.report.news() == news
            and not decision.refused
            and not decision.publish
        ):
            return self._standing
        self._outputs, self._news = decision.outputs, decision.report.news()
        return self._compared({"refused": "", "publish": []}, decision)

    def _compared(self, told: dict[str, Tree], decision: AnyDecision) -> list[Parts]:
        found = _differing(self._recorded | told, decision)
        self._standing = [parts for parts in found if parts[0] in LASTING]
        return found

    def _decide(self, event: object, at: float) -> AnyDecision:
        self.last.append((at, event))
        try:
            decision: AnyDecision = self._core.decide(self._memory, event, at)
        except Exception as error:  # never for a memory that this core itself has made
            why = f"{type(error).__name__}: {error}"
            raise UnknownValue(f"the core cannot decide on the recorded event: {why}") from error
        self._memory, self._report = decision.memory, decision.report
        return decision


def _trees(outputs: object, report: Any) -> dict[str, Tree]:
    if report is None:
        return {"outputs": None, "news": None, "faults": None}
    news, faults = tree(report.news()), tree(report.faults)
    return {"outputs": tree(outputs), "news": news, "faults": faults}


def _differing(recorded: dict[str, Tree], decision: AnyDecision) -> list[Parts]:
    today: dict[str, Tree] = {
        **_trees(decision.outputs, decision.report),
        "refused": decision.refused,
        "publish": [[topic.name, tree(message)] for topic, message in decision.publish],
        "wake_at": tree(decision.wake_at),
    }
    return [
        (part, was, today[part])
        for part, was in recorded.items()
        if today[part] != was and first_difference(was, today[part])
    ]


class Replay:
    """The replay of a recording. `course` is the progress."""

    def __init__(self, entries: Iterable[AnyEntry], cores: ReplayedCores) -> None:
        self.course = Course()
        self._entries = entries
        self._cores = cores
        self._subjects: dict[str, _Subject | None] = {}

    def differences(self) -> Iterator[Difference]:
        """Yield each subject's first difference in decision or memory."""
        for entry in self._entries:
            self.course.reach(entry)
            for at, found in self._played(entry, strict=True):
                if found:
                    yield self._difference(entry, at, found[0])
                    self._subjects[_name(entry)] = None
                    break

    def changes(self) -> Iterator[Difference]:
        """Yield the effects of other limits.

        An effect is a time at which outputs, state or refusal begin to differ from the recording. It is
        also a time at which they begin to differ in a new way. When the replay matches the recording
        again, today's value is None.
        """
        shown: dict[tuple[str, str], tuple[Tree, Tree]] = {}
        for entry in self._entries:
            self.course.reach(entry)
            for at, found in self._played(entry, strict=False):
                differing = {part: (was, now) for part, was, now in found}
                for part in PARTS:
                    both = apart(*differing.get(part, (None, None)))
                    key = (_name(entry), part)
                    if shown.get(key, (None, None)) != both:
                        shown[key] = both
                        yield self._difference(entry, at, (part, *both))

    def _difference(self, entry: AnyEntry, at: float, found: Parts) -> Difference:
        subject, offset_s = self._subjects[_name(entry)], self.course.offset_s
        last = subject.last if subject else ()
        words = tuple((when + offset_s, f"{_kind(event)} {plain(event)}") for when, event in last)
        return Difference(_name(entry), at + offset_s, *found, words)

    def _played(self, entry: AnyEntry, *, strict: bool) -> Iterator[tuple[float, list[Parts]]]:
        """Yield the time and the differences of each decision in an entry. With `strict`, compare
        memories too."""
        if isinstance(entry, Known):
            yield from self._known(entry, strict=strict)
        elif isinstance(entry, SubjectForgotten):
            self._subjects.pop(entry.subject, None)
        elif isinstance(entry, Decided | Same | Published):
            subject = self._subjects.get(entry.subject)
            if subject is not None and (isinstance(entry, Decided) or subject.has_decided):
                yield from self._decided(subject, entry)
            else:
                self.course.unusable += entry.subject not in self._subjects

    def _decided(
        self, subject: _Subject, entry: Decided | Same | Published
    ) -> Iterator[tuple[float, list[Parts]]]:
        if isinstance(entry, Published):
            subject.published()
        elif isinstance(entry, Decided):
            self.course.decisions += 1
            yield entry.at, subject.step(entry)
        else:
            for at in times(entry):
                self.course.decisions += 1
                yield at, subject.again(at)

    def _known(self, entry: Known, *, strict: bool) -> Iterator[tuple[float, list[Parts]]]:
        """Begin the replay of a new or restarted subject with the recorded memory. For any other
        subject, compare the replayed memory with the recorded memory."""
        name = entry.subject
        if entry.anew or name not in self._subjects:
            core = self._cores.of(name)
            self._subjects[name] = _Subject(core, entry) if core else None
            (self.course.subjects if core else self.course.others).add(name)
            return
        subject = self._subjects[name]
        if strict and subject and (found := first_difference(entry.memory, subject.memory())):
            place, was, now = found
            yield entry.at, [(f"memory {place}".strip(), was, now)]


def apart(was: Tree, now: Tree) -> tuple[Tree, Tree]:
    """Return only the elements that differ, if both values are lists of the same length. Otherwise
    return both values unchanged."""
    if not (isinstance(was, list) and isinstance(now, list) and len(was) == len(now)):
        return was, now
    pairs = [pair for pair in zip(was, now, strict=True) if pair[0] != pair[1]]
    return [one for one, _ in pairs], [other for _, other in pairs]


def _name(entry: AnyEntry) -> str:
    return getattr(entry, "subject", "")


def _kind(event: object) -> str:
    return type(event).__name__


def times(entry: Same) -> tuple[float, ...]:
    """Return the times at which a reading was repeated. Raises UnknownValue."""
    if len(entry.times) % 8:
        raise UnknownValue("not a list of times")
    found = struct.unpack(f"<{len(entry.times) // 8}d", entry.times)
    if not all(abs(at) < LATEST_S for at in found):
        raise UnknownValue("a time that no clock has")
    return found
