"""One message of RMF's graph, as everything that looks at a graph or a recording gets it.

A live graph and every kind of recording give the same values in the same order, so what judges,
explains or draws does not know where they come from.
"""

from msgspec import Struct

from bridges.rmf.definitions import Message


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
