"""A recording played again: today's core decides on what was recorded, and each decision is compared.

A core is a pure function of its memory, an event, the time and its limits. A recording has the memory
at its beginning and every event, so the decisions come out the same, to the bit, or the core or its
limits have changed.
"""

import struct
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Final

from bridges.core.graph_kind import GraphKind
from bridges.log import plain
from bridges.recording.entries import AnyEntry, Forgotten, Known, Same, Step, Told
from bridges.recording.trees import Tree, UnknownValue, tree, value
from bridges.settings.config import Config
from bridges.settings.names import kind_called

CONTEXT: Final = 6
"""So many events before a difference are told with it."""


@dataclass(frozen=True, slots=True)
class Core:
    """What a replay needs of a kind, with the limits of one subject."""

    decide: Callable[[Any, Any, float], Any]
    published: Callable[[Any, Any], Any]


@dataclass(frozen=True, slots=True)
class Difference:
    """Where a decision is another one. `what`: which part of it. `before`: the last events, in words,
    each with its time, up to this one."""

    subject: str
    at: float
    what: str
    recorded: Tree
    today: Tree
    before: tuple[str, ...]


@dataclass(slots=True)
class Count:
    """How much was compared. `unusable`: entries of subjects whose memory is not in the recording."""

    decisions: int = 0
    unusable: int = 0


class Cores:
    """The cores of a daemon, from its settings."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._kind = kind_called(config.kind)
        self._made: dict[str, Core | None] = {}

    def of(self, subject: str) -> Core | None:
        """The core of a subject; None where these settings have no such device."""
        if subject not in self._made:
            self._made[subject] = self._make(subject)
        return self._made[subject]

    def _make(self, subject: str) -> Core | None:
        config, kind = self._config, self._kind
        if isinstance(kind, GraphKind):
            limits = kind.limits(config.section)
            return Core(_with(kind.decide, limits), lambda memory, report: memory)
        if subject not in config.devices:
            return None
        debounce = config.driver_type(subject).debounce(config.devices[subject])
        limits = kind.limits(config.devices[subject], debounce)
        return Core(_with(kind.decide, limits), kind.published)


def _with(decide: Callable[..., Any], limits: Any) -> Callable[[Any, Any, float], Any]:
    return lambda memory, event, now: decide(memory, event, now, limits)


class _Course:
    """One subject, played from its memory on."""

    def __init__(self, core: Core, known: Known) -> None:
        self._core = core
        self._memory = value(known.memory)
        self._reading = value(known.reading)
        self._report = value(known.report)
        self.recorded = {"outputs": known.outputs, **_report_trees(self._report)}
        self._words: deque[str] = deque(maxlen=CONTEXT)

    def memory(self) -> Tree:
        """What is remembered now."""
        return tree(self._memory)

    def step(self, step: Step) -> Iterator[tuple[str, Tree, Tree]]:
        """Decide on an event; gives what differs, as (part, recorded, today)."""
        event = value(step.event)
        if type(event).__name__ in ("Sampled", "IoFailed"):
            self._reading = event
        for part, new in (("outputs", step.outputs), ("news", step.news), ("faults", step.faults)):
            if new:
                self.recorded[part] = new[0]
        told: dict[str, Tree] = {
            "refused": step.refused,
            "wake_at": tree(step.wake_at),
            "publish": step.publish,
        }
        yield from self._decide(event, step.at, told)

    def again(self, at: float) -> Iterator[tuple[str, Tree, Tree]]:
        """The last reading once more, which changed nothing."""
        yield from self._decide(self._reading, at, {"refused": "", "publish": []})

    def told(self) -> None:
        """The report has gone out."""
        self._memory = self._core.published(self._memory, self._report)

    def words(self) -> tuple[str, ...]:
        """The last events."""
        return tuple(self._words)

    def _decide(
        self, event: object, at: float, told: dict[str, Tree]
    ) -> Iterator[tuple[str, Tree, Tree]]:
        self._words.append(f"{at:.3f} {plain(event)}")
        decision = self._core.decide(self._memory, event, at)
        self._memory, self._report = decision.memory, decision.report
        recorded = self.recorded | told
        today = {
            "outputs": tree(decision.outputs),
            **_report_trees(decision.report),
            "refused": decision.refused,
            "wake_at": tree(decision.wake_at),
            "publish": [[topic.name, tree(message)] for topic, message in decision.publish],
        }
        for part, was in recorded.items():
            if today[part] != was:
                yield part, was, today[part]


def _report_trees(report: Any) -> dict[str, Tree]:
    if report is None:
        return {"news": None, "faults": None}
    return {"news": tree(report.news()), "faults": tree(report.faults)}


def replay(entries: Iterable[AnyEntry], cores: Cores, count: Count) -> Iterator[Difference]:
    """Each subject's first difference: where today's core decides, or remembers, something else."""
    courses: dict[str, _Course | None] = {}
    for entry in entries:
        for subject, what, was, now in _played(entry, cores, courses, count):
            course = courses[subject]
            assert course
            yield Difference(subject, entry.at, what, was, now, course.words())
            courses[subject] = None
            break


def _played(
    entry: AnyEntry, cores: Cores, courses: dict[str, _Course | None], count: Count
) -> Iterator[tuple[str, str, Tree, Tree]]:
    """What differs in one entry."""
    if not isinstance(entry, Known | Step | Same | Told | Forgotten):
        return
    subject = entry.subject
    if isinstance(entry, Known):
        yield from _known(entry, cores, courses)
        return
    course = courses.get(subject)
    if isinstance(entry, Forgotten):
        courses.pop(subject, None)
    elif course is None:
        count.unusable += subject not in courses
    elif isinstance(entry, Told):
        course.told()
    elif isinstance(entry, Step):
        count.decisions += 1
        yield from ((subject, *found) for found in course.step(entry))
    else:
        for at in times(entry):
            count.decisions += 1
            yield from ((subject, *found) for found in course.again(at))


def _known(
    entry: Known, cores: Cores, courses: dict[str, _Course | None]
) -> Iterator[tuple[str, str, Tree, Tree]]:
    """Begin a subject's course, or compare the memory that it has come to."""
    subject, core = entry.subject, cores.of(entry.subject)
    if subject not in courses:
        courses[subject] = _Course(core, entry) if core else None
    elif (course := courses[subject]) and (memory := course.memory()) != entry.memory:
        yield subject, "memory", entry.memory, memory


def times(entry: Same) -> tuple[float, ...]:
    """When the reading came again. Raises UnknownValue."""
    try:
        return struct.unpack(f"<{len(entry.times) // 8}d", entry.times)
    except struct.error as error:
        raise UnknownValue(f"no times: {error}") from error
