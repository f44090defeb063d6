"""A message that was heard on RMF's graph (the nodes and topics of RMF). A message has the same form in
a live graph and in every kind of recording.

A graph and its recording yield the same values in the same order. So the code that judges, explains or
draws messages does not depend on their source.
"""

from collections.abc import Callable
from operator import is_
from typing import Any, Final

from msgspec import Struct
from msgspec.structs import replace

from bridges.messages.definitions import Message
from bridges.messages.words import LONGEST_NAME

FREE_TEXTS: Final = frozenset(
    {"error_message", "message", "title", "subtitle", "value", "performing_action", "model"}
)
"""The message fields that hold sentences, not names."""
LONGEST_SENTENCE: Final = 1000
MOST_PARTS: Final = 500
"""The maximum number of elements that are kept of a sequence; the rest is cut off. A legal FleetState
has 200 robots."""


class Sender(Struct, eq=False):
    """One publisher on the graph. All messages of a publisher share one `Sender`.

    `node`: the publisher's node, `/namespace/name`, or "" until discovery finds the node. Anybody can
    forge this name. `look`: a function that asks discovery for the node again, or None if this is
    impossible. Any thread may call `look`.
    """

    node: str = ""
    look: Callable[[], str] | None = None


class Heard(Struct, frozen=True):
    """A message with its topic's ROS name and the time of its arrival.

    `at`: seconds on a clock that never steps. The zero of that clock is an arbitrary time. `wall`:
    seconds since the epoch on the listening machine's clock, for comparison with stamps. `sender`: None
    if neither the wire nor the recording names the publisher.
    """

    at: float
    wall: float
    topic: str
    message: Message
    sender: Sender | None = None


class Own(Struct, frozen=True):
    """A note of a daemon as JSON text. Our recorder stores notes beside the messages.

    `topic`: the note's topic, such as `rmf_bridge/outputs`. `at` and `wall` are as in `Heard`.
    """

    at: float
    wall: float
    topic: str
    text: str


def bounded(part: Any, longest: int = LONGEST_NAME) -> Any:
    """Shorten a message, or a part of a message, for memory and display. A name from the network may
    have megabytes.

    A name is cut after LONGEST_NAME characters, and a sentence after LONGEST_SENTENCE. A cut text ends
    with its former length. A sequence is cut after MOST_PARTS elements. Parts that are short enough are
    returned without a copy.
    """
    if isinstance(part, str):
        return part if len(part) <= longest else f"{part[:longest]}… ({len(part)} characters)"
    if isinstance(part, tuple):
        parts = tuple(bounded(one, longest) for one in part[:MOST_PARTS])
        return part if len(parts) == len(part) and all(map(is_, parts, part)) else parts
    if not isinstance(part, Struct):
        return part
    changed = {}
    for name in part.__struct_fields__:
        before = getattr(part, name)
        after = bounded(before, LONGEST_SENTENCE if name in FREE_TEXTS else LONGEST_NAME)
        if after is not before:
            changed[name] = after
    return replace(part, **changed) if changed else part
