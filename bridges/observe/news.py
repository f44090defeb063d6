"""News of a device: the changes by one message."""

from dataclasses import dataclass
from typing import Literal

from bridges.observe.requesters import DeviceRequester, Moment

What = Literal[
    "first state",  # of a device without states before
    "states again",  # `gap_s` after the state before
    "read",  # the judgement of its readings' age is now `text`
    "changed",  # the facts in `changed` differ from the state before
    "asks",  # a requester asks for something new; of a lift: in the mode `text`
    "passed on",  # the supervisor asks for something new
    "ends",  # a requester sends END; `passed_on`: the supervisor does
    "has",  # a requester has the device now
    "lost",  # `text` had the device until now
    "result",  # a workcell gives the requester's request another result: `text`
    "met",  # RMF sees a requester's wish fulfilled
    "gone",  # a requester has stopped asking, without END
    "over",  # a requester's visit is over
    "fault",  # the diagnosis `who` reports a new fault with the code `text`
    "fault over",
    "refused",  # the node of the diagnosis `who` has refused a request, for the reason `text`
]


@dataclass(frozen=True, slots=True)
class News:
    """One change by a message. `who`: the requester, as a text; `requester`: its memory, if it has
    asked. `text`: as `What` says; `gap_s`: the length of the silence or hold that ended."""

    what: What
    at: Moment
    who: str = ""
    text: str = ""
    requester: DeviceRequester | None = None
    gap_s: float = 0.0
    passed_on: bool = False
