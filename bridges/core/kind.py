"""What a kind of device is to the daemon: its topics, and the pure functions of its folder.

`bridges/<kind>/__init__.py` holds one `KIND`; the loop knows nothing else about lifts or doors.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from bridges.core.decision import Decision
from bridges.rmf.definitions import Message, Time
from bridges.rmf.topics import Topic

Place = tuple[tuple[str, ...], str, str]
"""A setting that names something on RMF's map: its path, what it is (`building_map`), the name."""


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of device.

    `devices_key`: the YAML's section of them. `states`: the topic of its state messages.
    `requests`: each topic that it obeys, with `accept(message, settings) -> event`, which raises
    RequestRefused for a message that is malformed or cannot be asked of this device.
    `device_name`: which device a message (request or state) is about. `sender`: on whose behalf a
    request was sent; of several that wait for a scan, only the last of each sender counts.
    `limits(settings, debounce_s)`: the core's durations, from the device's settings and the wiring
    table's per-signal debounce. `initial(limits, now)`: the core's memory at start.
    `decide`: the core. `state_message(name, settings, report, stamp)`: the report as RMF's message.
    `summary(report)`: key -> value for the log line, the status file and `watch`.
    `published(memory, report)`: the memory after this report has gone out to RMF.
    `alarm_topics(settings)`: what a device publishes beside its states.
    `on_map(settings)`: which of its settings name a place on RMF's map, as (path, what it is, name);
    that the device's own name stands there goes without saying.
    """

    name: str
    devices_key: str
    states: Topic[Any]
    requests: Mapping[Topic[Any], Callable[[Any, Any], Any]]
    device_name: Callable[[Any], str]
    sender: Callable[[Any], str]
    limits: Callable[[Any, Mapping[str, float]], Any]
    initial: Callable[[Any, float], Any]
    decide: Callable[[Any, Any, float, Any], Decision[Any, Any, Any]]
    state_message: Callable[[str, Any, Any, Time], Message]
    summary: Callable[[Any], Mapping[str, str]]
    published: Callable[[Any, Any], Any] = lambda memory, report: memory
    alarm_topics: Callable[[Any], tuple[Topic[Any], ...]] = lambda settings: ()
    on_map: Callable[[Any], Iterable[Place]] = lambda settings: ()
