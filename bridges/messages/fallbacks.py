"""Substitutes for messages that a release of RMF lacks.

- An EmergencySignal to all fleets becomes a `fire_alarm_trigger`. The fleet adapters of every release
  hear that topic.
- An Alert becomes a line in the log. The alert's cause is also a fault of the daemon, so the daemon's
  diagnostics show it too.
"""

from typing import Final

from bridges.messages.definitions import Bool, EmergencySignal, Message
from bridges.messages.releases import RELEASES
from bridges.messages.topics import EMERGENCY_SIGNAL, FIRE_ALARM_TRIGGER, AnyTopic

INSTEAD: Final[dict[str, AnyTopic]] = {EMERGENCY_SIGNAL.name: FIRE_ALARM_TRIGGER}
"""The topic that replaces another topic, by that other topic's name. Every release has the replacing
topics."""


def converted(message: Message) -> Message | None:
    """Return the substitute for a message. Return None for an Alert, which goes into the log."""
    return Bool(message.is_emergency) if isinstance(message, EmergencySignal) else None


def remarks(topic: AnyTopic, wanted: str) -> list[str]:
    """Return remarks for `check` about a topic whose message a release lacks. `wanted`: the value of
    `release` in the YAML."""
    names = RELEASES if wanted == "auto" else [wanted]
    way = (
        f"goes out on {INSTEAD[topic.name].name}" if topic.name in INSTEAD else "goes into the log"
    )
    return [
        f"RMF's {name} has no {topic.type.__name__}: {topic.name} {way}"
        for name in names
        if not RELEASES[name].has(topic.type)
    ]
