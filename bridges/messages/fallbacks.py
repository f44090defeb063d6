"""Substitutes for messages that RMF's release lacks. A substitute is the nearest message of that
release.

- An EmergencySignal to all fleets becomes `fire_alarm_trigger`, which the fleet adapters of every
  release hear.
- An Alert becomes a line in the log. The alert's cause is also a fault of the daemon, so it also
  appears in the daemon's diagnostics.
"""

from typing import Final

from bridges.messages.definitions import Bool, EmergencySignal, Message
from bridges.messages.releases import RELEASES
from bridges.messages.topics import EMERGENCY_SIGNAL, FIRE_ALARM_TRIGGER, AnyTopic

INSTEAD: Final[dict[str, AnyTopic]] = {EMERGENCY_SIGNAL.name: FIRE_ALARM_TRIGGER}
"""Topic -> its substitute, which every release has."""


def converted(message: Message) -> Message | None:
    """Convert a message for the topic in INSTEAD. Return None for a message that goes into the log."""
    return Bool(message.is_emergency) if isinstance(message, EmergencySignal) else None


def remarks(topic: AnyTopic, wanted: str) -> list[str]:
    """Return remarks for `check` about a topic whose message a release lacks. `wanted` is the YAML's
    `release`."""
    names = RELEASES if wanted == "auto" else [wanted]
    way = (
        f"goes out on {INSTEAD[topic.name].name}" if topic.name in INSTEAD else "goes into the log"
    )
    return [
        f"RMF's {name} has no {topic.type.__name__}: {topic.name} {way}"
        for name in names
        if not RELEASES[name].has(topic.type)
    ]
