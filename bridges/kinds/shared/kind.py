"""The struct that describes a kind of device: its topics, and the pure functions of its folder.

`bridges/kinds/<kind>/__init__.py` holds one such struct, `KIND`. The daemon's loop knows nothing of a
kind but this struct. Each `KIND` states its types, so mypy proves that its functions fit together.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Generic, NamedTuple, TypeVar, Union

from msgspec import Struct

from bridges.kinds.shared.decision import (
    AlarmInputs,
    Decision,
    IoFailed,
    M,
    O,
    OperatorReset,
    R,
    RivalSeen,
    Said,
    Sampled,
    X,
)
from bridges.messages.definitions import Message, Time
from bridges.messages.topics import Topic

S = TypeVar("S")
"""The settings of one device, or of a kind without hardware."""
L = TypeVar("L")
"""The limits: the settings that the core needs."""
E = TypeVar("E")
"""The events into which `accept` turns requests."""

DeviceEvent = Union[Sampled[X], IoFailed, RivalSeen, OperatorReset, E]  # noqa: UP007
"""All events of a device's core."""

FLOOR, LIFT, DOOR, CHARGER, WAYPOINT = "floor", "lift", "door", "charger", "waypoint"
"""The kinds of things that have a name on RMF's map."""

Place = tuple[tuple[str, ...], str, str]
"""A setting with a name on RMF's map: the setting's path, the kind of name (`FLOOR`, …), and the
name."""


class RefusalAnswer(NamedTuple):
    """The answer to a refused request: its topic, its message, and its text for the status file."""

    topic: Topic[Message]
    message: Message
    status: Mapping[str, str]


class Keeping(Struct, Generic[M], frozen=True):
    """The part of a device's memory that must survive a restart.

    `part(memory)`: this part, compared by value. `persist(memory)`: the bytes of this part.
    `restore(kept, now)`: the memory from these bytes. `restore` raises ValueError for bytes that
    `persist` did not make. `lost(reason)`: the memory for a start at which the bytes are wrong, or are
    missing although an earlier run may have saved some. `missing_is_new`: without bytes no earlier run
    has saved any.

    The core also gets the event `MemoryKept` or `MemoryNotKept` for each attempt to write, before
    messages go out, and before outputs are switched. `outputs_first`: outputs are switched and the
    alarm is told before the attempt, because a slow disk must not delay them.
    """

    part: Callable[[M], object]
    persist: Callable[[M], bytes]
    restore: Callable[[bytes, float], M]
    lost: Callable[[str], M]
    missing_is_new: bool = False
    outputs_first: bool = False


class Kind(Struct, Generic[S, L, M, X, E, O, R], frozen=True):
    """One kind of device: its settings, limits, memory, sample, requests, outputs and report.

    Messages (left out by a kind about which RMF has no messages):
    - `states`: the topic of the devices' states.
    - `state_message(name, settings, report, stamp)`: the report as RMF's message.
    - `requests`: each topic that a device obeys, with `accept(message, settings) -> event`. `accept`
      raises RequestRefused for a message that is malformed or impossible for this device.
    - `device_name`: the device named in a message (request or state).
    - `sender`: the requester behind a request. If several requests wait for the next scan, only the
      last request of each sender counts.
    - `publishes(settings)`: the topics on which a device publishes in addition to its states.
    - `answer(name, request, reason, report)`: the published answer to a refused request; None for no
      answer. `request`: the message if it is malformed, else the event.
    - `results(name, report)`: messages that go out right after the state of this report. While there
      are any, the state is due.
    - `stamped(message, stamp)`: a result or an answer with its time.
    - `attended_by`: a topic of requests. The core gets `Attended` when the topic's publishers appear or
      vanish.
    - `recorded`: topics with messages about the device that are recorded, and that no core gets.

    The core:
    - `limits(settings, debounce_s)`: the limits, from the device's settings and the debounce of each
      signal in the wiring table.
    - `initial(limits, now)`: the core's memory at start.
    - `decide`: the core.
    - `summary(report)`: key -> value for the log line, the status file and `watch`.
    - `published(memory, report)`: the memory after this report has gone out to RMF.
    - `repeated(memory, now)`: the memory after the same reading came once more, at `now`. The loop
      calls this function in place of `decide` if only the times of the reading differ. Without this
      function the core decides on every reading.
    - `alarm_inputs(report)`: the causes of a fleet alarm that the device sees
      (`bridges/kinds/shared/fleet_alarm.py`); None for a kind without alarms.
    - `keeping`: the functions that save and restore a memory that must survive a restart; None for a
      kind without such a memory.
    - `decided_by_person`: the core gets the event `DecidedByPerson`.

    Settings:
    - `devices_key`: the section of the devices in the YAML.
    - `section`: the key and the struct of a section that all devices of a file share.
    - `on_map(settings)`: settings that name a place on RMF's map, as `Place`s. The device's own name is
      checked for every kind.
    - `drives`: whether the devices have outputs. Without outputs nothing must be switched off.
    """

    name: str
    devices_key: str
    limits: Callable[[S, Mapping[str, float]], L]
    initial: Callable[[L, float], M]
    decide: Callable[[M, DeviceEvent[X, E], float, L], Decision[M, O, R]]
    summary: Callable[[R], Mapping[str, str]]
    states: Topic[Message] | None = None
    state_message: Callable[[str, S, R, Time], Message] | None = None
    requests: Mapping[Topic[Message], Callable[[Any, S], E]] = {}
    device_name: Callable[[Any], str] = lambda message: ""
    sender: Callable[[Any], str] = lambda request: ""
    published: Callable[[M, R], M] = lambda memory, report: memory
    repeated: Callable[[M, float], M] | None = None
    publishes: Callable[[S], tuple[Topic[Message], ...]] = lambda settings: ()
    alarm_inputs: Callable[[R], AlarmInputs] | None = None
    answer: Callable[[str, object, str, R], RefusalAnswer | None] = (
        lambda name, request, reason, report: None
    )
    on_map: Callable[[S], Iterable[Place]] = lambda settings: ()
    results: Callable[[str, R], tuple[Said, ...]] = lambda name, report: ()
    stamped: Callable[[Any, Time], Message] = lambda message, stamp: message
    keeping: Keeping[M] | None = None
    decided_by_person: bool = False
    section: tuple[str, type[Struct]] | None = None
    attended_by: Topic[Message] | None = None
    recorded: tuple[Topic[Message], ...] = ()
    drives: bool = True

    @property
    def stated_on(self) -> tuple[Topic[Message], ...]:
        """The topic of the states; empty for a kind without states in RMF."""
        return (self.states,) if self.states else ()


AnyDeviceKind = Kind[Any, Any, Any, Any, Any, Any, Any]
"""A kind of device of any sort. Code that finds a kind by its name does not know the types of its
settings and memory."""
