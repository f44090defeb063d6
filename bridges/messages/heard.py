"""One message of RMF's graph. It has the same form whether it comes from a live graph or from any kind
of recording.

A graph and a recording yield the same values in the same order. So code that judges, explains or draws
messages need not know their source.
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
"""The message fields that hold sentences instead of names."""
LONGEST_SENTENCE: Final = 1000
MOST_PARTS: Final = 500
"""The maximum number of kept elements of a sequence. A legal FleetState has 200 robots."""


class Sender(Struct, eq=False):
    """One publisher on the graph. All messages of a publisher share one object.

    `node`: the publisher's node, `/namespace/name`, which can be forged; "" until discovery finds the
    node. `look`: a function that looks the node up again, from any thread; None if there is nothing to
    look up.
    """

    node: str = ""
    look: Callable[[], str] | None = None


class Heard(Struct, frozen=True):
    """A message with its topic's ROS name and the time of its arrival.

    `at`: seconds on a clock that never steps; its zero is arbitrary. `wall`: seconds since the epoch,
    by the clock of the listening machine, for comparison with stamps. `sender`: None if the wire or the
    recording does not name the publisher.
    """

    at: float
    wall: float
    topic: str
    message: Message
    sender: Sender | None = None


class Own(Struct, frozen=True):
    """A text that our recorder stores beside the messages. It is a daemon's note in JSON.

    `topic`: the note's topic, such as `rmf_bridge/outputs`. The times are as in `Heard`.
    """

    at: float
    wall: float
    topic: str
    text: str


def bounded(part: Any, longest: int = LONGEST_NAME) -> Any:
    """Shorten a message, or a part of one, for memory and display. Anybody can send a name of
    megabytes.

    A name of more than LONGEST_NAME characters is cut and ends with its length. So is a sentence of
    more than LONGEST_SENTENCE. A sequence is cut to MOST_PARTS elements. Parts within these limits are
    not copied.
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
