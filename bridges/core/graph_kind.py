"""What a kind without hardware is to the daemon: topics in, topics out, and the core between them.

A supervisor or coordinator has no driver and no bus. It serves any number of subjects (lifts, doors)
that it learns of from messages, with one core memory for each. `bridges/<kind>/__init__.py` holds the
`KIND`; `bridges/serve/graph.py` serves it.
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, Union

from bridges.core.decision import Decision, M, OperatorReset, R
from bridges.core.kind import AnyDeviceKind, E, L, Place, S
from bridges.core.table import Table
from bridges.rmf.definitions import Message, Time
from bridges.rmf.topics import Topic


@dataclass(frozen=True, slots=True)
class MaySpeak:
    """Whether the core may publish: not in the quiet time at start, nor beside a rival."""

    yes: bool


@dataclass(frozen=True, slots=True)
class Woken:
    """Nothing but time has passed: it is the core's `wake_at`."""


GraphEvent = Union[MaySpeak, Woken, OperatorReset, E]  # noqa: UP007
"""Everything that such a core may be told."""


@dataclass(frozen=True, slots=True)
class GraphKind(Generic[S, L, M, E, R]):
    """One kind that lives on RMF's graph alone: its settings, limits, memory, events and report.

    `devices_key`: the YAML's section of its settings. `settings`: the struct that reads it.
    `requests`: each topic heard, with `accept(message, settings, wall) -> event`, which raises
    RequestRefused; `wall` is our clock (s since the epoch).
    `publishes`: what it sends. `sole`: those of them that one node alone may send; while another
    does, ours is passive.
    `device_name`: which subject a message is about. `shown_by`: the topic by which a subject shows
    itself, None where all is about one; only requests speak of what is made up. `reserved(settings)`:
    the subjects that the YAML names.
    `quiet_s(settings)`: how long it listens, alone, before it speaks.
    `limits(settings)`: what the core is to know of them.
    `initial(subject, started_at)`: a subject's memory; `started_at` is the daemon's start.
    `decide`: the core; its `publish` leaves stamps to `stamped(message, time)`, at the time of sending.
    `summary(report, now)`: key -> value for the status file and `watch`. `idle(memory, now)`: nothing
    worth remembering is left of this subject.
    `on_map(settings)`: which settings name a place on RMF's map (`bridges/core/kind.py`).

    For a kind that speaks of all its subjects in one message: `together(memories)`, sent when it has
    changed and each second. For one whose memory must outlive the daemon: `persist(memories)`, the
    same bytes while nothing worth keeping has changed, and `restore(kept, settings, now)`, which
    raises ValueError for bytes that are not that. What is kept is kept before it is told together.

    For one whose settings are more than a few numbers: `tables(settings)`, for `check`, and
    `warnings(settings)`, as (path, text) of what is legal but worth a look. `speaks_of(settings)`: the
    devices that it names, as (path, their kind, name): some file of the site has to have them.
    """

    name: str
    devices_key: str
    settings: type[S]
    requests: Mapping[Topic[Message], Callable[[Any, S, float], E]]
    publishes: tuple[Topic[Message], ...]
    sole: tuple[Topic[Message], ...]
    device_name: Callable[[Any], str]
    quiet_s: Callable[[S], float]
    limits: Callable[[S], L]
    initial: Callable[[str, float], M]
    decide: Callable[[M, GraphEvent[E], float, L], Decision[M, None, R]]
    stamped: Callable[[Any, Time], Message]
    summary: Callable[[R, float], Mapping[str, str]]
    idle: Callable[[M, float], bool]
    together: Callable[[Mapping[str, M]], tuple[Topic[Message], Message]] | None = None
    persist: Callable[[Mapping[str, M]], bytes] | None = None
    restore: Callable[[bytes, S, float], Mapping[str, M]] | None = None
    tables: Callable[[S], Iterable[Table]] = lambda settings: ()
    warnings: Callable[[S], Iterable[tuple[tuple[str, ...], str]]] | None = None
    on_map: Callable[[S], Iterable[Place]] = lambda settings: ()
    speaks_of: Callable[[S], Iterable[Place]] = lambda settings: ()
    shown_by: Topic[Message] | None = None
    reserved: Callable[[S], Collection[str]] = lambda settings: ()


AnyGraphKind = GraphKind[Any, Any, Any, Any, Any]
AnyKind = AnyDeviceKind | AnyGraphKind
"""One that is found by its name."""
