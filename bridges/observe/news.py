"""News of a device: the changes that one message makes."""

from dataclasses import dataclass
from typing import Literal

from bridges.observe.requesters import DeviceRequester, Moment

What = Literal[
    "first state",  # the device's first state has come
    "states again",  # a state has come after a silence of `gap_s`
    "read",  # the readings have become old or recent; `text` says which
    "changed",  # the state changes the facts in `changed`
    "asks",  # a requester wants something new; `text`: the lift mode that it asks for
    "passed on",  # the supervisor sends a new request to the device
    "ends",  # a requester sends END; if `passed_on`, the supervisor sends it
    "has",  # a requester got the device
    "lost",  # `who` lost the device
    "result",  # a workcell publishes a new result for a request; `text`: the result
    "met",  # RMF sees a requester's wish as fulfilled
    "gone",  # a requester has stopped asking, without END
    "over",  # a requester's visit has ended
    "fault",  # the diagnosis `who` has a new fault; `text`: its code
    "fault over",
    "refused",  # the node of the diagnosis `who` refused a request; `text`: the reason
]


@dataclass(frozen=True, slots=True)
class News:
    """One change that a message makes.

    `who`: the requester's name. `requester`: what we know of the requester, or None if it sent no
    request. `text`: see `What`. `gap_s`: the length (s) of the silence or hold that has ended.
    """

    what: What
    at: Moment
    who: str = ""
    text: str = ""
    requester: DeviceRequester | None = None
    gap_s: float = 0.0
    passed_on: bool = False
