"""What is sent where RMF's release lacks a message: the nearest message that it has.

- EmergencySignal to all fleets: `fire_alarm_trigger`, which every release's fleet adapters hear.
- Alert: the log. What it is about is among the daemon's faults too, and so in its diagnostics.
"""

from typing import Final

from bridges.messages.definitions import Bool, EmergencySignal, Message
from bridges.messages.releases import RELEASES
from bridges.messages.topics import EMERGENCY_SIGNAL, FIRE_ALARM_TRIGGER, AnyTopic

INSTEAD: Final[dict[str, AnyTopic]] = {EMERGENCY_SIGNAL.name: FIRE_ALARM_TRIGGER}
"""Topic -> the one that serves the same purpose in every release."""


def converted(message: Message) -> Message | None:
    """The message for the topic in INSTEAD. None for one that goes into the log."""
    return Bool(message.is_emergency) if isinstance(message, EmergencySignal) else None


def remarks(topic: AnyTopic, wanted: str) -> list[str]:
    """Remarks for `check` on a topic whose message a release lacks. `wanted`: the YAML's `release`."""
    names = RELEASES if wanted == "auto" else [wanted]
    way = (
        f"goes out on {INSTEAD[topic.name].name}" if topic.name in INSTEAD else "goes into the log"
    )
    return [
        f"RMF's {name} has no {topic.type.__name__}: on it {topic.name} {way}"
        for name in names
        if not RELEASES[name].has(topic.type)
    ]
