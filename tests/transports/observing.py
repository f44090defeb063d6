"""Tools that read announced publishers and subscriptions through a DDS participant. The participant
uses no code of this project."""

from typing import Any

from cyclonedds import builtin

from bridges.messages.topics import Topic
from bridges.transports.dds.peers import BuiltinReader
from tests.waiting import wait_until

PUBLICATION = builtin.BuiltinTopicDcpsPublication
SUBSCRIPTION = builtin.BuiltinTopicDcpsSubscription


def seen(observer: Any, kind: Any, topic: Topic[Any]) -> Any:
    """Return the announced publisher or subscription of a topic. The topic must have exactly one."""
    found: list[Any] = []

    def look() -> bool:
        reader = BuiltinReader(observer, kind)  # a new reader gets everything that is announced now
        found[:] = [end for end in reader.take(100) if end.topic_name == f"rt/{topic.name}"]
        return len(found) == 1

    wait_until(look, f"{topic.name} is announced by exactly one end")
    return found[0]
