"""News of a device: the changes that one message makes."""

from dataclasses import dataclass
from typing import Literal

from bridges.observe.requesters import DeviceRequester, Moment

What = Literal[
    "first state",  # the device had no states before
    "states again",  # the first state after a gap of `gap_s`
    "read",  # the readings' age is now judged as `text`
    "changed",  # this state changes the facts in `changed`
    "asks",  # a requester has a new wish; for a lift in the mode `text`
    "passed on",  # the supervisor has a new wish
    "ends",  # a requester sends END; with `passed_on` the supervisor sends it
    "has",  # a requester has the device now
    "lost",  # `text` had the device until now
    "result",  # a workcell gives the requester's request another result: `text`
    "met",  # RMF sees a requester's wish fulfilled
    "gone",  # a requester has stopped asking, without END
    "over",  # a requester's visit has ended
    "fault",  # the diagnosis `who` reports a new fault with the code `text`
    "fault over",
    "refused",  # the node of the diagnosis `who` has refused a request, for the reason `text`
]


@dataclass(frozen=True, slots=True)
class News:
    """One change that a message makes. `who`: the requester, as a text. `requester`: its memory, if it
    has sent a request. `text`: its meaning depends on `what` (see `What`). `gap_s`: the length (s)
    of the silence or hold that has ended."""

    what: What
    at: Moment
    who: str = ""
    text: str = ""
    requester: DeviceRequester | None = None
    gap_s: float = 0.0
    passed_on: bool = False
