"""Tools to read the ends that nodes announce, through a DDS participant without code of this
project."""

from typing import Any

from cyclonedds import builtin

from bridges.messages.topics import Topic
from bridges.transports.dds.peers import BuiltinReader
from tests.waiting import wait_until

PUBLICATION = builtin.BuiltinTopicDcpsPublication
SUBSCRIPTION = builtin.BuiltinTopicDcpsSubscription


def seen(observer: Any, kind: Any, topic: Topic[Any]) -> Any:
    """Return the announced end of a topic, which must be the only one."""
    found: list[Any] = []

    def look() -> bool:
        reader = BuiltinReader(observer, kind)  # a new reader gets all present ends
        found[:] = [end for end in reader.take(100) if end.topic_name == f"rt/{topic.name}"]
        return len(found) == 1

    wait_until(look, f"{topic.name} is announced by exactly one end")
    return found[0]
