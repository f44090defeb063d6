"""One message of RMF's graph, as everything that looks at a graph or a recording gets it.

A live graph and every kind of recording give the same values in the same order, so what judges,
explains or draws does not know where they come from.
"""

from operator import is_
from typing import Any, Final

from msgspec import Struct
from msgspec.structs import replace

from bridges.messages.definitions import Message
from bridges.messages.words import LONGEST_NAME

FREE_TEXTS: Final = frozenset(
    {"error_message", "message", "title", "subtitle", "value", "performing_action", "model"}
)
"""Fields of messages that hold sentences, not names."""
LONGEST_SENTENCE: Final = 1000
MOST_PARTS: Final = 500
"""The most elements of a sequence; a legal FleetState has 200 robots."""


class Heard(Struct, frozen=True):
    """A message, its topic's ROS name, and when it arrived.

    `at`: s on a clock that never steps, from any zero. `wall`: s since the epoch, by the clock of the
    listening machine, so that stamps can be compared with it.
    """

    at: float
    wall: float
    topic: str
    message: Message


class Own(Struct, frozen=True):
    """A text that our recorder wrote beside the messages: JSON of what a daemon noted.

    `topic`: such as `rmf_bridge/outputs`. Times as of `Heard`.
    """

    at: float
    wall: float
    topic: str
    text: str


def bounded(part: Any, longest: int = LONGEST_NAME) -> Any:
    """A message, or a part of one, as it is kept and shown: anybody can send names of a megabyte.

    A name of more than LONGEST_NAME characters, and a sentence of more than LONGEST_SENTENCE, ends with
    its length; a sequence has at most MOST_PARTS elements. What is within these is not copied.
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
