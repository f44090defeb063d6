"""A DDS participant from outside this project that sees what the others announce."""

from typing import Any

from cyclonedds import builtin

from bridges.messages.topics import Topic
from bridges.transports.dds.peers import BuiltinReader
from tests.waiting import wait_until

PUBLICATION = builtin.BuiltinTopicDcpsPublication
SUBSCRIPTION = builtin.BuiltinTopicDcpsSubscription


def seen(observer: Any, kind: Any, topic: Topic[Any]) -> Any:
    """The one end of a topic that is announced."""
    found: list[Any] = []

    def look() -> bool:
        reader = BuiltinReader(observer, kind)  # a new one sees who is there now
        found[:] = [end for end in reader.take(100) if end.topic_name == f"rt/{topic.name}"]
        return len(found) == 1

    wait_until(look, f"{topic.name} is announced, once")
    return found[0]
