"""Accepts requests as the daemon's service does.

Some tests run a device's decision logic (a core) without the service.
"""

from typing import Any

from bridges.kinds.shared.decision import RequestRefused
from bridges.kinds.shared.kind import AnyDeviceKind
from bridges.messages.definitions import Message
from bridges.messages.topics import Topic
from bridges.runtime.device import AnyNode


def accepted(
    node: AnyNode, kind: AnyDeviceKind, settings: Any, *heard: tuple[Topic[Any], Message]
) -> list[Any]:
    """Return the events that the kind makes from these requests. `heard` has each topic with its
    request.

    A refused request makes no event. Instead the node counts the refusal.
    """
    events = []
    for topic, request in heard:
        try:
            events.append(kind.requests[topic](request, settings))
        except RequestRefused as refusal:
            node.refuse(request, refusal)
    return events
