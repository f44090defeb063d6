"""The struct that describes a kind without hardware: the topics that it hears and publishes, and its
core.

A supervisor or coordinator has no driver and no bus. It learns of its subjects (lifts, doors) from
messages, and keeps one memory of its decision core for each subject. `bridges/kinds/<kind>/__init__.py`
holds this struct as `KIND`, and `bridges/runtime/graph_node.py` runs the kind.
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any, Final, Generic, Union

from msgspec import Struct

from bridges.kinds.shared.decision import Decision, M, OperatorReset, R
from bridges.kinds.shared.kind import AnyDeviceKind, E, L, Place, RefusalAnswer, S
from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table
from bridges.messages.definitions import Message, Time
from bridges.messages.topics import Topic

LISTENS: Final = "for the end of the quiet start"


class MaySpeak(Struct, frozen=True):
    """The permission to publish. `yes` is False during the quiet start, and while another node
    publishes.

    `waits`: if the core may not publish, the reason why requesters must wait. `at_once`: no other node
    publishes, so urgent messages may be sent even during the quiet start (`GraphKind.urgent`). `alone`:
    no other node publishes on a topic of `GraphKind.yields`.
    """

    yes: bool
    at_once: bool = False
    alone: bool = True
    waits: str = LISTENS


class Woken(Struct, frozen=True):
    """The time `wake_at` of the core's last decision has come."""


GraphEvent = Union[MaySpeak, Woken, OperatorReset, E]  # noqa: UP007
"""All events of a core without hardware."""


class GraphKind(Struct, Generic[S, L, M, E, R], frozen=True):
    """One kind without hardware: its settings, limits, memory, events and report.

    Topics:
    - `requests`: each topic that the node hears, with its function `accept(message, settings, wall) ->
      event`. `accept` raises RequestRefused. `wall` is our clock (s since the epoch).
    - `publishes`: the topics on which the node publishes.
    - `sole`: topics that may have only one publisher. If another node publishes on such a topic, our
      node only listens.
    - `yields`: topics on which our node is silent if another node publishes on them. Our node continues
      on its other topics.
    - `shown_by`: the topic on which a subject publishes its own states. Such states prove that the
      subject exists, while a request may name anything. None: there is only one subject.

    Settings:
    - `devices_key`: the section of its settings in the YAML. `settings`: the struct for this section.
    - `limits(settings)`: the settings that the core needs.
    - `quiet_s(settings)`: the time (s) after the start in which the node only listens.
    - `reserved(settings)`: the subjects that the YAML names.
    - `on_map(settings)`: settings that name a place on RMF's map (`bridges/kinds/shared/kind.py`).
    - `tables(settings)`: tables for `check`.
    - `warnings(settings)`: legal settings that may be mistakes, each as its path and a text.
    - `speaks_of(settings)`: the devices that the settings name, each as path, kind and name. Some file
      of the site must define each of these devices.

    The core:
    - `initial(subject, started_at)`: a new subject's memory. `started_at` is the daemon's start, or the
      time at which the node last forgot a subject. A request from before that may be old.
    - `decide`: the core. Its messages have no stamps.
    - `stamped(message, time)`: the message with its stamp, when the node sends it.
    - `summary(report, now)`: keys and values for the status file and `watch`.
    - `idle(memory, now)`: whether the subject may be forgotten.
    - `device_name(message)`: the subject of a message.
    - `requester(event)`: the sender of a request; "" for a state.
    - `requesters(memory)`: the requesters that the subject remembers. Anybody can invent requesters, so
      their number over all subjects has a bound.
    - `answer(request, reason)`: the published answer to a refused request; None for no answer.
      `request` is the message if `accept` refused it, and the event if the core refused it.

    Only some kinds have these:
    - `together(memories)`: one message about all subjects, sent each second and at every change.
    - `persist(memories)`: the bytes to save for a restart. The bytes change only when something worth
      keeping has changed. They are saved before `together` is sent.
    - `restore(kept, settings, now)`: the memories from these bytes. Raises ValueError for bytes that
      `persist` did not make.
    - `urgent(memory)`: whether the subject holds something that a restart must not interrupt
      (`MaySpeak.at_once`).
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
    urgent: Callable[[M], bool] = lambda memory: False
    tables: Callable[[S], Iterable[Table]] = lambda settings: ()
    warnings: Callable[[S], Remarks] | None = None
    on_map: Callable[[S], Iterable[Place]] = lambda settings: ()
    speaks_of: Callable[[S], Iterable[Place]] = lambda settings: ()
    yields: tuple[Topic[Message], ...] = ()
    shown_by: Topic[Message] | None = None
    reserved: Callable[[S], Collection[str]] = lambda settings: ()
    answer: Callable[[object, str], RefusalAnswer | None] = lambda request, reason: None
    requester: Callable[[E], str] = lambda event: ""
    requesters: Callable[[M], Collection[str]] = lambda memory: ()


AnyGraphKind = GraphKind[Any, Any, Any, Any, Any]
AnyKind = AnyDeviceKind | AnyGraphKind
"""A kind of any sort. Code that finds a kind by its name does not know the types of its settings and
memory."""
